//! Quantities that follow from the units `sigma = g = rho = 1` alone.

/// Mass of the droplet, `M = rho a0 = pi/4`.
pub const MASS: f64 = std::f64::consts::FRAC_PI_4;

/// Edge length of the regular ring of area `a0 = pi/4`, `l0 = sqrt(4 a0 N_v tan(pi/N_v))/N_v`.
///
/// ```
/// // N_v l0 tends to the circumference pi.
/// assert!((1024.0 * meniscus::parameters::regular_edge(1024) - std::f64::consts::PI).abs() < 1e-5);
/// ```
pub fn regular_edge(n_vertices: usize) -> f64 {
    let n = n_vertices as f64;
    let tan = libm::tan(std::f64::consts::PI / n);
    (4.0 * MASS * n * tan).sqrt() / n
}
