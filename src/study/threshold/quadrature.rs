//! Integrals by the rule of Gauss and Legendre.

use std::f64::consts::PI;

/// Nodes of the rule where nothing else is asked for; the thresholds of the paper's orifices have then ten digits.
pub const DEFAULT_NODES: usize = 48;

/// Nodes on [0, 1] and their weights.
#[derive(Clone, Debug)]
pub(super) struct Rule {
    nodes: Vec<[f64; 2]>,
}

impl Rule {
    /// The rule of `n` nodes, which are roots of the Legendre polynomial of that degree, found by Newton's method.
    pub(super) fn new(n: usize) -> Self {
        let node = |k: usize| {
            let mut x = libm::cos(PI * (k as f64 + 0.75) / (n as f64 + 0.5));
            for _ in 0..20 {
                let (value, slope) = legendre(n, x);
                x -= value / slope;
            }
            let (_, slope) = legendre(n, x);
            [0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope)]
        };
        Self { nodes: (0..n).map(node).collect() }
    }

    /// The nodes on [0, 1] with their weights.
    pub(super) fn nodes(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.nodes.iter().copied()
    }
}

/// The Legendre polynomial of degree `n` and its derivative at x, inside (-1, 1).
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, n as f64 * (x * value - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n_nodes_integrate_polynomials_of_degree_2n_minus_1_and_no_higher() {
        for n in [2, 5, 12] {
            let rule = Rule::new(n);
            let error = |degree: i32| {
                let sum: f64 = rule.nodes().map(|[x, weight]| weight * x.powi(degree)).sum();
                (sum * f64::from(degree + 1) - 1.0).abs()
            };
            let exact = 2 * n as i32 - 1;
            assert!((0..=exact).all(|degree| error(degree) < 1e-14), "{n}");
            assert!(error(exact + 1) > 1e-13, "{n}: {}", error(exact + 1));
        }
    }
}
