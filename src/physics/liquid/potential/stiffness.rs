//! The second derivatives of the energy.

use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::{Polygon, following};
use crate::physics::liquid::potential::{Evaluation, Potential};
use crate::physics::walls::wall::{Obstacle, Walls};
use nalgebra::{Matrix4, SymmetricEigen};

/// The pressure and the pushes that second derivatives are taken for. On the way to a solution a shape is a little
/// compressed and overlaps walls a little. Liquid and walls are so stiff that its own pressure and pushes are then far
/// from those of the solution, and would make the matrix indefinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foreseen {
    /// The pressure of the liquid.
    pub(crate) pressure: f64,
    /// The largest push of a wall on a vertex. At zero strings lose their negative stiffness too: where the liquid draws
    /// back from a round wall, they cannot hold it there.
    pub(crate) push: f64,
}

impl<W: Walls> Potential<W> {
    /// Sets the second derivatives at `shape`, which `out` evaluates. They are those for the pressure and the pushes that
    /// are `foreseen`.
    pub(crate) fn differentiate_twice(
        &self,
        shape: &Polygon,
        nearby: &Nearby<W::Obstacle>,
        foreseen: Foreseen,
        out: &mut Evaluation,
    ) {
        let Foreseen { pressure, push: most } = foreseen;
        let n = shape.len();
        out.curvature.clear(n);
        for i in 0..n {
            let j = following(i, n);
            let (nx, ny, length) = (out.edges.nx[i], out.edges.ny[i], out.edges.length[i]);
            let (xi, yi, xj, yj) = (shape.x[i] - out.x, shape.y[i] - out.y, shape.x[j] - out.x, shape.y[j] - out.y);
            let (xx, xy, yy) = (nx * nx, nx * ny, ny * ny);
            let k = self.gamma / length;
            let h = -0.5 * pressure;
            let q = -out.load.weight / 6.0;
            let term = [
                [k * xx + 2.0 * q * yj, k * xy - q * xj, -k * xx + q * (yj - yi), -k * xy + h + q * (2.0 * xi + xj)],
                [k * xy - q * xj, k * yy, -k * xy - h - q * (xi + 2.0 * xj), -k * yy],
                [-k * xx + q * (yj - yi), -k * xy - h - q * (xi + 2.0 * xj), k * xx - 2.0 * q * yi, k * xy + q * xi],
                [-k * xy + h + q * (2.0 * xi + xj), -k * yy, k * xy + q * xi, k * yy],
            ];
            out.curvature.add_edge(i, &term);
        }
        for string in &out.strings {
            let stiffness = string.stiffness(&out.load);
            let stiffness = if most > 0.0 { stiffness } else { positive_part(stiffness) };
            out.curvature.add_edge(string.edge, &stiffness);
        }
        for near in &nearby.obstacles {
            for &i in &near.vertices {
                let [x, y] = shape.at(i);
                let Some((depth, [nx, ny])) = near.obstacle.touch_point(x, y, self.reach) else { continue };
                let turning = (self.k_w * depth).min(most) * near.obstacle.curvature_at(x, y);
                let term = |a: f64, b: f64, own: f64| self.k_w * a * b - turning * (own - a * b);
                out.curvature.add_vertex(i, [term(nx, nx, 1.0), term(nx, ny, 0.0), term(ny, ny, 1.0)]);
            }
        }
        for touch in &out.touches {
            if let Some(folds) = &self.folds {
                out.curvature.add_far(touch.vertices, folds.stiffness(shape, touch));
            }
        }
    }
}

/// A symmetric matrix without its negative eigenvalues.
fn positive_part(matrix: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let whole = SymmetricEigen::new(Matrix4::from_fn(|i, j| 0.5 * (matrix[i][j] + matrix[j][i])));
    let positive = SymmetricEigen { eigenvalues: whole.eigenvalues.map(|value| value.max(0.0)), ..whole };
    let part = positive.recompose();
    std::array::from_fn(|i| std::array::from_fn(|j| part[(i, j)]))
}
