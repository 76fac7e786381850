//! The four inner loops of the solver: dot products and linear combinations of columns, one and four columns at a time.
//!
//! Sums are kept in four independent lanes, which lets the compiler use vector instructions without being allowed to
//! reorder floating-point sums. The order of summation is fixed, so results are the same on every run.

const LANES: usize = 4;

/// `aᵀ b`.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut lanes = [0.0; LANES];
    let (mut ca, mut cb) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    for (x, y) in ca.by_ref().zip(cb.by_ref()) {
        for i in 0..LANES {
            lanes[i] = x[i].mul_add(y[i], lanes[i]);
        }
    }
    let mut sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    for (x, y) in ca.remainder().iter().zip(cb.remainder()) {
        sum = x.mul_add(*y, sum);
    }
    sum
}

/// `[a0ᵀ b, a1ᵀ b, a2ᵀ b, a3ᵀ b]`.
#[inline]
pub fn dot4(a: [&[f64]; 4], b: &[f64]) -> [f64; 4] {
    let n = b.len();
    let [a0, a1, a2, a3] = a.map(|x| &x[..n]);
    let mut lanes = [[0.0; LANES]; 4];
    let full = n / LANES * LANES;
    let mut i = 0;
    while i < full {
        let y: &[f64; LANES] = b[i..i + LANES].try_into().expect("LANES elements");
        let x: [&[f64; LANES]; 4] = [a0, a1, a2, a3].map(|c| c[i..i + LANES].try_into().expect("LANES elements"));
        for k in 0..4 {
            for l in 0..LANES {
                lanes[k][l] = x[k][l].mul_add(y[l], lanes[k][l]);
            }
        }
        i += LANES;
    }
    let mut sums = lanes.map(|l| (l[0] + l[2]) + (l[1] + l[3]));
    for i in full..n {
        for (sum, column) in sums.iter_mut().zip([a0, a1, a2, a3]) {
            *sum = column[i].mul_add(b[i], *sum);
        }
    }
    sums
}

/// `y += alpha x`.
#[inline]
pub fn axpy(alpha: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = alpha.mul_add(*x, *y);
    }
}

/// `y += alpha0 x0 + alpha1 x1 + alpha2 x2 + alpha3 x3`.
#[inline]
pub fn axpy4(alpha: [f64; 4], x: [&[f64]; 4], y: &mut [f64]) {
    let n = y.len();
    let [x0, x1, x2, x3] = x.map(|x| &x[..n]);
    for i in 0..n {
        y[i] = alpha[3].mul_add(x3[i], alpha[2].mul_add(x2[i], alpha[1].mul_add(x1[i], alpha[0].mul_add(x0[i], y[i]))));
    }
}

/// `y += M[.., ..columns] a`, with M stored by columns of length `stride`, rows `first..first + y.len()`.
#[inline]
pub fn combine(matrix: &[f64], stride: usize, first: usize, a: &[f64], y: &mut [f64]) {
    let n = y.len();
    let full = a.len() / 4 * 4;
    let mut j = 0;
    while j < full {
        let alpha = [a[j], a[j + 1], a[j + 2], a[j + 3]];
        if alpha != [0.0; 4] {
            let at = |k: usize| &matrix[(j + k) * stride + first..(j + k) * stride + first + n];
            axpy4(alpha, [at(0), at(1), at(2), at(3)], y);
        }
        j += 4;
    }
    for (k, alpha) in a.iter().enumerate().skip(full) {
        if *alpha != 0.0 {
            axpy(*alpha, &matrix[k * stride + first..k * stride + first + n], y);
        }
    }
}

/// `out = M[.., ..out.len()]ᵀ b`, with M stored by columns of length `stride`, rows `first..first + b.len()`.
#[inline]
pub fn project(matrix: &[f64], stride: usize, first: usize, b: &[f64], out: &mut [f64]) {
    let n = b.len();
    let at = |k: usize| &matrix[k * stride + first..k * stride + first + n];
    let columns = out.len();
    let full = columns / 4 * 4;
    let mut j = 0;
    while j < full {
        out[j..j + 4].copy_from_slice(&dot4([at(j), at(j + 1), at(j + 2), at(j + 3)], b));
        j += 4;
    }
    for (k, product) in out.iter_mut().enumerate().skip(full) {
        *product = dot(at(k), b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_agree_with_plain_sums_at_every_length() {
        for n in 0..23_usize {
            let column = |k: usize| (0..n).map(|i| ((i * 7 + k * 13) % 11) as f64 - 5.0).collect::<Vec<_>>();
            let b = column(9);
            let matrix: Vec<f64> = (0..6).flat_map(column).collect();
            let plain: Vec<f64> = (0..6).map(|k| column(k).iter().zip(&b).map(|(x, y)| x * y).sum()).collect();
            assert_eq!(dot(&column(0), &b), plain[0]); // small integers: exact
            let mut out = vec![0.0; 6];
            project(&matrix, n, 0, &b, &mut out);
            assert_eq!(out, plain);
            let a = [1.0, -2.0, 3.0, 0.0, 5.0, -1.0];
            let mut y = b.clone();
            combine(&matrix, n, 0, &a, &mut y);
            for i in 0..n {
                assert_eq!(y[i], b[i] + (0..6).map(|k| a[k] * column(k)[i]).sum::<f64>());
            }
        }
    }
}
