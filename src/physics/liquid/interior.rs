//! placeholder
use std::f64::consts::PI;
#[derive(Debug)]
pub(crate) struct Interior { n: usize, q: Vec<f64> }
impl Interior {
    pub(crate) fn new(n: usize) -> Self { Self { n, q: vec![0.0; n * n] } }
    pub(crate) fn row(&self, i: usize) -> &[f64] { &self.q[i * self.n..(i + 1) * self.n] }
    pub(crate) fn assemble(&mut self, x: &[f64], y: &[f64]) -> bool {
        let n = self.n; let mut t = vec![0.0; n * n]; let mut h = vec![0.0; n * n];
        let nx = |i: usize| if i + 1 == n { 0 } else { i + 1 };
        let l: Vec<f64> = (0..n).map(|i| (x[nx(i)] - x[i]).hypot(y[nx(i)] - y[i])).collect(); let per: f64 = l.iter().sum();
        for i in 0..n { let i2 = nx(i); let (mx, my) = (0.5 * (x[i] + x[i2]), 0.5 * (y[i] + y[i2]));
            for j in 0..n { let j2 = nx(j);
                let (gg, hh);
                if i == j { gg = l[i] / (2.0 * PI) * (1.0 - (0.5 * l[i]).ln()); hh = 0.5; } else {
                    let (ax, ay, bx, by) = (x[j] - mx, y[j] - my, x[j2] - mx, y[j2] - my); let (ex, ey) = (bx - ax, by - ay);
                    let th = (ax * by - ay * bx).atan2(ax * bx + ay * by); hh = -th / (2.0 * PI);
                    let (s, s2) = ((ex * ax + ey * ay) / l[j], (ex * bx + ey * by) / l[j]); let d = (ey * ax - ex * ay) / l[j];
                    gg = -(0.5 * (s2 * (bx * bx + by * by).ln() - s * (ax * ax + ay * ay).ln()) - (s2 - s) + d.abs() * th.abs()) / (2.0 * PI); }
                t[i * n + j] = gg; h[i * n + j] = hh + l[j] / per; } }
        for k in 0..n { let d = 1.0 / h[k * n + k]; for i in k + 1..n { let f = h[i * n + k] * d; for j in k + 1..n { h[i * n + j] -= f * h[k * n + j]; } for j in 0..n { t[i * n + j] -= f * t[k * n + j]; } } }
        for i in (0..n).rev() { for k in i + 1..n { let f = h[i * n + k]; for j in 0..n { t[i * n + j] -= f * t[k * n + j]; } } let d = 1.0 / h[i * n + i]; for j in 0..n { t[i * n + j] *= d; } }
        let w: Vec<f64> = l.iter().map(|l| l / per).collect(); let b = &mut self.q;
        for i in 0..n { let m: f64 = t[i * n..(i + 1) * n].iter().sum(); for j in 0..n { b[i * n + j] = l[i] * (t[i * n + j] - m * w[j]); } }
        for j in 0..n { let m: f64 = (0..n).map(|i| b[i * n + j]).sum(); for i in 0..n { b[i * n + j] -= w[i] * m; } }
        for i in 0..n { for j in 0..i { let m = 0.5 * (b[i * n + j] + b[j * n + i]); b[i * n + j] = m; b[j * n + i] = m; } }
        b.iter().all(|v| v.is_finite())
    }
}
