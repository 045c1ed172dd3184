//! A given number of discs by random sequential addition.
//!
//! Darts are thrown at the whole box. Those that land further than the spacing from all discs become discs, until there
//! are enough. Once nine of ten darts miss, [`Growth`] goes on, which throws only where there is room. Discs as wide as
//! the spacing then cover a third of the box.

use crate::parameters::ObstacleField;
use crate::physics::walls::arrays::board::{Board, Stream, place, squared_distance};
use crate::physics::walls::arrays::growth::Growth;
use std::sync::atomic::{AtomicBool, Ordering};

/// Growth takes over when fewer than one in this many darts hits.
const DARTS_A_HIT: u64 = 10;

/// Columns and rows from a cell to those of its block. The nearest come first, because most darts that miss do so
/// because of a near disc.
#[rustfmt::skip]
const AROUND: [[i64; 2]; 25] = [
    [0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1], [2, 0], [-2, 0], [0, 2], [0, -2],
    [2, 1], [-2, 1], [2, -1], [-2, -1], [1, 2], [-1, 2], [1, -2], [-1, -2], [2, 2], [-2, 2], [2, -2], [-2, -2],
];

struct Packing {
    board: Board,
    discs: Vec<[f64; 2]>,
    /// The disc in each cell that has one.
    grid: Vec<[f64; 2]>,
    /// A bit for each cell, set if it holds a disc. Unlike the grid it is small enough for a fast cache.
    taken: Vec<u64>,
}

/// Darts between two looks at whether to stop: some milliseconds.
const DARTS_A_LOOK: u64 = 1 << 15;

/// Centres of the first `wanted` discs of a seed, or of all that fit; `None` if `stop` is set meanwhile.
pub(super) fn pack(field: &ObstacleField, seed: u64, wanted: usize, stop: &AtomicBool) -> Option<Vec<[f64; 2]>> {
    let board = Board::new(field, seed);
    let cells = board.cells * board.cells;
    let (grid, taken) = (vec![[0.0; 2]; cells], vec![0; cells.div_ceil(64)]);
    let (board, mut discs) = Packing { board, discs: Vec::new(), grid, taken }.throw(wanted, stop)?;
    if discs.len() < wanted {
        let more = Growth::onto(board, &discs).grow(wanted - discs.len(), stop)?;
        discs.extend(more);
    }
    Some(discs)
}

impl Packing {
    /// Throws darts at the whole box until there are `wanted` discs or most darts miss. Consumes `self`, so that the
    /// grid is freed before Growth makes its own. `None` if `stop` is set meanwhile.
    fn throw(mut self, wanted: usize, stop: &AtomicBool) -> Option<(Board, Vec<[f64; 2]>)> {
        let mut random = self.board.stream(Stream::Box);
        let (mut hits, mut darts, mut look) = (0_u64, 0_u64, 0_u64);
        while self.discs.len() < wanted && (darts < 1000 || hits * DARTS_A_HIT > darts) {
            if darts >= 100_000 {
                // Old darts count less and less, so that the share of hits is a recent one.
                (hits, darts) = (hits / 2, darts / 2);
            }
            look += 1;
            if look.is_multiple_of(DARTS_A_LOOK) && stop.load(Ordering::Relaxed) {
                return None;
            }
            let at = place(&mut random, [0.0; 2], self.board.box_size);
            darts += 1;
            if at.iter().all(|&c| c < self.board.box_size) && self.is_free(at) {
                self.add(at);
                hits += 1;
            }
        }
        Some((self.board, self.discs))
    }

    /// Whether no disc is too near to this place.
    fn is_free(&self, at: [f64; 2]) -> bool {
        let square = self.board.spacing * self.board.spacing;
        let n = self.board.cells as i64;
        let cell @ [column, row] = at.map(|c| self.board.cell_at(c));
        if [column, row].iter().all(|&c| (2..n - 2).contains(&(c as i64))) {
            let middle = (row * self.board.cells + column) as i64;
            return AROUND.iter().all(|[dx, dy]| {
                self.disc((middle + dy * n + dx) as usize).is_none_or(|disc| squared_distance(disc, at) > square)
            });
        }
        AROUND.iter().all(|&away| {
            let ([column, row], shift) = self.board.beside(cell, away);
            let disc = self.disc(row * self.board.cells + column);
            disc.is_none_or(|[x, y]| squared_distance([x + shift[0], y + shift[1]], at) > square)
        })
    }

    #[inline(always)]
    fn disc(&self, cell: usize) -> Option<[f64; 2]> {
        (self.taken[cell / 64] >> (cell % 64) & 1 == 1).then(|| self.grid[cell])
    }

    fn add(&mut self, at: [f64; 2]) {
        self.discs.push(at);
        let cell = self.board.cell_at(at[1]) * self.board.cells + self.board.cell_at(at[0]);
        self.taken[cell / 64] |= 1 << (cell % 64);
        self.grid[cell] = at;
    }
}
