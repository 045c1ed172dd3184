//! Discs sorted by cell, so that those near a place are found fast.

/// The centres of the discs of a square box.
#[derive(Debug)]
pub(super) struct Sorted {
    /// The centres, cell by cell and row by row.
    at: Vec<[f64; 2]>,
    /// The discs of cell k are `first[k]..first[k + 1]`.
    first: Vec<u32>,
    /// Cells along a side.
    pub(super) cells: usize,
}

impl Sorted {
    /// Sorts discs into a grid of this many cells along a side of the box.
    pub(super) fn new(box_size: f64, cells: usize, places: &[[f64; 2]]) -> Self {
        let cell_of = |c: f64| ((c / box_size * cells as f64) as usize).min(cells - 1);
        let cell: Vec<usize> = places.iter().map(|&[x, y]| cell_of(y) * cells + cell_of(x)).collect();
        let mut first = vec![0_u32; cells * cells + 1];
        cell.iter().for_each(|&k| first[k + 1] += 1);
        for k in 0..cells * cells {
            first[k + 1] += first[k];
        }
        let (mut next, mut at) = (first.clone(), vec![[0.0; 2]; places.len()]);
        for (&place, &k) in places.iter().zip(&cell) {
            at[next[k] as usize] = place;
            next[k] += 1;
        }
        Self { at, first, cells }
    }

    /// Number and place of each disc in a cell.
    #[inline]
    pub(super) fn discs(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = (u32, [f64; 2])> {
        let k = row * self.cells + column;
        (self.first[k]..self.first[k + 1]).map(|i| (i, self.at[i as usize]))
    }

    pub(super) fn len(&self) -> usize {
        self.at.len()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.at) + size_of_val(&*self.first)
    }
}
