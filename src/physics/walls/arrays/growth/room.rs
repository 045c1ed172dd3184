//! The room in a cell after a miss: squares that are not covered by a single disc, and the next dart into them.

use crate::physics::walls::arrays::board::{Board, GRAIN, Stream, place, uniform, wait};
use crate::physics::walls::arrays::growth::grid::{Block, Cell, Fate};
use rand_chacha::ChaCha8Rng;

/// Fewer squares than this are quartered at every miss.
const MANY: usize = 8;

/// The squares of a cell in which a dart may still hit.
#[derive(Debug)]
pub(super) struct Room {
    random: ChaCha8Rng,
    /// Lower corners of the squares.
    squares: Vec<[f64; 2]>,
    side: f64,
    /// Misses since the squares were last quartered.
    misses: usize,
}

impl Room {
    pub(super) fn whole(board: &Board, cell: [usize; 2], number: u32) -> Self {
        let random = board.stream(Stream::Cell(number as usize));
        Self { random, squares: vec![board.corner(cell)], side: board.width, misses: 0 }
    }

    /// Notes a miss. Quarters the squares if they are few, or if the misses are a quarter of their number.
    pub(super) fn miss(&mut self, block: &Block, spacing: f64) {
        self.misses += 1;
        if self.squares.len() < MANY || 4 * self.misses >= self.squares.len() {
            self.quarter(block, spacing);
        }
    }

    /// Whether no dart can hit. Squares of a few grains count as none, because they hold hardly any places.
    pub(super) fn is_full(&self) -> bool {
        self.squares.is_empty() || self.side < 4.0 * GRAIN
    }

    /// The next dart after a time, in a cell of this width that is not full.
    pub(super) fn next_dart(&mut self, after: f64, width: f64) -> Cell {
        let Self { random, squares, side, .. } = self;
        let share = squares.len() as f64 * (*side / width) * (*side / width);
        let time = after + wait(random) / share;
        let square = squares[((uniform(random) * squares.len() as f64) as usize).min(squares.len() - 1)];
        Cell { at: place(random, square, *side), time, fate: Fate::Waiting }
    }

    /// Keeps the quarters of the squares that are not covered by a single disc of the block.
    fn quarter(&mut self, block: &Block, spacing: f64) {
        self.side *= 0.5;
        self.misses = 0;
        let (side, half, square) = (self.side, 0.5 * self.side, spacing * spacing);
        let discs: Vec<[f64; 2]> = block.iter().filter(|cell| cell.fate == Fate::Disc).map(|cell| cell.at).collect();
        let is_open = |corner: &[f64; 2]| {
            discs.iter().all(|disc| {
                let [dx, dy] = [0, 1].map(|k| (disc[k] - corner[k] - half).abs() + half);
                dx * dx + dy * dy > square
            })
        };
        let quarters = |&[x, y]: &[f64; 2]| [[x, y], [x + side, y], [x, y + side], [x + side, y + side]];
        self.squares = self.squares.iter().flat_map(quarters).filter(is_open).collect();
    }
}
