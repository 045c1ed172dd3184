//! A tile: the discs of a square of cells, each of which holds at most one.

/// Cells along a side of a tile.
pub(super) const TILE: usize = 32;

/// Discs by cell; they take 16 bytes per disc and 200 bytes per tile.
#[derive(Debug)]
pub(super) struct Tile {
    /// A bit for each cell of a row that holds a disc.
    taken: [u32; TILE],
    /// Number of discs in the rows below each row.
    first: [u16; TILE],
    /// The centres, row by row from left to right.
    discs: Box<[[f64; 2]]>,
}

impl Tile {
    /// The disc of each cell, row by row.
    pub(super) fn new(cells: impl Iterator<Item = Option<[f64; 2]>>) -> Self {
        let (mut taken, mut first, mut discs) = ([0; TILE], [0; TILE], Vec::new());
        for (k, disc) in cells.enumerate() {
            let (column, row) = (k % TILE, k / TILE);
            if column == 0 {
                first[row] = discs.len() as u16;
            }
            taken[row] |= u32::from(disc.is_some()) << column;
            discs.extend(disc);
        }
        Self { taken, first, discs: discs.into() }
    }

    #[inline]
    pub(super) fn disc(&self, column: usize, row: usize) -> Option<[f64; 2]> {
        let (taken, bit) = (self.taken[row], 1 << column);
        let before = self.first[row] as usize + (taken & (bit - 1)).count_ones() as usize;
        (taken & bit != 0).then(|| self.discs[before])
    }

    pub(super) fn len(&self) -> usize {
        self.discs.len()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.discs)
    }
}
