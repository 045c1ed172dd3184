//! A cell of the grid, and the block of cells around it.

/// A cell of the grid, too small for two discs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Place of its disc, or of the dart that waits to be judged.
    pub(super) at: [f64; 2],
    /// When that dart is thrown, in mean times between two darts into a whole cell; 0 for discs that were given.
    pub(super) time: f64,
    pub(super) fate: Fate,
}

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fate {
    /// A dart waits to be judged.
    Waiting,
    /// It holds a disc.
    Disc,
    /// It holds no disc, and has no room for one.
    Full,
}

/// A cell without disc or room.
pub(super) const NOTHING: Cell = Cell { at: [0.0; 2], time: f64::INFINITY, fate: Fate::Full };

/// A cell and those up to two columns and rows away, row by row from below: all that can hold a disc too near.
pub(super) type Block = [Cell; 25];

/// Where in its block a cell stands itself.
pub(super) const MIDDLE: usize = 12;

/// Columns and rows from the middle of a block to its cell `i`.
pub(super) fn offset(i: usize) -> [i64; 2] {
    [i as i64 % 5 - 2, i as i64 / 5 - 2]
}
