//! Random sequential addition without end, computed only where it is needed.
//!
//! # The process
//! Darts are thrown at the box for ever, at random times and with the same probability everywhere. A dart that lands
//! further than the spacing from all earlier discs becomes a disc. Any other dart misses, and changes nothing. After a
//! long time there is no room for another disc: the array is saturated, and discs as wide as the spacing would cover
//! 0.547 of the box.
//!
//! # Why the discs do not depend on where one looks first
//! The box is divided into *cells* whose diagonal is shorter than the spacing. A cell holds at most one disc, and discs
//! that are too near to one in it lie in the *block* of 25 cells around it. Random darts in the whole box are the same
//! as independent random darts in each cell. So each cell draws the places of its darts, and the times between them,
//! from its own random stream; only the first darts of the cells of a tile share a stream. The seed thus fixes all
//! darts in advance.
//!
//! Whether a dart misses depends only on earlier darts in its block. So it can be judged as soon as no earlier dart
//! waits there. If an earlier dart waits, that one is judged first, after still earlier ones in its own block, and so
//! on. Such a *chain* goes back in time at each link and therefore ends, in practice after about sixty cells at most.
//!
//! Cells are computed and kept in *tiles* of 32 by 32. A tile is settled when no dart waits in it any more. Its
//! neighbours have then been computed in part, as far as the chains led.
//!
//! # How it ends
//! A cell would need very many darts to show that it is full. So after a miss it throws only into those of its squares
//! that are not covered by a single disc, and the mean time to its next dart grows as the area of these squares
//! shrinks. This does not change the distribution (Zhang and Torquato, Phys. Rev. E 88, 053312 (2013)). The squares are
//! quartered as misses continue. When no square is left, the cell is proved to be full.
//!
//! # What it costs
//! About 4.5 microseconds per disc. For a droplet that moves through 100 sigma of a saturated array, about ten thousand
//! discs are computed, in a box of any size. A tile that is not settled takes 32 KB, a settled tile 16 bytes per disc.

mod grid;
mod room;
#[cfg(test)]
mod tests;

use crate::physics::walls::arrays::board::{Board, squared_distance};
use crate::physics::walls::arrays::tile::{TILE, Tile};
use grid::{Block, Cell, Fate, Grid, MIDDLE, NOTHING, offset};
use room::Room;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Discs that are being added.
#[derive(Debug)]
pub(super) struct Growth {
    grid: Grid,
    /// Room in cells after a miss, by the number of the cell. Full cells and cells with a disc have none.
    rooms: HashMap<u32, Box<Room>>,
    /// Empty between judgements; kept to avoid millions of allocations.
    chain: Vec<[usize; 2]>,
}

impl Growth {
    pub(super) fn new(board: Board) -> Self {
        Self { grid: Grid::new(board), rooms: HashMap::new(), chain: Vec::new() }
    }

    pub(super) fn onto(board: Board, discs: &[[f64; 2]]) -> Self {
        let mut growth = Self::new(board);
        for &at in discs {
            let cell = at.map(|c| growth.grid.board.cell_at(c));
            *growth.grid.cell_mut(cell) = Cell { at, time: 0.0, fate: Fate::Disc };
        }
        growth
    }

    /// Cells and tiles along a side of the box.
    pub(super) fn sides(&self) -> [usize; 2] {
        [self.grid.board.cells, self.grid.across]
    }

    /// The next discs, at most `wanted`, in the order in which they are added; `None` if `stop` is set meanwhile.
    pub(super) fn grow(mut self, wanted: usize, stop: &AtomicBool) -> Option<Vec<[f64; 2]>> {
        let mut until = 1.0;
        // Once enough discs were added before some time, they are the next ones, because all others are added later.
        while self.judge_until(until, stop)? && self.new_discs().count() < wanted {
            until *= 2.0;
        }
        let mut discs: Vec<&Cell> = self.new_discs().collect();
        discs.sort_by(|a, b| a.time.total_cmp(&b.time));
        Some(discs.iter().take(wanted).map(|cell| cell.at).collect())
    }

    /// All discs of a tile.
    pub(super) fn settle(&mut self, tile: usize) -> Arc<Tile> {
        if let Some(settled) = self.grid.settled(tile) {
            return settled;
        }
        self.judge_tile(tile, f64::INFINITY);
        self.grid.settle(tile)
    }

    /// Judges all darts up to a time. True if later darts still wait; `None` if `stop` is set meanwhile.
    fn judge_until(&mut self, until: f64, stop: &AtomicBool) -> Option<bool> {
        let mut waiting = false;
        for tile in 0..self.grid.across * self.grid.across {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            waiting |= self.judge_tile(tile, until);
        }
        Some(waiting)
    }

    /// All discs except those given at the start.
    fn new_discs(&self) -> impl Iterator<Item = &Cell> {
        self.grid.worked_on().filter(|cell| cell.fate == Fate::Disc && cell.time > 0.0)
    }

    /// Judges the darts of a tile up to a time. True if later darts still wait.
    fn judge_tile(&mut self, tile: usize, until: f64) -> bool {
        let is_due = |cell: &Cell| cell.fate == Fate::Waiting && cell.time <= until;
        let mut waiting = false;
        for k in 0..TILE * TILE {
            while is_due(&self.grid.page(tile)[k]) {
                self.judge(self.grid.cell_of(tile, k));
            }
            waiting |= self.grid.page(tile)[k].fate == Fate::Waiting;
        }
        waiting
    }

    /// Judges the dart that waits in a cell, after all darts that it depends on.
    fn judge(&mut self, cell: [usize; 2]) {
        // Each dart depends on the next in the chain, which is earlier.
        let mut chain = std::mem::take(&mut self.chain);
        chain.push(cell);
        while let Some(&cell) = chain.last() {
            let block = self.grid.block(cell);
            let dart = block[MIDDLE];
            let earlier = |other: &Cell| (other.fate == Fate::Waiting) & (other.time < dart.time);
            // Without a branch for each cell, because this takes half of the time.
            if block.iter().fold(false, |any, other| any | earlier(other))
                && let Some(i) = block.iter().position(earlier)
            {
                chain.push(self.grid.board.beside(cell, offset(i)).0);
                continue;
            }
            chain.pop();
            let square = self.grid.board.spacing * self.grid.board.spacing;
            let touches = |other: &Cell| (other.fate == Fate::Disc) & (squared_distance(other.at, dart.at) <= square);
            if block.iter().fold(false, |any, other| any | touches(other)) {
                self.miss(cell, &block);
            } else {
                self.grid.cell_mut(cell).fate = Fate::Disc;
                self.rooms.remove(&self.grid.number(cell));
            }
        }
        self.chain = chain;
    }

    /// Throws the next dart into a cell whose last one missed, if it has room.
    fn miss(&mut self, cell: [usize; 2], block: &Block) {
        let number = self.grid.number(cell);
        let board = &self.grid.board;
        let room = self.rooms.entry(number).or_insert_with(|| Box::new(Room::whole(board, cell, number)));
        room.miss(block, board.spacing);
        let next = if room.is_full() {
            self.rooms.remove(&number);
            NOTHING
        } else {
            room.next_dart(block[MIDDLE].time, board.width)
        };
        *self.grid.cell_mut(cell) = next;
    }
}
