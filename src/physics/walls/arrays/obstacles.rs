//! A periodic box of discs at random: random sequential addition ([C24] 2.4).
//!
//! Discs of diameter `sigma_ob` are placed one after the other at uniformly random places, each kept if its surface
//! stays further than `w_ob` from all earlier ones, until there are enough or, saturated, until no further one fits.
//! An array depends on the field and the seed alone, so the same arrays serve every droplet.
//! A saturated one is worked out along the paths of droplets.

use crate::parameters::{Density, ObstacleField};
use crate::physics::walls::arrays::darts::GRAIN;
use crate::physics::walls::arrays::packing::pack;
use crate::physics::walls::arrays::saturated::Saturated;
use crate::physics::walls::disc::Disc;
use crate::physics::walls::wall::Walls;
use crate::results::trajectory::{Failure, FailureClass};
use std::sync::OnceLock;

/// How far from the box centre a gap is looked for, in sigma.
pub const SEARCH_RADIUS: f64 = 1.0;

/// Discs in a periodic box, in 17 to 21 bytes a disc once they are placed.
#[derive(Debug)]
pub struct ObstacleArray {
    /// Side of the box.
    pub box_size: f64,
    /// Radius of a disc.
    pub radius: f64,
    places: Places,
    /// Found when first asked for.
    widest_gap: OnceLock<([f64; 2], f64)>,
}

/// Where the discs lie.
#[derive(Debug)]
enum Places {
    Given(Sorted),
    Saturated(Box<Saturated>),
}

/// Places sorted by the cell they lie in.
#[derive(Debug)]
struct Sorted {
    at: Vec<[f64; 2]>,
    /// Places of cell k are `first[k]..first[k + 1]`.
    first: Vec<u32>,
    cells: usize,
}

impl Walls for ObstacleArray {
    type Obstacle = Disc;

    fn surface(&self) -> f64 {
        self.radius
    }

    fn for_each_near(&self, origin: [f64; 2], bounds: [f64; 4], visit: impl FnMut(Disc)) {
        self.for_each_in(origin, bounds, visit);
    }
}

impl ObstacleArray {
    /// The discs of `field` for `seed`; saturated ones are placed where someone looks, when someone does.
    ///
    /// # Errors
    /// `bad_input` if the box is full before the asked density is reached.
    pub fn generate(field: &ObstacleField, seed: u64) -> Result<Self, Failure> {
        let (radius, area) = (0.5 * field.sigma_ob, field.box_size * field.box_size);
        let density = match field.density {
            Density::Saturated => {
                let places = Places::Saturated(Box::new(Saturated::new(field, seed)));
                return Ok(Self { box_size: field.box_size, radius, places, widest_gap: OnceLock::new() });
            }
            Density::Number(density) => density,
        };
        let wanted = (density * area).round() as usize;
        let centres = pack(field, seed, wanted);
        if centres.len() < wanted {
            return Err(Failure {
                class: FailureClass::BadInput,
                reason: format!(
                    "density = {} does not fit: with w_ob = {} and sigma_ob = {} the box of seed {seed} is full at {:.3}",
                    wanted as f64 / area,
                    field.w_ob,
                    field.sigma_ob,
                    centres.len() as f64 / area
                ),
                step: 0,
                outline: None,
            });
        }
        Ok(Self::given(field.box_size, radius, &centres))
    }

    /// An array of discs at given places, `0 <= x, y < box_size`.
    pub fn from_centres(box_size: f64, radius: f64, x: &[f64], y: &[f64]) -> Self {
        Self::given(box_size, radius, &x.iter().zip(y).map(|(&x, &y)| [x, y]).collect::<Vec<_>>())
    }

    fn given(box_size: f64, radius: f64, centres: &[[f64; 2]]) -> Self {
        let cells = ((centres.len() as f64).sqrt() as usize).clamp(1, (box_size / radius.max(0.1)) as usize);
        let places = Places::Given(Sorted::new(box_size, cells, centres));
        Self { box_size, radius, places, widest_gap: OnceLock::new() }
    }

    /// One disc around the origin; its nearest periodic image is 2^14 sigma away.
    pub fn lone(radius: f64) -> Self {
        Self::given(16_384.0, radius, &[[0.0, 0.0]])
    }

    /// Number of discs. A saturated array is worked out as a whole for it.
    pub fn len(&self) -> usize {
        match &self.places {
            Places::Given(sorted) => sorted.at.len(),
            Places::Saturated(discs) => discs.len(),
        }
    }

    /// Memory that its discs take; those of a saturated array that are not all placed near the edges of what was looked at take 32 KB a tile more.
    pub fn bytes(&self) -> usize {
        match &self.places {
            Places::Given(sorted) => size_of_val(&*sorted.at) + size_of_val(&*sorted.first),
            Places::Saturated(discs) => discs.bytes(),
        }
    }

    /// Whether there is no disc at all.
    pub fn is_empty(&self) -> bool {
        match &self.places {
            Places::Given(sorted) => sorted.at.is_empty(),
            Places::Saturated(_) => false,
        }
    }

    /// Calls `visit` with every disc whose centre lies in the box `[x_min, x_max, y_min, y_max]`, all in coordinates
    /// relative to `origin`; periodic images count as discs of the same id.
    pub fn for_each_in(&self, origin: [f64; 2], bounds: [f64; 4], mut visit: impl FnMut(Disc)) {
        let [x_min, x_max, y_min, y_max] = bounds;
        let mut see = |id: u32, at: [f64; 2], shift: [f64; 2]| {
            let [x, y] = [at[0] + shift[0], at[1] + shift[1]];
            if x >= x_min && x <= x_max && y >= y_min && y <= y_max {
                visit(Disc { id, x, y });
            }
        };
        match &self.places {
            Places::Given(sorted) => self.for_each_cell(sorted.cells, origin, bounds, |[column, row], shift| {
                let k = row * sorted.cells + column;
                for i in sorted.first[k]..sorted.first[k + 1] {
                    see(i, sorted.at[i as usize], shift);
                }
            }),
            Places::Saturated(discs) => self.for_each_cell(discs.cells(), origin, bounds, |cell, shift| {
                if let Some((id, at)) = discs.disc(cell) {
                    see(id, at, shift);
                }
            }),
        }
    }

    /// Calls `visit` with every cell that such a box meets, of so many along a side, and with what takes places there to coordinates relative to `origin`.
    fn for_each_cell(
        &self,
        cells: usize,
        origin: [f64; 2],
        bounds: [f64; 4],
        mut visit: impl FnMut([usize; 2], [f64; 2]),
    ) {
        let width = self.box_size / cells as f64;
        let n = cells as i64;
        // Rounding may have put a disc a grain beside its cell.
        let range = |origin: f64, from: f64, to: f64| {
            let [from, to] = [origin + from - GRAIN, origin + to + GRAIN].map(|c| (c / width).floor() as i64);
            (from..=to).map(move |c| (c.rem_euclid(n) as usize, c.div_euclid(n) as f64))
        };
        for (row, boxes_up) in range(origin[1], bounds[2], bounds[3]) {
            for (column, boxes_right) in range(origin[0], bounds[0], bounds[1]) {
                let shift = [boxes_right * self.box_size - origin[0], boxes_up * self.box_size - origin[1]];
                visit([column, row], shift);
            }
        }
    }

    /// Distance from a point to the nearest disc surface, looking no further than `reach`; negative inside a disc.
    pub fn clearance(&self, point: [f64; 2], reach: f64) -> f64 {
        let mut nearest = reach;
        let far = reach + self.radius;
        self.for_each_in(point, [-far, far, -far, far], |disc| {
            nearest = nearest.min((disc.x * disc.x + disc.y * disc.y).sqrt() - self.radius);
        });
        nearest
    }

    /// The point of largest clearance within 1 sigma of the box centre, and that clearance (at most 0.75); on a grid of
    /// 0.02 sigma, ties going to the first.
    pub fn widest_gap_near_centre(&self) -> ([f64; 2], f64) {
        *self.widest_gap.get_or_init(|| self.look_for_widest_gap())
    }

    fn look_for_widest_gap(&self) -> ([f64; 2], f64) {
        let (centre, radius) = (0.5 * self.box_size, SEARCH_RADIUS);
        let steps = (radius / 0.02).round() as i32;
        let mut best = ([centre, centre], f64::NEG_INFINITY);
        for j in -steps..=steps {
            for i in -steps..=steps {
                let (dx, dy) = (0.02 * f64::from(i), 0.02 * f64::from(j));
                if dx * dx + dy * dy > radius * radius {
                    continue;
                }
                let point = [centre + dx, centre + dy];
                let clearance = self.clearance(point, 0.75);
                if clearance > best.1 {
                    best = (point, clearance);
                }
            }
        }
        best
    }
}

impl Sorted {
    fn new(box_size: f64, cells: usize, places: &[[f64; 2]]) -> Self {
        let cell_of = |c: f64| ((c / box_size * cells as f64) as usize).min(cells - 1);
        let cell: Vec<usize> = places.iter().map(|&[x, y]| cell_of(y) * cells + cell_of(x)).collect();
        let mut first = vec![0_u32; cells * cells + 1];
        cell.iter().for_each(|&k| first[k + 1] += 1);
        for k in 0..cells * cells {
            first[k + 1] += first[k];
        }
        let (mut next, mut at) = (first.clone(), vec![[0.0; 2]; places.len()]);
        for (&place, &k) in places.iter().zip(&cell) {
            at[next[k] as usize] = place;
            next[k] += 1;
        }
        Self { at, first, cells }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(density: Density) -> ObstacleField {
        ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 30.0 }
    }

    fn all(array: &ObstacleArray) -> Vec<Disc> {
        let mut discs = Vec::new();
        let end = array.box_size * (1.0 - 1e-15);
        array.for_each_in([0.0, 0.0], [0.0, end, 0.0, end], |disc| discs.push(disc));
        discs
    }

    #[test]
    fn no_two_discs_come_closer_than_the_gap() {
        let fields = [
            field(Density::Saturated),
            field(Density::Number(2.7)),
            // Boxes of few cells, where most neighbours are periodic images.
            ObstacleField { w_ob: 5.0, sigma_ob: 5.0, density: Density::Saturated, box_size: 20.0 },
            ObstacleField { w_ob: 2.0, sigma_ob: 3.0, density: Density::Saturated, box_size: 20.0 },
        ];
        for field in fields {
            let spacing = field.w_ob + field.sigma_ob;
            let array = ObstacleArray::generate(&field, 3).unwrap();
            assert!(array.len() > 2);
            for disc in all(&array) {
                let mut near = 0;
                array.for_each_in([disc.x, disc.y], [-spacing, spacing, -spacing, spacing], |other| {
                    near += usize::from(other.x * other.x + other.y * other.y <= spacing * spacing);
                });
                assert_eq!(near, 1, "only the disc itself");
            }
            if field.density == Density::Saturated {
                let step = field.box_size / 100.0;
                let point = |k: u32| [f64::from(k % 100) * step, f64::from(k / 100) * step];
                let room = spacing - array.radius + 1e-9;
                assert!((0..10_000).all(|k| array.clearance(point(k), 2.0 * spacing) <= room), "no room is left");
            }
        }
    }

    #[test]
    fn a_saturated_array_has_the_known_coverage_and_no_room_left() {
        // Jamming coverage of random sequential addition of discs: 0.5470 (Feder 1980; Zhang and Torquato 2013).
        let array =
            ObstacleArray::generate(&ObstacleField { box_size: 100.0, ..field(Density::Saturated) }, 1).unwrap();
        let coverage = array.len() as f64 * std::f64::consts::PI * 0.25 * 0.25 / 1e4;
        assert!((coverage - 0.547).abs() < 0.004, "{coverage}");
        for k in 0..20_000_u32 {
            let point = [f64::from(k % 151) * 0.66, f64::from(k / 151) * 0.75];
            assert!(array.clearance(point, 1.0) <= 0.35 + 1e-9);
        }
    }

    #[test]
    fn a_given_density_is_met_and_an_impossible_one_refused() {
        let array = ObstacleArray::generate(&field(Density::Number(0.35)), 0).unwrap();
        assert_eq!(array.len(), 315);
        let error = ObstacleArray::generate(&field(Density::Number(2.95)), 0).unwrap_err();
        assert!(error.reason.contains("density = 2.95"), "{error}");
    }

    #[test]
    fn the_same_seed_gives_the_same_array_and_another_seed_another() {
        for density in [Density::Number(1.0), Density::Number(2.7), Density::Saturated] {
            let make = |seed| all(&ObstacleArray::generate(&field(density), seed).unwrap());
            assert_eq!(make(5), make(5));
            assert_ne!(make(5), make(6));
        }
    }

    #[test]
    fn threads_that_look_here_and_there_see_the_same_discs() {
        let field = ObstacleField { box_size: 60.0, ..field(Density::Saturated) };
        let seen = [1, 2, 3].map(|step| {
            let array = ObstacleArray::generate(&field, 7).unwrap();
            std::thread::scope(|scope| {
                for thread in 0..2 {
                    let array = &array;
                    scope.spawn(move || {
                        for k in (thread..60).step_by(step) {
                            array.clearance([f64::from(k), f64::from(37 * k % 60)], 2.0);
                        }
                    });
                }
            });
            all(&array)
        });
        assert_eq!(seen[0], seen[1]);
        assert_eq!(seen[0], seen[2]);
    }

    #[test]
    fn discs_repeat_with_the_box() {
        for density in [Density::Number(1.0), Density::Saturated] {
            let array = ObstacleArray::generate(&field(density), 2).unwrap();
            let look = |origin: [f64; 2]| {
                let mut seen = Vec::new();
                array.for_each_in(origin, [-2.0, 2.0, -2.0, 2.0], |disc| seen.push(disc));
                seen.sort_by_key(|disc| disc.id);
                seen
            };
            assert_eq!(look([29.0, 1.0]), look([29.0 - 30.0, 1.0 + 90.0]));
            assert!(look([29.0, 1.0]).len() > 8);
        }
    }
}
