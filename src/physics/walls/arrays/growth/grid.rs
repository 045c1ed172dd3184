//! The cells of the whole box, kept by tiles, and the first dart of each cell.

use crate::physics::walls::arrays::board::{Board, Stream, place, wait};
use crate::physics::walls::arrays::tile::{TILE, Tile};
use std::sync::Arc;

/// A cell of the grid, too small for two discs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Place of its disc, or of the dart that waits to be judged.
    pub(super) at: [f64; 2],
    /// When that dart is thrown, in mean times between two darts into a whole cell; 0 for discs given at the start.
    pub(super) time: f64,
    pub(super) fate: Fate,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fate {
    /// A dart waits to be judged.
    Waiting,
    /// It holds a disc.
    Disc,
    /// It holds no disc and has no room for one.
    Full,
}

/// A full cell.
pub(super) const NOTHING: Cell = Cell { at: [0.0; 2], time: f64::INFINITY, fate: Fate::Full };

/// A cell and those up to two columns and rows away, row by row from below: all that can hold a disc too near.
pub(super) type Block = [Cell; 25];

/// Index of the cell in the middle of a block.
pub(super) const MIDDLE: usize = 12;

/// Columns and rows from the middle of a block to its cell `i`.
pub(super) fn offset(i: usize) -> [i64; 2] {
    [i as i64 % 5 - 2, i as i64 / 5 - 2]
}

/// The cells of a tile, row by row.
type Page = [Cell; TILE * TILE];

/// How far a tile is computed.
#[derive(Debug)]
enum Progress {
    Untouched,
    Working(Box<Page>),
    Settled(Arc<Tile>),
}

#[derive(Debug)]
pub(super) struct Grid {
    pub(super) board: Board,
    /// Tiles along a side.
    pub(super) across: usize,
    tiles: Vec<Progress>,
}

impl Grid {
    pub(super) fn new(board: Board) -> Self {
        let across = board.cells.div_ceil(TILE);
        let tiles = (0..across * across).map(|_| Progress::Untouched).collect();
        Self { board, across, tiles }
    }

    /// The cells of all tiles that are neither untouched nor settled.
    pub(super) fn worked_on(&self) -> impl Iterator<Item = &Cell> {
        self.tiles.iter().flat_map(|tile| match tile {
            Progress::Working(page) => &page[..],
            Progress::Untouched | Progress::Settled(_) => &[],
        })
    }

    /// The discs of a tile, if it is settled.
    pub(super) fn settled(&self, tile: usize) -> Option<Arc<Tile>> {
        match &self.tiles[tile] {
            Progress::Settled(tile) => Some(tile.clone()),
            Progress::Untouched | Progress::Working(_) => None,
        }
    }

    /// Reduces a tile, in which no dart waits any more, to its discs.
    pub(super) fn settle(&mut self, tile: usize) -> Arc<Tile> {
        let discs = self.page(tile).iter().map(|cell| (cell.fate == Fate::Disc).then_some(cell.at));
        let settled = Arc::new(Tile::new(discs));
        self.tiles[tile] = Progress::Settled(settled.clone());
        settled
    }

    /// The block of a cell, with places as seen from that cell.
    #[inline(always)]
    pub(super) fn block(&mut self, cell: [usize; 2]) -> Block {
        let (tile, k) = self.slot(cell);
        let mut block = [NOTHING; 25];
        let inside = |c: usize| (2..TILE - 2).contains(&(c % TILE)) && c + 2 < self.board.cells;
        if cell.into_iter().all(inside) {
            let page = self.page(tile);
            for (row, five) in block.chunks_exact_mut(5).enumerate() {
                five.copy_from_slice(&page[k + row * TILE - 2 * TILE - 2..][..5]);
            }
            return block;
        }
        for (i, there) in block.iter_mut().enumerate() {
            let (other, shift) = self.board.beside(cell, offset(i));
            let Cell { at: [x, y], time, fate } = self.cell(other);
            *there = Cell { at: [x + shift[0], y + shift[1]], time, fate };
        }
        block
    }

    /// Number of a cell, row by row through the box.
    pub(super) fn number(&self, [column, row]: [usize; 2]) -> u32 {
        (row * self.board.cells + column) as u32
    }

    /// Column and row of cell `k` of a tile.
    pub(super) fn cell_of(&self, tile: usize, k: usize) -> [usize; 2] {
        [tile % self.across * TILE + k % TILE, tile / self.across * TILE + k / TILE]
    }

    /// Tile of a cell, and its index in the tile.
    #[inline(always)]
    fn slot(&self, [column, row]: [usize; 2]) -> (usize, usize) {
        (row / TILE * self.across + column / TILE, row % TILE * TILE + column % TILE)
    }

    fn cell(&mut self, cell: [usize; 2]) -> Cell {
        let (tile, k) = self.slot(cell);
        if let Progress::Settled(tile) = &self.tiles[tile] {
            return tile.disc(k % TILE, k / TILE).map_or(NOTHING, |at| Cell { at, time: 0.0, fate: Fate::Disc });
        }
        self.page(tile)[k]
    }

    /// A cell of a tile that is not settled.
    pub(super) fn cell_mut(&mut self, cell: [usize; 2]) -> &mut Cell {
        let (tile, k) = self.slot(cell);
        &mut self.page(tile)[k]
    }

    /// The cells of a tile that is not settled.
    #[inline(always)]
    pub(super) fn page(&mut self, tile: usize) -> &mut Page {
        if matches!(self.tiles[tile], Progress::Untouched) {
            self.tiles[tile] = Progress::Working(self.first_darts(tile));
        }
        match &mut self.tiles[tile] {
            Progress::Working(page) => page,
            Progress::Untouched | Progress::Settled(_) => unreachable!("no dart waits in a settled tile"),
        }
    }

    /// The first dart of every cell of a tile.
    fn first_darts(&self, tile: usize) -> Box<Page> {
        let mut random = self.board.stream(Stream::Tile(tile));
        let mut page = Box::new([NOTHING; TILE * TILE]);
        for (k, there) in page.iter_mut().enumerate() {
            let cell = self.cell_of(tile, k);
            // The last tiles reach beyond the box.
            if cell.iter().all(|&c| c < self.board.cells) {
                let time = wait(&mut random);
                let at = place(&mut random, self.board.corner(cell), self.board.width);
                *there = Cell { at, time, fate: Fate::Waiting };
            }
        }
        page
    }
}
