//! Random sequential addition without end, worked out where someone looks.
//!
//! Darts are thrown for ever, everywhere alike; one that lands further than the spacing from all earlier discs becomes a disc. What becomes of it depends
//! on earlier darts near it alone, so every cell of the grid draws its darts and the times between them from a random stream of its own, and a
//! dart is judged once no cell next to its own has an earlier one waiting. In whatever order cells are asked for, the discs are the same.
//! After a miss a cell throws only into squares that no one disc covers wholly (Zhang and Torquato, Phys. Rev. E 88, 053312 (2013)) and waits the longer
//! for it, which changes nothing in the distribution. The squares are quartered as they become few; none left proves that the cell is full.

use crate::physics::walls::arrays::darts::{Board, GRAIN, Stream, place, squared, uniform};
use crate::physics::walls::arrays::tile::{TILE, Tile};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;
use std::sync::Arc;

/// So many open squares of a cell are not quartered at every miss.
const MANY: usize = 8;

/// A cell and those up to two columns and rows away, from below: all that may be in conflict with it.
type Block = [Cell; 25];

/// A cell of the grid, too small for two discs.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Of its disc, or of the dart that waits to be judged.
    at: [f64; 2],
    /// When that dart is thrown, in mean times between darts into a whole cell; 0 for discs that were given.
    time: f64,
    fate: Fate,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Waiting,
    Disc,
    /// No disc, and no room for one.
    Full,
}

const NOTHING: Cell = Cell { at: [0.0; 2], time: f64::INFINITY, fate: Fate::Full };

/// What is left of a cell after a miss.
#[derive(Debug)]
struct Open {
    random: ChaCha8Rng,
    /// Lower corners of squares that no one disc covers.
    squares: Vec<[f64; 2]>,
    /// Side of a square.
    side: f64,
    /// Since they were quartered.
    misses: usize,
}

#[derive(Debug)]
enum Page {
    Untouched,
    Working(Box<[Cell; TILE * TILE]>),
    Settled(Arc<Tile>),
}

/// Discs that are being added.
#[derive(Debug)]
pub(super) struct Growth {
    board: Board,
    /// Tiles along a side.
    across: usize,
    pages: Vec<Page>,
    open: HashMap<u32, Box<Open>>,
    /// Empty between judgements, of which there are millions.
    chain: Vec<[usize; 2]>,
}

impl Growth {
    /// Into an empty box.
    pub(super) fn new(board: Board) -> Self {
        let across = board.cells.div_ceil(TILE);
        let pages = (0..across * across).map(|_| Page::Untouched).collect();
        Self { board, across, pages, open: HashMap::new(), chain: Vec::new() }
    }

    /// Cells along a side of the box.
    pub(super) fn cells(&self) -> usize {
        self.board.cells
    }

    /// Tiles along a side of the box.
    pub(super) fn across(&self) -> usize {
        self.across
    }

    /// Into a box with these discs.
    pub(super) fn onto(board: Board, discs: &[[f64; 2]]) -> Self {
        let mut growth = Self::new(board);
        for &at in discs {
            let cell = at.map(|c| growth.board.cell_at(c));
            *growth.cell_mut(cell) = Cell { at, time: 0.0, fate: Fate::Disc };
        }
        growth
    }

    /// The next discs, at most `wanted`, in the order of their times.
    pub(super) fn grow(mut self, wanted: usize) -> Vec<[f64; 2]> {
        let mut until = 1.0;
        // Discs of later times come later, so all is known once enough are earlier than some time.
        while self.judge_until(until) && self.new_discs().count() < wanted {
            until *= 2.0;
        }
        let mut discs: Vec<&Cell> = self.new_discs().collect();
        discs.sort_by(|a, b| a.time.total_cmp(&b.time));
        discs.iter().take(wanted).map(|cell| cell.at).collect()
    }

    /// Judges all darts up to a time; tells whether any wait.
    fn judge_until(&mut self, until: f64) -> bool {
        (0..self.pages.len()).fold(false, |waiting, tile| waiting | self.judge_tile(tile, until))
    }

    /// Discs beside those given.
    fn new_discs(&self) -> impl Iterator<Item = &Cell> {
        let cells = self.pages.iter().flat_map(|page| match page {
            Page::Working(page) => &page[..],
            Page::Untouched | Page::Settled(_) => &[],
        });
        cells.filter(|cell| cell.fate == Fate::Disc && cell.time > 0.0)
    }

    /// All discs of a tile.
    pub(super) fn settle(&mut self, tile: usize) -> Arc<Tile> {
        if let Page::Settled(tile) = &self.pages[tile] {
            return tile.clone();
        }
        self.judge_tile(tile, f64::INFINITY);
        let discs = self.page(tile).iter().map(|cell| (cell.fate == Fate::Disc).then_some(cell.at));
        let settled = Arc::new(Tile::new(discs));
        self.pages[tile] = Page::Settled(settled.clone());
        settled
    }

    /// Judges the darts of a tile up to a time; tells whether any wait.
    fn judge_tile(&mut self, tile: usize, until: f64) -> bool {
        let is_due = |cell: &Cell| cell.fate == Fate::Waiting && cell.time <= until;
        let mut waiting = false;
        for k in 0..TILE * TILE {
            while is_due(&self.page(tile)[k]) {
                self.judge(self.cell_of(tile, k));
            }
            waiting |= self.page(tile)[k].fate == Fate::Waiting;
        }
        waiting
    }

    /// Judges the dart that waits in a cell, after all that it depends on.
    fn judge(&mut self, cell: [usize; 2]) {
        // Each depends on the next, which is earlier.
        let mut chain = std::mem::take(&mut self.chain);
        chain.push(cell);
        while let Some(&cell) = chain.last() {
            let block = self.block(cell);
            let dart = block[12];
            let earlier = |other: &Cell| (other.fate == Fate::Waiting) & (other.time < dart.time);
            // Without a branch for each: half of the time goes here.
            if block.iter().fold(false, |any, other| any | earlier(other))
                && let Some(i) = block.iter().position(earlier)
            {
                chain.push(self.board.beside(cell, away(i)).0);
                continue;
            }
            chain.pop();
            let square = self.board.spacing * self.board.spacing;
            let touches = |other: &Cell| (other.fate == Fate::Disc) & (squared(other.at, dart.at) <= square);
            if block.iter().fold(false, |any, other| any | touches(other)) {
                self.miss(cell, &block);
            } else {
                self.cell_mut(cell).fate = Fate::Disc;
                self.open.remove(&self.number(cell));
            }
        }
        self.chain = chain;
    }

    /// Throws the next dart into a cell whose last one missed, if it has room.
    fn miss(&mut self, cell: [usize; 2], block: &Block) {
        let number = self.number(cell);
        let board = &self.board;
        let open = self.open.entry(number).or_insert_with(|| {
            let random = board.stream(Stream::Cell(number as usize));
            Box::new(Open { random, squares: vec![board.corner(cell)], side: board.width, misses: 0 })
        });
        open.misses += 1;
        if open.squares.len() < MANY || 4 * open.misses >= open.squares.len() {
            open.quarter(block, board.spacing);
        }
        // Places in smaller squares are hardly told apart.
        let next = if open.squares.is_empty() || open.side < 4.0 * GRAIN {
            self.open.remove(&number);
            NOTHING
        } else {
            let Open { random, squares, side, .. } = &mut **open;
            let share = squares.len() as f64 * (*side / board.width) * (*side / board.width);
            let time = block[12].time + wait(random) / share;
            let square = squares[((uniform(random) * squares.len() as f64) as usize).min(squares.len() - 1)];
            Cell { at: place(random, square, *side), time, fate: Fate::Waiting }
        };
        *self.cell_mut(cell) = next;
    }

    /// A cell and those around it, at places as seen from it.
    #[inline(always)]
    fn block(&mut self, cell: [usize; 2]) -> Block {
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
            let (other, shift) = self.board.beside(cell, away(i));
            let Cell { at: [x, y], time, fate } = self.cell(other);
            *there = Cell { at: [x + shift[0], y + shift[1]], time, fate };
        }
        block
    }

    fn number(&self, [column, row]: [usize; 2]) -> u32 {
        (row * self.board.cells + column) as u32
    }

    /// Tile of a cell, and its place there.
    #[inline(always)]
    fn slot(&self, [column, row]: [usize; 2]) -> (usize, usize) {
        (row / TILE * self.across + column / TILE, row % TILE * TILE + column % TILE)
    }

    /// The cell at a place of a tile.
    fn cell_of(&self, tile: usize, k: usize) -> [usize; 2] {
        [tile % self.across * TILE + k % TILE, tile / self.across * TILE + k / TILE]
    }

    fn cell(&mut self, cell: [usize; 2]) -> Cell {
        let (tile, k) = self.slot(cell);
        if let Page::Settled(tile) = &self.pages[tile] {
            return tile.disc(k % TILE, k / TILE).map_or(NOTHING, |at| Cell { at, time: 0.0, fate: Fate::Disc });
        }
        self.page(tile)[k]
    }

    fn cell_mut(&mut self, cell: [usize; 2]) -> &mut Cell {
        let (tile, k) = self.slot(cell);
        &mut self.page(tile)[k]
    }

    /// A tile that is not settled.
    #[inline(always)]
    fn page(&mut self, tile: usize) -> &mut [Cell; TILE * TILE] {
        if matches!(self.pages[tile], Page::Untouched) {
            self.pages[tile] = Page::Working(self.first_darts(tile));
        }
        match &mut self.pages[tile] {
            Page::Working(page) => page,
            Page::Untouched | Page::Settled(_) => unreachable!("no dart waits in a settled tile"),
        }
    }

    /// The first dart of every cell of a tile.
    fn first_darts(&self, tile: usize) -> Box<[Cell; TILE * TILE]> {
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

impl Open {
    /// Leaves those quarters of the squares that no one disc covers.
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

/// Time to the next of events that come once in a unit of time.
fn wait(random: &mut ChaCha8Rng) -> f64 {
    -libm::log(1.0 - uniform(random))
}

/// Columns and rows from the middle of a block to its cell `i`.
fn away(i: usize) -> [i64; 2] {
    [i as i64 % 5 - 2, i as i64 / 5 - 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, ObstacleField};

    /// Two tiles by two, of which the last ones reach beyond it.
    const BOX: f64 = 23.0;

    fn board(seed: u64) -> Board {
        Board::new(&ObstacleField { w_ob: 0.5, sigma_ob: 0.5, density: Density::Saturated, box_size: BOX }, seed)
    }

    /// Squared distance of two places in the periodic box.
    fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
        let [dx, dy] = [0, 1].map(|k| (a[k] - b[k]).abs()).map(|d| d.min(BOX - d));
        dx * dx + dy * dy
    }

    /// Number of discs, and of pairs of them closer than 1.1 spacings.
    fn count(discs: &[[f64; 2]]) -> [f64; 2] {
        let close = |i: usize| discs[..i].iter().filter(|&&other| apart(discs[i], other) < 1.21).count();
        [discs.len() as f64, (0..discs.len()).map(close).sum::<usize>() as f64]
    }

    fn new_discs_until(time: f64, mut growth: Growth) -> Vec<[f64; 2]> {
        growth.judge_until(time);
        growth.new_discs().filter(|cell| cell.time <= time).map(|cell| cell.at).collect()
    }

    fn grown_until(time: f64, seed: u64) -> Vec<[f64; 2]> {
        new_discs_until(time, Growth::new(board(seed)))
    }

    fn thrown_until(time: f64, seed: u64) -> Vec<[f64; 2]> {
        let board = board(seed);
        let (mut random, mut discs) = (board.stream(Stream::Box), Vec::new());
        for _ in 0..(time * (board.cells * board.cells) as f64) as usize {
            let at = place(&mut random, [0.0; 2], BOX);
            if discs.iter().all(|&disc| apart(disc, at) > 1.0) {
                discs.push(at);
            }
        }
        discs
    }

    #[test]
    fn at_any_time_there_are_the_discs_that_darts_thrown_one_by_one_leave() {
        const SEEDS: u64 = 40;
        for time in [0.3, 1.0, 3.0, 30.0] {
            let [grown, thrown] = [grown_until, thrown_until]
                .map(|until| (0..SEEDS).map(|seed| count(&until(time, seed))).collect::<Vec<_>>());
            for what in 0..2 {
                let [(mean, variance), (expected, _)] = [&grown, &thrown].map(|counts| {
                    let mean = counts.iter().map(|count| count[what]).sum::<f64>() / SEEDS as f64;
                    (mean, counts.iter().map(|count| (count[what] - mean).powi(2)).sum::<f64>() / SEEDS as f64)
                });
                let error = (2.0 * variance / SEEDS as f64).sqrt();
                assert!(
                    (mean - expected).abs() < 3.0 * error,
                    "time {time}, {what}: {mean}, not {expected} +- {error}"
                );
            }
        }
    }

    #[test]
    fn the_next_discs_stand_between_those_given_earliest_first() {
        let given = thrown_until(1.0, 1);
        let early = new_discs_until(0.1, Growth::onto(board(1), &given));
        let few = Growth::onto(board(1), &given).grow(early.len());
        let all = Growth::onto(board(1), &given).grow(usize::MAX);
        assert!(early.len() > 5 && all.len() > 3 * early.len());
        assert_eq!(few, all[..early.len()]);
        assert!(early.iter().all(|disc| few.contains(disc)));
        let discs: Vec<_> = given.iter().chain(&all).copied().collect();
        for (i, &disc) in discs.iter().enumerate() {
            assert!(discs[..i].iter().all(|&other| apart(disc, other) > 1.0));
        }
        // Saturated: 0.547 of the area.
        assert!((discs.len() as f64 / (0.547 * 4.0 / std::f64::consts::PI * BOX * BOX) - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_tile_settles_alike_whatever_was_judged_before() {
        let tiles = |first: &[usize]| {
            let mut growth = Growth::new(board(4));
            growth.judge_until(0.5 * first.len() as f64);
            first.iter().for_each(|&tile| drop(growth.settle(tile)));
            [0, 1, 2, 3].map(|tile| format!("{:?}", growth.settle(tile)))
        };
        assert_eq!(tiles(&[]), tiles(&[3]));
        assert_eq!(tiles(&[]), tiles(&[2, 0, 1]));
    }
}
