//! What is left of a cell after a miss: squares that no one disc covers wholly, and the next dart into them.

use crate::physics::walls::arrays::board::{Board, GRAIN, Stream, place, uniform, wait};
use crate::physics::walls::arrays::growth::cell::{Block, Cell, Fate};
use rand_chacha::ChaCha8Rng;

/// Fewer squares than this are quartered at every miss.
const MANY: usize = 8;

/// Where in a cell a dart may still hit.
#[derive(Debug)]
pub(super) struct Room {
    random: ChaCha8Rng,
    /// Lower corners of the squares.
    squares: Vec<[f64; 2]>,
    /// Side of a square.
    side: f64,
    /// Since they were quartered.
    misses: usize,
}

impl Room {
    /// The whole of the cell of this number.
    pub(super) fn whole(board: &Board, cell: [usize; 2], number: u32) -> Self {
        let random = board.stream(Stream::Cell(number as usize));
        Self { random, squares: vec![board.corner(cell)], side: board.width, misses: 0 }
    }

    /// Takes note of a miss. Quarters the squares if they are few, or once there was a miss for every fourth of them.
    pub(super) fn miss(&mut self, block: &Block, spacing: f64) {
        self.misses += 1;
        if self.squares.len() < MANY || 4 * self.misses >= self.squares.len() {
            self.quarter(block, spacing);
        }
    }

    /// Whether no dart can hit. Squares of a few grains count as nothing, for places in smaller ones are hardly told
    /// apart.
    pub(super) fn is_full(&self) -> bool {
        self.squares.is_empty() || self.side < 4.0 * GRAIN
    }

    /// The next dart after a time into a cell of this width; it must not be full.
    pub(super) fn next_dart(&mut self, after: f64, width: f64) -> Cell {
        let Self { random, squares, side, .. } = self;
        let share = squares.len() as f64 * (*side / width) * (*side / width);
        let time = after + wait(random) / share;
        let square = squares[((uniform(random) * squares.len() as f64) as usize).min(squares.len() - 1)];
        Cell { at: place(random, square, *side), time, fate: Fate::Waiting }
    }

    /// Keeps those quarters of the squares that no one disc of the block covers.
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
