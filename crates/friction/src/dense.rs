//! Straight-line dense kernels without allocation. Fused multiply-add is written out: the compiler may not contract, and the
//! explicit form gives the same bits on every machine that has it.

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

/// `dst += x a + y b + z c + w d`, all of one length.
#[inline]
fn add_four(dst: &mut [f64], columns: [&[f64]; 4], factors: [f64; 4]) {
    let n = dst.len();
    let [a, b, c, d] = columns.map(|column| &column[..n]);
    let [x, y, z, w] = factors;
    for i in 0..n {
        dst[i] = w.mul_add(d[i], z.mul_add(c[i], y.mul_add(b[i], x.mul_add(a[i], dst[i]))));
    }
}

/// Gaussian elimination with row pivoting, in place: `a` (n rows and columns, leading dimension `ld`, column by column) becomes
/// its unit lower and upper factors. Returns the ratio of smallest to largest pivot; 0 when singular.
///
/// Panels of four columns: the rest of the matrix is then touched once per panel, which is what it costs. `right` further columns
/// of `a` are right-hand sides: the lower factor is applied to them on the way, [`upper_solve`] finishes them.
pub fn lu_factor(a: &mut [f64], ld: usize, n: usize, right: usize, pivots: &mut [usize]) -> f64 {
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for start in (0..n).step_by(PANEL) {
        let end = (start + PANEL).min(n);
        let (left, trailing) = a.split_at_mut(end * ld);
        for k in start..end {
            let (done, rest) = left.split_at_mut((k + 1) * ld);
            let column = &mut done[k * ld..k * ld + n];
            let mut pivot = k;
            for i in k + 1..n {
                if column[i].abs() > column[pivot].abs() {
                    pivot = i;
                }
            }
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
            for other in done[start * ld..k * ld].chunks_mut(ld) {
                other.swap(k, pivot);
            }
        }
        let panel = |k: usize| &left[(start + k) * ld..(start + k) * ld + n];
        for other in trailing.chunks_mut(ld).take(n + right - end) {
            for k in start..end {
                other.swap(k, pivots[k]);
            }
            for k in start..end {
                let factor = -other[k];
                for i in k + 1..end {
                    other[i] = factor.mul_add(left[k * ld + i], other[i]);
                }
            }
            if end - start == PANEL {
                let factors = [-other[start], -other[start + 1], -other[start + 2], -other[start + 3]];
                let columns = [&panel(0)[end..], &panel(1)[end..], &panel(2)[end..], &panel(3)[end..]];
                add_four(&mut other[end..n], columns, factors);
            }
        }
    }
    if n == 0 { 1.0 } else { smallest / largest }
}

/// Columns of a panel.
const PANEL: usize = 4;

/// Solves with the upper factor of [`lu_factor`]; `rhs` has `columns` columns with leading dimension `ld`.
pub fn upper_solve(a: &[f64], ld: usize, n: usize, rhs: &mut [f64], columns: usize) {
    for x in rhs.chunks_mut(ld).take(columns) {
        let mut end = n;
        while end > 0 {
            let start = if end >= PANEL { end - PANEL } else { 0 };
            for k in (start..end).rev() {
                x[k] /= a[k * ld + k];
                for i in start..k {
                    x[i] = (-x[k]).mul_add(a[k * ld + i], x[i]);
                }
            }
            let (head, tail) = x.split_at_mut(start);
            if end - start == PANEL {
                let column = |k: usize| &a[(start + k) * ld..(start + k) * ld + start];
                add_four(head, [column(0), column(1), column(2), column(3)], [-tail[0], -tail[1], -tail[2], -tail[3]]);
            } else {
                for k in start..end {
                    add_one(head, &a[k * ld..k * ld + start], -tail[k - start]);
                }
            }
            end = start;
        }
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
