//! placeholder
pub(crate) fn solve_symmetric(a: &mut [f64], n: usize, stride: usize, b: &mut [f64]) -> bool {
    for k in 0..n {
        let d = a[k * stride + k]; if !(d > 0.0) { return false; }
        for i in k + 1..n { let f = a[i * stride + k] / d; for j in k + 1..=i { let v = a[j * stride + k]; a[i * stride + j] -= f * v; } }
        // column scaled later
    }
    // forward: L = a[i][k]/d_k
    for k in 0..n { let d = a[k * stride + k]; for i in k + 1..n { b[i] -= a[i * stride + k] / d * b[k]; } }
    for k in (0..n).rev() { let d = a[k * stride + k]; let mut v = b[k]; for i in k + 1..n { v -= a[i * stride + k] * b[i]; } b[k] = v / d; }
    true
}
