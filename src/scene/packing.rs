//! Random sequential addition of discs in a periodic box.
//!
//! Darts are thrown into the whole box until most miss. Then only into small squares that no single disc covers wholly, which changes nothing in the
//! distribution, and the squares are quartered after every round; an empty list of squares proves saturation (Zhang and
//! Torquato, Phys. Rev. E 88, 053312 (2013)). In a round every square gets a Poisson number of darts, one on average, each at a random time, as if they were thrown into
//! all squares alike. Only darts closer than the spacing meet, so they are judged square by square, each after the
//! earlier ones next to it: the same discs as in the order of their times, and memory is walked through in order.

use crate::job::ObstacleField;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Positions are multiples of this, so that moving them by whole boxes and origins is exact.
const GRAIN: f64 = 1.0 / (1_u64 << 34) as f64;

/// The random stream that arrays draw from; other purposes use other numbers.
const ARRAY_STREAM: u64 = 1;

/// Of so many darts into the whole box fewer than one hits when squares take over.
const MISSES: u64 = 10;

/// The cells around one, the nearest first: most darts miss for a disc next to them.
const AROUND: [[i64; 2]; 25] = [
    [0, 0],
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
    [1, 1],
    [-1, 1],
    [1, -1],
    [-1, -1],
    [2, 0],
    [-2, 0],
    [0, 2],
    [0, -2],
    [2, 1],
    [-2, 1],
    [2, -1],
    [-2, -1],
    [1, 2],
    [-1, 2],
    [1, -2],
    [-1, -2],
    [2, 2],
    [-2, 2],
    [2, -2],
    [-2, -2],
];

/// Discs while they are being placed.
pub(super) struct Packing {
    box_size: f64,
    /// Smallest distance of two centres.
    spacing: f64,
    /// Centres, x.
    pub(super) x: Vec<f64>,
    /// Centres, y.
    pub(super) y: Vec<f64>,
    /// The disc in each cell that has one; a cell is too small for two.
    grid: Vec<[f64; 2]>,
    /// A bit for each cell that holds a disc: small enough for a near cache, unlike the grid.
    taken: Vec<u64>,
    cells: usize,
    random: ChaCha8Rng,
}

/// A dart of a round.
#[derive(Clone, Copy)]
struct Dart {
    at: [f64; 2],
    time: f64,
    cell: u32,
    fate: Fate,
}

#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Open,
    Disc,
    Miss,
}

/// The darts of a round, those of a cell one after another.
struct Round {
    darts: Vec<Dart>,
    /// Index + 1 of the first dart in each cell.
    first: Vec<u32>,
}

impl Packing {
    /// An empty box.
    pub(super) fn new(field: &ObstacleField, seed: u64) -> Self {
        let spacing = field.sigma_ob + field.w_ob;
        // The diagonal of a cell is shorter than the spacing.
        let mut cells = (field.box_size / (spacing * std::f64::consts::FRAC_1_SQRT_2)).ceil() as usize + 1;
        // What is in conflict lies no more than two cells away, in a box of few cells too.
        if 2.0 * field.box_size / (cells as f64) < spacing {
            cells -= 1;
        }
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream(ARRAY_STREAM);
        let (grid, taken) = (vec![[0.0; 2]; cells * cells], vec![0; (cells * cells).div_ceil(64)]);
        Self { box_size: field.box_size, spacing, x: Vec::new(), y: Vec::new(), grid, taken, cells, random }
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A Poisson number of mean 1.
    fn poisson(&mut self) -> u32 {
        let (mut count, mut share) = (0, 1.0 / std::f64::consts::E);
        let mut left = self.uniform() - share;
        while left >= 0.0 && count < 20 {
            count += 1;
            share /= f64::from(count);
            left -= share;
        }
        count
    }

    fn cell(&self, c: f64) -> usize {
        ((c / self.box_size * self.cells as f64) as usize).min(self.cells - 1)
    }

    /// Calls `visit` with the number of each cell around the point that a disc in conflict may lie in, and with what to add to places there, until it
    /// answers false; tells whether it never did.
    #[inline(always)]
    fn all_around(&self, at: [f64; 2], mut visit: impl FnMut(usize, [f64; 2]) -> bool) -> bool {
        let n = self.cells as i64;
        let [cx, cy] = at.map(|c| self.cell(c) as i64);
        if (2..n - 2).contains(&cx) && (2..n - 2).contains(&cy) {
            return AROUND.iter().all(|[dx, dy]| visit(((cy + dy) * n + cx + dx) as usize, [0.0; 2]));
        }
        // Beyond the edges of the box lie its periodic images.
        AROUND.iter().all(|[dx, dy]| {
            let (column, row) = (cx + dx, cy + dy);
            let shift = [column, row].map(|cell| cell.div_euclid(n) as f64 * self.box_size);
            visit((row.rem_euclid(n) * n + column.rem_euclid(n)) as usize, shift)
        })
    }

    /// The disc in a cell.
    #[inline(always)]
    fn disc(&self, cell: usize) -> Option<[f64; 2]> {
        (self.taken[cell / 64] >> (cell % 64) & 1 == 1).then(|| self.grid[cell])
    }

    fn take(&mut self, cell: usize, at: [f64; 2]) {
        self.taken[cell / 64] |= 1 << (cell % 64);
        self.grid[cell] = at;
    }

    /// Whether a disc at this place would touch none.
    fn is_free(&self, at: [f64; 2]) -> bool {
        let square = self.spacing * self.spacing;
        self.all_around(at, |cell, shift| self.disc(cell).is_none_or(|disc| squared(disc, shift, at) > square))
    }

    fn add(&mut self, at: [f64; 2]) {
        self.x.push(at[0]);
        self.y.push(at[1]);
        let slot = self.cell(at[1]) * self.cells + self.cell(at[0]);
        self.take(slot, at);
    }

    /// A place in the square of side `side` with this lower corner; `None` if it lies outside the box.
    fn place(&mut self, corner: [f64; 2], side: f64) -> Option<[f64; 2]> {
        let at = corner.map(|c| ((c + side * self.uniform()) / GRAIN).floor() * GRAIN);
        at.iter().all(|&c| c < self.box_size).then_some(at)
    }

    /// Adds discs until there are `wanted`, or no further one fits.
    pub(super) fn fill(&mut self, wanted: usize) {
        // First into the whole box, until darts mostly miss.
        let (mut hits, mut darts) = (0_u64, 0_u64);
        while self.x.len() < wanted && (darts < 1000 || hits * MISSES > darts) {
            if darts >= 100_000 {
                (hits, darts) = (hits / 2, darts / 2);
            }
            if let Some(at) = self.place([0.0; 2], self.box_size).filter(|&at| self.is_free(at)) {
                self.add(at);
                hits += 1;
            }
            darts += 1;
        }
        if self.x.len() >= wanted {
            return;
        }
        let mut side = self.box_size / self.cells as f64;
        let corners = |row: usize| (0..self.cells).map(move |column| [column as f64 * side, row as f64 * side]);
        let mut squares: Vec<[f64; 2]> =
            (0..self.cells).flat_map(corners).filter(|&corner| self.is_open(corner, side)).collect();
        let mut round = Round { darts: Vec::new(), first: vec![0; self.grid.len()] };
        // Then into the squares that are left, quartered again and again.
        while self.x.len() < wanted && !squares.is_empty() && side >= 4.0 * GRAIN {
            self.throw(&squares, side, &mut round);
            self.judge(&mut round, wanted);
            side *= 0.5;
            squares = squares.iter().flat_map(|&corner| self.quarters(corner, side)).collect();
        }
    }

    /// Throws the darts of a round.
    fn throw(&mut self, squares: &[[f64; 2]], side: f64, round: &mut Round) {
        for dart in &round.darts {
            round.first[dart.cell as usize] = 0;
        }
        round.darts.clear();
        for &corner in squares {
            for _ in 0..self.poisson() {
                let (place, time) = (self.place(corner, side), self.uniform());
                let Some(at) = place else { continue };
                let cell = (self.cell(at[1]) * self.cells + self.cell(at[0])) as u32;
                round.darts.push(Dart { at, time, cell, fate: Fate::Open });
            }
        }
        // Rounding may put a dart into the cell beside that of its square.
        if !round.darts.is_sorted_by_key(|dart| dart.cell) {
            round.darts.sort_by_key(|dart| dart.cell);
        }
        for (i, dart) in round.darts.iter().enumerate().rev() {
            round.first[dart.cell as usize] = i as u32 + 1;
        }
    }

    /// Makes discs of the darts that hit, the earliest ones up to `wanted` discs.
    fn judge(&mut self, round: &mut Round, wanted: usize) {
        for i in 0..round.darts.len() {
            self.settle(round, i);
        }
        let mut discs: Vec<&Dart> = round.darts.iter().filter(|dart| dart.fate == Fate::Disc).collect();
        if self.x.len() + discs.len() > wanted {
            discs.sort_by(|a, b| a.time.total_cmp(&b.time));
            discs.truncate(wanted - self.x.len());
        }
        self.x.extend(discs.iter().map(|dart| dart.at[0]));
        self.y.extend(discs.iter().map(|dart| dart.at[1]));
    }

    /// Settles the fate of dart `i`, after that of the earlier ones in conflict with it.
    fn settle(&mut self, round: &mut Round, i: usize) {
        let Dart { at, time, cell, fate } = round.darts[i];
        if fate != Fate::Open {
            return;
        }
        let square = self.spacing * self.spacing;
        if !self.is_free(at) {
            round.darts[i].fate = Fate::Miss;
            return;
        }
        let mut rivals = Vec::new();
        self.all_around(at, |near, shift| {
            let darts = round.darts.iter().enumerate().skip((round.first[near] as usize).wrapping_sub(1));
            for (j, other) in darts.take_while(|(_, other)| other.cell as usize == near) {
                if other.time < time && other.fate != Fate::Miss && squared(other.at, shift, at) <= square {
                    rivals.push(j);
                }
            }
            true
        });
        for rival in rivals {
            self.settle(round, rival);
            if round.darts[rival].fate == Fate::Disc {
                round.darts[i].fate = Fate::Miss;
                return;
            }
        }
        round.darts[i].fate = Fate::Disc;
        self.take(cell as usize, at);
    }

    /// Whether no one disc forbids the whole square to further centres.
    fn is_open(&self, corner: [f64; 2], side: f64) -> bool {
        let (half, square) = (0.5 * side, self.spacing * self.spacing);
        let middle = corner.map(|c| c + half);
        self.all_around(middle, |cell, shift| {
            self.disc(cell).is_none_or(|disc| farthest(disc, shift, middle, half) > square)
        })
    }

    /// The quarters, of side `side`, of a square that are not covered: those no one disc forbids to further centres.
    fn quarters(&self, [x, y]: [f64; 2], side: f64) -> impl Iterator<Item = [f64; 2]> {
        let (half, square) = (0.5 * side, self.spacing * self.spacing);
        let corners = [[x, y], [x + side, y], [x, y + side], [x + side, y + side]];
        let mut open = [true; 4];
        self.all_around([x + side, y + side], |cell, shift| {
            if let Some(disc) = self.disc(cell) {
                for (open, corner) in open.iter_mut().zip(corners) {
                    *open &= farthest(disc, shift, corner.map(|c| c + half), half) > square;
                }
            }
            open.contains(&true)
        });
        corners.into_iter().zip(open).filter_map(|(corner, open)| open.then_some(corner))
    }
}

/// Squared distance of two places, the first moved by `shift`.
#[inline(always)]
fn squared(from: [f64; 2], shift: [f64; 2], to: [f64; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|k| from[k] + shift[k] - to[k]);
    dx * dx + dy * dy
}

/// Squared distance of a place, moved by `shift`, from the farthest corner of the square of half side `half` around `middle`.
#[inline(always)]
fn farthest(from: [f64; 2], shift: [f64; 2], middle: [f64; 2], half: f64) -> f64 {
    let [dx, dy] = [0, 1].map(|k| (from[k] + shift[k] - middle[k]).abs() + half);
    dx * dx + dy * dy
}
