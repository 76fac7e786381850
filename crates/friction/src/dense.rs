//! Straight-line dense kernels without allocation. Fused multiply-add is written out: the compiler may not contract,
//! and the explicit form gives the same bits on every machine that has it.

/// `dst += x a + y b + z c`, all of one length.
#[inline]
pub fn add_three(dst: &mut [f64], a: &[f64], b: &[f64], c: &[f64], x: f64, y: f64, z: f64) {
    let n = dst.len();
    let (a, b, c) = (&a[..n], &b[..n], &c[..n]);
    for i in 0..n {
        dst[i] = z.mul_add(c[i], y.mul_add(b[i], x.mul_add(a[i], dst[i])));
    }
}

/// `dst += x a`.
#[inline]
pub fn add_one(dst: &mut [f64], a: &[f64], x: f64) {
    let n = dst.len();
    let a = &a[..n];
    for i in 0..n {
        dst[i] = x.mul_add(a[i], dst[i]);
    }
}

/// Dot product in eight independent lanes, summed in a fixed order.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sum = [0.0; LANES];
    let (mut chunks_a, mut chunks_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    for (x, y) in chunks_a.by_ref().zip(chunks_b.by_ref()) {
        for lane in 0..LANES {
            sum[lane] = x[lane].mul_add(y[lane], sum[lane]);
        }
    }
    let mut tail = 0.0;
    for (x, y) in chunks_a.remainder().iter().zip(chunks_b.remainder()) {
        tail = x.mul_add(*y, tail);
    }
    ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7])) + tail
}

/// Columns of a panel of the elimination.
const PANEL: usize = 8;

/// `dst += sum_k factor_k column_k`, all of one length.
#[inline]
fn add_panel(dst: &mut [f64], columns: [&[f64]; PANEL], factors: [f64; PANEL]) {
    let n = dst.len();
    let columns = columns.map(|column| &column[..n]);
    for i in 0..n {
        let mut x = dst[i];
        for k in 0..PANEL {
            x = factors[k].mul_add(columns[k][i], x);
        }
        dst[i] = x;
    }
}

/// [`add_panel`] on two columns.
#[inline]
fn add_panel_twice(p: &mut [f64], q: &mut [f64], columns: [&[f64]; PANEL], a: [f64; PANEL], b: [f64; PANEL]) {
    let n = p.len();
    let q = &mut q[..n];
    let columns = columns.map(|column| &column[..n]);
    for i in 0..n {
        let (mut x, mut y) = (p[i], q[i]);
        for k in 0..PANEL {
            x = a[k].mul_add(columns[k][i], x);
            y = b[k].mul_add(columns[k][i], y);
        }
        p[i] = x;
        q[i] = y;
    }
}

/// Row of the largest absolute value.
#[inline]
fn largest_row(column: &[f64]) -> usize {
    const LANES: usize = 8;
    let mut best = [0.0_f64; LANES];
    let chunks = column.chunks_exact(LANES);
    let tail = chunks.remainder().iter().fold(0.0_f64, |m, x| if x.abs() > m { x.abs() } else { m });
    for chunk in chunks {
        for lane in 0..LANES {
            let x = chunk[lane].abs();
            best[lane] = if x > best[lane] { x } else { best[lane] };
        }
    }
    let largest = best.iter().fold(tail, |m, x| if *x > m { *x } else { m });
    column.iter().position(|x| x.abs() == largest).unwrap_or(0)
}

/// Gaussian elimination with row pivoting, in place: `a` (n rows and columns, leading dimension `ld`, column by column)
/// becomes its unit lower and upper factors. Returns the ratio of smallest to largest pivot; 0 when singular.
///
/// Panels of columns: the rest of the matrix is then touched once per panel, which is what it costs. `right` further
/// columns of `a` are right-hand sides: the lower factor is applied to them on the way, [`upper_solve`] finishes them.
pub fn lu_factor(a: &mut [f64], ld: usize, n: usize, right: usize, pivots: &mut [usize]) -> f64 {
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for start in (0..n).step_by(PANEL) {
        let end = (start + PANEL).min(n);
        let (left, trailing) = a.split_at_mut(end * ld);
        for k in start..end {
            let (done, rest) = left.split_at_mut((k + 1) * ld);
            let (before, column) = done.split_at_mut(k * ld);
            let column = &mut column[..n];
            let pivot = k + largest_row(&column[k..]);
            pivots[k] = pivot;
            let value = column[pivot];
            smallest = smallest.min(value.abs());
            largest = largest.max(value.abs());
            if value == 0.0 || !value.is_finite() {
                return 0.0;
            }
            column.swap(k, pivot);
            let inverse = 1.0 / value;
            for entry in &mut column[k + 1..] {
                *entry *= inverse;
            }
            for other in rest.chunks_mut(ld).take(end - k - 1) {
                other.swap(k, pivot);
                let factor = -other[k];
                add_one(&mut other[k + 1..n], &column[k + 1..], factor);
            }
            // Within the panel the lower factor's rows follow the swap, so that the update below may use whole columns.
            for other in before[start * ld..].chunks_mut(ld) {
                other.swap(k, pivot);
            }
        }
        if end - start < PANEL {
            // The last, narrow panel: only right-hand sides are left.
            for other in trailing.chunks_mut(ld).take(right) {
                for k in start..end {
                    other.swap(k, pivots[k]);
                }
                for k in start..end {
                    let factor = -other[k];
                    add_one(&mut other[k + 1..n], &left[k * ld + k + 1..k * ld + n], factor);
                }
            }
            break;
        }
        let columns: [&[f64]; PANEL] = std::array::from_fn(|k| &left[(start + k) * ld..(start + k) * ld + n]);
        let lower: [[f64; PANEL]; PANEL] = std::array::from_fn(|k| std::array::from_fn(|i| columns[k][start + i]));
        let below = columns.map(|column| &column[end..]);
        // Swaps and the panel's own triangle; returns what the panel's columns contribute below.
        let reduce = |column: &mut [f64]| {
            for k in start..end {
                column.swap(k, pivots[k]);
            }
            let mut x: [f64; PANEL] = std::array::from_fn(|k| column[start + k]);
            for k in 0..PANEL {
                for i in k + 1..PANEL {
                    x[i] = (-x[k]).mul_add(lower[k][i], x[i]);
                }
            }
            column[start..end].copy_from_slice(&x);
            x.map(|x| -x)
        };
        // Two columns at a time: each of the panel's columns is loaded once for both.
        let columns_left = n + right - end;
        let used = if columns_left == 0 { 0 } else { (columns_left - 1) * ld + n };
        for pair in trailing[..used].chunks_mut(2 * ld) {
            if pair.len() > ld {
                let (first, second) = pair.split_at_mut(ld);
                let (x, y) = (reduce(first), reduce(second));
                add_panel_twice(&mut first[end..n], &mut second[end..n], below, x, y);
            } else {
                let x = reduce(pair);
                add_panel(&mut pair[end..n], below, x);
            }
        }
    }
    if n == 0 { 1.0 } else { smallest / largest }
}

/// Solves with the upper factor of [`lu_factor`]; `rhs` has `columns` columns with leading dimension `ld`.
pub fn upper_solve(a: &[f64], ld: usize, n: usize, rhs: &mut [f64], columns: usize) {
    let mut end = n;
    while end > 0 {
        let start = end.saturating_sub(PANEL);
        let width = end - start;
        let mut inverse = [0.0; PANEL];
        for k in 0..width {
            inverse[k] = 1.0 / a[(start + k) * ld + start + k];
        }
        for x in rhs.chunks_mut(ld).take(columns) {
            let (head, tail) = x.split_at_mut(start);
            for k in (0..width).rev() {
                tail[k] *= inverse[k];
                for i in 0..k {
                    tail[i] = (-tail[k]).mul_add(a[(start + k) * ld + start + i], tail[i]);
                }
            }
            if width == PANEL {
                let columns = std::array::from_fn(|k| &a[(start + k) * ld..(start + k) * ld + start]);
                add_panel(head, columns, std::array::from_fn(|k| -tail[k]));
            } else {
                for k in 0..width {
                    add_one(head, &a[(start + k) * ld..(start + k) * ld + start], -tail[k]);
                }
            }
        }
        end = start;
    }
}

/// Solves with the factors of [`lu_factor`]; `rhs` has `columns` columns with leading dimension `ld`.
pub fn lu_solve(a: &[f64], ld: usize, n: usize, pivots: &[usize], rhs: &mut [f64], columns: usize) {
    for x in rhs.chunks_mut(ld).take(columns) {
        for start in (0..n).step_by(PANEL) {
            let end = (start + PANEL).min(n);
            // The factorisation swapped rows panel by panel; so must the right-hand side.
            for k in start..end {
                x.swap(k, pivots[k]);
            }
            for k in start..end {
                let factor = -x[k];
                add_one(&mut x[k + 1..n], &a[k * ld + k + 1..k * ld + n], factor);
            }
        }
    }
    upper_solve(a, ld, n, rhs, columns);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_solves_a_system_that_needs_every_swap() {
        let (n, ld) = (4, 5);
        let rows = [[0.0, 2.0, 1.0, -1.0], [1e-3, 1.0, 0.0, 3.0], [4.0, -2.0, 0.5, 1.0], [2.0, 1.0, 7.0, 0.0]];
        let solution = [1.0, -2.0, 0.5, 3.0];
        let mut a = vec![0.0; ld * n];
        let mut rhs = vec![0.0; ld];
        for i in 0..n {
            for j in 0..n {
                a[j * ld + i] = rows[i][j];
                rhs[i] += rows[i][j] * solution[j];
            }
        }
        let mut pivots = [0; 4];
        assert!(lu_factor(&mut a, ld, n, 0, &mut pivots) > 0.0);
        lu_solve(&a, ld, n, &pivots, &mut rhs, 1);
        for i in 0..n {
            assert!((rhs[i] - solution[i]).abs() < 1e-14, "{rhs:?}");
        }
        assert_eq!(lu_factor(&mut [0.0; 4], 2, 2, 0, &mut pivots), 0.0, "a singular matrix is said so");
    }

    #[test]
    fn every_size_around_the_panel_width_is_solved() {
        for n in 1..20 {
            let ld = n + 3;
            let mut seed = 7 + n as u64;
            let mut random = || {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (seed >> 33) as f64 / f64::from(1u32 << 30) - 1.0
            };
            let a: Vec<f64> = (0..ld * n).map(|_| random()).collect();
            let x: Vec<f64> = (0..n).map(|_| random()).collect();
            let mut rhs = vec![0.0; 2 * ld];
            for j in 0..n {
                for i in 0..n {
                    rhs[i] += a[j * ld + i] * x[j];
                    rhs[ld + i] -= a[j * ld + i] * x[j];
                }
            }
            let mut factors = a.clone();
            let mut pivots = vec![0; n];
            assert!(lu_factor(&mut factors, ld, n, 0, &mut pivots) > 0.0);
            lu_solve(&factors, ld, n, &pivots, &mut rhs, 2);
            for i in 0..n {
                assert!((rhs[i] - x[i]).abs() < 1e-10 && (rhs[ld + i] + x[i]).abs() < 1e-10, "size {n}: {rhs:?} {x:?}");
            }
        }
    }
}
