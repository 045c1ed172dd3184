//! The coefficients of one implicit step by second-order backward differences, and what it keeps of the step before.

use crate::physics::motion::implicit::{field::Field, potential::Potential};
use crate::physics::ring::Ring;
use crate::physics::ring::forces::drag::Rates;
use crate::physics::simd::{Instructions, LANES, fma, load, store};
use fearless_simd::{f64x8, prelude::*};

#[derive(Debug)]
pub(super) struct Earlier {
    /// Dx, the change of the positions.
    pub(super) moved: Field,
    /// Dv, the change of the velocities.
    pub(super) gained: Field,
    /// Its length; infinite makes the next step one of backward Euler.
    pub(super) step: f64,
}

impl Earlier {
    /// Before the first step of a ring of `n` vertices.
    pub(super) fn none(n: usize) -> Self {
        Self { moved: Field::zero(n), gained: Field::zero(n), step: f64::INFINITY }
    }
}

/// The coefficients of one step.
#[derive(Clone, Copy)]
pub(super) struct Scheme {
    /// h, its length.
    h: f64,
    /// r, the ratio of h to the length of the step before.
    ratio: f64,
    /// s, the implicit share of the step.
    s: f64,
    /// `r^2/(1 + 2r)`, how much of the earlier change is kept.
    keep: f64,
}

impl Scheme {
    /// A step of length `h`, `ratio` times as long as the one before.
    pub(super) fn of(h: f64, ratio: f64) -> Self {
        let both = 1.0 + 2.0 * ratio;
        Self { h, ratio, s: h * (1.0 + ratio) / both, keep: ratio * ratio / both }
    }

    /// h.
    pub(super) const fn length(self) -> f64 {
        self.h
    }

    /// The error of the step over its distance from what was foreseen. Both are multiples of the third derivative, or of
    /// the second where nothing is known of earlier steps.
    pub(super) fn error_share(self) -> f64 {
        if self.ratio == 0.0 {
            return 0.5;
        }
        let before = 1.0 / self.ratio;
        let own = (1.0 + before) * (1.0 + before) / (6.0 * (2.0 + before));
        own / (own + 1.0 / 6.0 + 0.25 * before)
    }

    /// Predicts the displacement with velocities that go on changing as before: `d = h (v + r/2 Dv)`.
    #[inline(always)]
    pub(super) fn foresee<S: Instructions>(self, simd: S, ring: &Ring, earlier: &Earlier, displacement: &mut Field) {
        let (h, half_change) = (f64x8::splat(simd, self.h), f64x8::splat(simd, 0.5 * self.h * self.ratio));
        let Field { x, y } = displacement;
        for (to, v, gained) in
            [(&mut x[..], &ring.ux[..], &earlier.gained.x[..]), (&mut y[..], &ring.uy[..], &earlier.gained.y[..])]
        {
            for i in (0..v.len()).step_by(LANES) {
                store(fma(load(simd, gained, i), half_change, load(simd, v, i) * h), to, i);
            }
        }
    }

    /// Sets the weights and the free displacements of the potential.
    #[inline(always)]
    pub(super) fn aim<S: Simd>(
        self,
        simd: S,
        ring: &Ring,
        drag: Rates<'_>,
        earlier: &Earlier,
        potential: &mut Potential,
    ) {
        let Self { s, keep, .. } = self;
        let inertia = ring.vertex_mass() / (s * s);
        for i in (0..potential.weight.len()).step_by(LANES) {
            let damping = f64x8::splat(simd, 1.0) + drag.load(simd, i) * s;
            store(damping * inertia, &mut potential.weight, i);
            let share = s / damping;
            let vx = load(simd, &ring.ux, i) + load(simd, &earlier.gained.x, i) * keep;
            let vy = load(simd, &ring.uy, i) + load(simd, &earlier.gained.y, i) * keep;
            store(load(simd, &earlier.moved.x, i) * keep + vx * share, &mut potential.free.x, i);
            store(load(simd, &earlier.moved.y, i) * keep + vy * share, &mut potential.free.y, i);
        }
    }

    /// The new velocities `v+ = (d - keep Dx)/s` of eight vertices that move by `d` after `moved` in the step before.
    #[inline(always)]
    fn velocity<S: Instructions>(self, simd: S, d: f64x8<S>, moved: f64x8<S>) -> f64x8<S> {
        let (inverse, less) = (f64x8::splat(simd, 1.0 / self.s), f64x8::splat(simd, -self.keep / self.s));
        fma(moved, less, d * inverse)
    }

    /// The new velocities.
    #[inline(always)]
    pub(super) fn velocities<S: Instructions>(self, simd: S, d: &Field, earlier: &Earlier, v: &mut Field) {
        for ((v, d), moved) in v.parts_mut().into_iter().zip(d.parts()).zip(earlier.moved.parts()) {
            for i in (0..d.len()).step_by(LANES) {
                store(self.velocity(simd, load(simd, d, i), load(simd, moved, i)), v, i);
            }
        }
    }

    /// Sets the new velocities, and remembers the step.
    #[inline(always)]
    pub(super) fn accept<S: Instructions>(self, simd: S, ring: &mut Ring, d: &Field, earlier: &mut Earlier) {
        let Earlier { moved, gained, .. } = earlier;
        for (d, v, moved, gained) in [
            (&d.x[..], &mut ring.ux[..], &mut moved.x[..], &mut gained.x[..]),
            (&d.y[..], &mut ring.uy[..], &mut moved.y[..], &mut gained.y[..]),
        ] {
            for i in (0..d.len()).step_by(LANES) {
                let (now, before) = (load(simd, d, i), load(simd, v, i));
                let after = self.velocity(simd, now, load(simd, moved, i));
                store(after - before, gained, i);
                store(now, moved, i);
                store(after, v, i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_gives_the_error_of_a_cubic() {
        // x = t^3 with exact places and velocities until t = 0, and the exact velocity at the end of the step.
        for (h, earlier) in [(0.4, 0.3), (0.4, 0.2), (0.1, 0.4)] {
            let (x, v) = (|t: f64| t * t * t, |t: f64| 3.0 * t * t);
            let scheme = Scheme::of(h, h / earlier);
            let (moved, gained) = (x(0.0) - x(-earlier), v(0.0) - v(-earlier));
            let step = scheme.keep * moved + scheme.s * v(h);
            let foreseen = h * (v(0.0) + 0.5 * scheme.ratio * gained);
            let share = (step - x(h)).abs() / (step - foreseen).abs();
            assert!((scheme.error_share() / share - 1.0).abs() < 1e-12, "{h} {earlier}: {share}");
        }
    }

    #[test]
    fn a_parabola_is_followed_exactly() {
        let (x, v) = (|t: f64| 0.3 + 2.0 * t - 1.5 * t * t, |t: f64| 2.0 - 3.0 * t);
        let (h, earlier) = (0.4, 0.3);
        let scheme = Scheme::of(h, h / earlier);
        let step = scheme.keep * (x(0.0) - x(-earlier)) + scheme.s * v(h);
        assert!((step - (x(h) - x(0.0))).abs() < 1e-14);
        let foreseen = h * (v(0.0) + 0.5 * scheme.ratio * (v(0.0) - v(-earlier)));
        assert!((foreseen - step).abs() < 1e-14);
    }
}
