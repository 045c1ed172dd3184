//! A saturated box of discs, computed tile by tile where it is read.
//!
//! A settled tile is read without a lock. To settle a tile, a thread locks [`Growth`], because that needs darts beyond
//! the border of the tile. Threads that need another tile that is not settled wait.

use crate::parameters::ObstacleField;
use crate::physics::walls::arrays::tile::{TILE, Tile};
use crate::physics::walls::arrays::{board::Board, growth::Growth};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

#[derive(Debug)]
pub(super) struct Saturated {
    /// Cells along a side; each has at most one disc.
    pub(super) cells: usize,
    /// Tiles along a side.
    across: usize,
    tiles: Box<[OnceLock<Arc<Tile>>]>,
    /// Computes the tiles, one at a time.
    growth: Mutex<Growth>,
}

impl Saturated {
    pub(super) fn new(field: &ObstacleField, seed: u64) -> Self {
        let growth = Growth::new(Board::new(field, seed));
        let [cells, across] = growth.sides();
        let tiles = (0..across * across).map(|_| OnceLock::new()).collect();
        Self { cells, across, tiles, growth: Mutex::new(growth) }
    }

    /// Number and place of the disc in a cell.
    #[inline]
    pub(super) fn disc(&self, [column, row]: [usize; 2]) -> Option<(u32, [f64; 2])> {
        let tile = self.tile(row / TILE * self.across + column / TILE);
        tile.disc(column % TILE, row % TILE).map(|at| ((row * self.cells + column) as u32, at))
    }

    /// Number of discs; computes the whole box.
    pub(super) fn len(&self) -> usize {
        (0..self.tiles.len()).map(|tile| self.tile(tile).len()).sum()
    }

    pub(super) fn bytes(&self) -> usize {
        self.tiles.iter().filter_map(OnceLock::get).map(|tile| tile.bytes()).sum()
    }

    #[inline]
    fn tile(&self, tile: usize) -> &Tile {
        self.tiles[tile].get_or_init(|| self.growth.lock().unwrap_or_else(PoisonError::into_inner).settle(tile))
    }
}
