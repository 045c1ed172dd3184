//! A periodic box of discs at random places ([C24] 2.4).

use crate::parameters::{Density, ObstacleField};
use crate::physics::walls::arrays::{board::GRAIN, packing::pack, saturated::Saturated, sorted::Sorted};
use crate::physics::walls::{disc::Disc, wall::Walls};
use crate::results::trajectory::{Failure, FailureClass};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

/// The widest gap is sought within this distance of the box centre, in sigma.
pub(crate) const SEARCH_RADIUS: f64 = 1.0;

/// Discs in a periodic box; each takes 17 to 21 bytes once it is placed.
///
/// An array depends only on its field and its seed, so droplets of all parameters can use the same array:
///
/// ```
/// use meniscus::parameters::{Density, ObstacleField};
/// use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
///
/// // Discs of diameter 0.3 whose surfaces lie further than 0.2 apart, 0.7 to a unit of area.
/// let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 60.0 };
/// let array = ObstacleArray::generate(&field, 1)?;
/// assert_eq!(array.len(), 2520);
///
/// // Discs near the point (10, 20), in coordinates relative to it.
/// let mut near = Vec::new();
/// array.for_each_in([10.0, 20.0], [-2.0, 2.0, -2.0, 2.0], |disc| near.push(disc));
/// assert!(near.iter().all(|disc| disc.x.abs() <= 2.0 && disc.y.abs() <= 2.0));
///
/// // The widest gap near the middle of the box: a circle of this radius touches no disc.
/// let (centre, radius) = array.widest_gap_near_centre();
/// assert_eq!(array.clearance(centre, 0.75), radius);
/// # Ok::<(), meniscus::results::trajectory::Failure>(())
/// ```
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

#[derive(Debug)]
enum Places {
    Given(Sorted),
    Saturated(Box<Saturated>),
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
    /// The discs of `field` for `seed`. Those of a saturated array are placed later, where they are asked for.
    ///
    /// # Errors
    /// `bad_input` if the box is full before the asked density is reached.
    pub fn generate(field: &ObstacleField, seed: u64) -> Result<Self, Failure> {
        Ok(Self::generate_unless(&AtomicBool::new(false), field, seed)?.expect("nobody stops it"))
    }

    /// The same; `None` if `stop` is set before all discs are placed.
    ///
    /// # Errors
    /// As [`generate`](Self::generate).
    pub(crate) fn generate_unless(
        stop: &AtomicBool,
        field: &ObstacleField,
        seed: u64,
    ) -> Result<Option<Self>, Failure> {
        let (radius, area) = (0.5 * field.sigma_ob, field.box_size * field.box_size);
        let density = match field.density {
            Density::Saturated => {
                let places = Places::Saturated(Box::new(Saturated::new(field, seed)));
                return Ok(Some(Self { box_size: field.box_size, radius, places, widest_gap: OnceLock::new() }));
            }
            Density::Number(density) => density,
        };
        let wanted = (density * area).round() as usize;
        let Some(centres) = pack(field, seed, wanted, stop) else { return Ok(None) };
        if centres.len() < wanted {
            return Err(Failure {
                class: FailureClass::BadInput,
                reason: format!(
                    "density = {} does not fit: with w_ob = {} and sigma_ob = {} the box of seed {seed} is full at {:.3}; \
                     lower one of the three",
                    wanted as f64 / area,
                    field.w_ob,
                    field.sigma_ob,
                    centres.len() as f64 / area
                ),
                step: 0,
                outline: None,
            });
        }
        Ok(Some(Self::given(field.box_size, radius, &centres)))
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

    /// Number of discs. Counting those of a saturated array computes the whole box.
    pub fn len(&self) -> usize {
        match &self.places {
            Places::Given(sorted) => sorted.len(),
            Places::Saturated(discs) => discs.len(),
        }
    }

    /// Memory of the discs in bytes. Each tile of a saturated array that is computed in part takes 32 KB more.
    pub fn bytes(&self) -> usize {
        match &self.places {
            Places::Given(sorted) => sorted.bytes(),
            Places::Saturated(discs) => discs.bytes(),
        }
    }

    /// Whether there is no disc.
    pub fn is_empty(&self) -> bool {
        match &self.places {
            Places::Given(sorted) => sorted.len() == 0,
            Places::Saturated(_) => false,
        }
    }

    /// How many cells of the array a box with these sides goes through. A look at more than 1e6 finds nothing.
    pub(crate) fn cells_in(&self, sides: [f64; 2]) -> f64 {
        let cells = match &self.places {
            Places::Given(sorted) => sorted.cells,
            Places::Saturated(discs) => discs.cells,
        };
        sides.iter().map(|side| side * cells as f64 / self.box_size + 1.0).product()
    }

    /// Whether a look into a box with these sides goes through so few cells that it finds what is there.
    pub(crate) fn can_look(&self, sides: [f64; 2]) -> bool {
        self.cells_in(sides) <= MOST_CELLS
    }

    /// Calls `visit` with every disc whose centre lies in the box `[x_min, x_max, y_min, y_max]`. Box and discs are in
    /// coordinates relative to `origin`. Periodic images are visited too, with the same id. A box of more than 1e6
    /// cells is not looked into.
    pub fn for_each_in(&self, origin: [f64; 2], bounds: [f64; 4], mut visit: impl FnMut(Disc)) {
        let [x_min, x_max, y_min, y_max] = bounds;
        let mut see = |id: u32, at: [f64; 2], shift: [f64; 2]| {
            let [x, y] = [at[0] + shift[0], at[1] + shift[1]];
            if x >= x_min && x <= x_max && y >= y_min && y <= y_max {
                visit(Disc { id, x, y });
            }
        };
        match &self.places {
            Places::Given(sorted) => for_each_cell(self.box_size, sorted.cells, origin, bounds, |cell, shift| {
                for (id, at) in sorted.discs(cell) {
                    see(id, at, shift);
                }
            }),
            Places::Saturated(discs) => for_each_cell(self.box_size, discs.cells, origin, bounds, |cell, shift| {
                if let Some((id, at)) = discs.disc(cell) {
                    see(id, at, shift);
                }
            }),
        }
    }

    /// Distance from a point to the nearest disc surface, negative inside a disc; at most `reach`.
    pub fn clearance(&self, point: [f64; 2], reach: f64) -> f64 {
        let mut nearest = reach;
        let far = reach + self.radius;
        self.for_each_in(point, [-far, far, -far, far], |disc| {
            nearest = nearest.min((disc.x * disc.x + disc.y * disc.y).sqrt() - self.radius);
        });
        nearest
    }

    /// The point of largest clearance within 1 sigma of the box centre, and that clearance, which is at most 0.75. It
    /// is sought on a grid of 0.02 sigma; of points with equal clearance the first is taken.
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

/// Most cells that one look goes through. A droplet that looks further has come apart; going through its cells would
/// take longer than it takes to notice.
const MOST_CELLS: f64 = 1e6;

/// Calls `visit` with every cell of a periodic grid that overlaps the box `[x_min, x_max, y_min, y_max]` relative to
/// `origin`, and with the shift that makes places in the cell relative to `origin`; with none if they are more than
/// [`MOST_CELLS`].
fn for_each_cell(
    box_size: f64,
    cells: usize,
    origin: [f64; 2],
    bounds: [f64; 4],
    mut visit: impl FnMut([usize; 2], [f64; 2]),
) {
    let width = box_size / cells as f64;
    let n = cells as i64;
    // Because of rounding a disc may lie a grain outside its cell.
    let range = |origin: f64, from: f64, to: f64| {
        let [from, to] = [origin + from - GRAIN, origin + to + GRAIN].map(|c| (c / width).floor() as i64);
        (from..=to).map(move |c| (c.rem_euclid(n) as usize, c.div_euclid(n) as f64))
    };
    let (across, down) = (bounds[1] - bounds[0], bounds[3] - bounds[2]);
    if (across / width + 1.0) * (down / width + 1.0) > MOST_CELLS {
        return;
    }
    for (row, boxes_up) in range(origin[1], bounds[2], bounds[3]) {
        for (column, boxes_right) in range(origin[0], bounds[0], bounds[1]) {
            let shift = [boxes_right * box_size - origin[0], boxes_up * box_size - origin[1]];
            visit([column, row], shift);
        }
    }
}
