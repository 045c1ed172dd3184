//! The contacts at one instant: energy, deepest overlap, and the load that each obstacle carries.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::contact::{Contact, stretches::edges_at};
use crate::physics::simd::LANES;
use crate::physics::walls::wall::{Obstacle, ObstacleQueries, Walls};
use fearless_simd::Fallback;

/// The load that one obstacle carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Number of the obstacle.
    pub id: u32,
    /// Mean point of contact, weighted by the force, in local coordinates.
    pub at: [f64; 2],
    /// Force on the droplet.
    pub force: [f64; 2],
    /// Angle by which the normal turns along the contact, in radians.
    pub turn: f64,
}

/// The contacts at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactState {
    /// Their energy.
    pub energy: f64,
    /// Deepest overlap `delta/2 - d`, in sigma.
    pub overlap: f64,
    /// Loads, by the number of the obstacle.
    pub loads: Vec<Load>,
}

impl<W: Walls> Contact<W> {
    pub(super) fn state_at(&self, ring: &Ring) -> ContactState {
        let simd = Fallback::new();
        let mut state = ContactState::default();
        for stretch in &self.stretches.items {
            let id = stretch.obstacle.id();
            for start in (stretch.start..stretch.end).step_by(LANES) {
                let edges = edges_at(simd, ring, start, self.share);
                let Some(touch) = simd.touch(&stretch.obstacle, edges, self.reach) else { continue };
                for lane in 0..LANES.min(ring.n.saturating_sub(start)) {
                    let overlap = touch.overlap.as_slice()[lane];
                    if overlap <= 0.0 {
                        continue;
                    }
                    let stiffness = self.stiffness[start + lane];
                    state.energy += 0.5 * stiffness * overlap * overlap;
                    state.overlap = state.overlap.max(overlap);
                    let [q, x, y, ex, ey] =
                        [touch.q, edges.x, edges.y, edges.ex, edges.ey].map(|vector| vector.as_slice()[lane]);
                    let normal = [touch.nx.as_slice()[lane], touch.ny.as_slice()[lane]];
                    add_load(&mut state.loads, id, [x + q * ex, y + q * ey], normal, stiffness * overlap);
                }
            }
        }
        state.loads.iter_mut().for_each(finish_load);
        state
    }
}

/// Adds the push of one edge to the load of obstacle `id`. Until [`finish_load`], `at` is the sum of places times
/// pushes, and `turn` is the sum of the pushes.
pub(crate) fn add_load(loads: &mut Vec<Load>, id: u32, at: [f64; 2], normal: [f64; 2], push: f64) {
    if loads.last().is_none_or(|load| load.id != id) {
        loads.push(Load { id, at: [0.0; 2], force: [0.0; 2], turn: 0.0 });
    }
    if let Some(load) = loads.last_mut() {
        for k in 0..2 {
            load.at[k] += push * at[k];
            load.force[k] += push * normal[k];
        }
        load.turn += push;
    }
}

/// Divides the sums by the total push, and finds the angle. Pushes along a contact whose normals spread evenly over an
/// angle `turn` cancel in part, `|force| = push sin(turn/2)/(turn/2)`, which is solved by bisection.
pub(crate) fn finish_load(load: &mut Load) {
    let push = load.turn;
    load.at = load.at.map(|sum| sum / push);
    let share = (load.force[0] * load.force[0] + load.force[1] * load.force[1]).sqrt() / push;
    let (mut low, mut high) = (0.0, 2.0 * std::f64::consts::PI);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if libm::sin(0.5 * middle) / (0.5 * middle) > share { low = middle } else { high = middle }
    }
    load.turn = 0.5 * (low + high);
}
