//! Arrays that begin on a cache line.
//!
//! A vector of eight numbers fills a cache line. In arrays that begin anywhere, each load and store touches two lines,
//! which costs 10 to 15% of a step in free flight with AVX-512.
//!
//! This is own code because it needs no `unsafe`, and its bytes in a checkpoint are those of a `Vec<f64>`.

use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// Size of a cache line in bytes.
const LINE: usize = 64;

/// A `Box<[f64]>` that begins on a cache line.
#[derive(Serialize, Deserialize)]
#[serde(from = "Vec<f64>", into = "Vec<f64>")]
pub struct Aligned {
    /// The numbers from `start` on.
    values: Vec<f64>,
    start: usize,
}

impl Aligned {
    pub(crate) fn zeros(len: usize) -> Self {
        let per_line = LINE / size_of::<f64>();
        let mut values: Vec<f64> = Vec::with_capacity(len + per_line);
        let start = (values.as_ptr() as usize).wrapping_neg() % LINE / size_of::<f64>();
        // This stays within the capacity, so the numbers do not move.
        values.resize(start + len, 0.0);
        Self { values, start }
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        Self::from(&**self)
    }

    fn clone_from(&mut self, source: &Self) {
        if self.len() == source.len() {
            self.copy_from_slice(source);
        } else {
            *self = source.clone();
        }
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.values[self.start..]
    }
}

impl DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.start..]
    }
}

impl From<&[f64]> for Aligned {
    fn from(values: &[f64]) -> Self {
        let mut aligned = Self::zeros(values.len());
        aligned.copy_from_slice(values);
        aligned
    }
}

impl From<Vec<f64>> for Aligned {
    fn from(values: Vec<f64>) -> Self {
        Self::from(values.as_slice())
    }
}

impl From<Aligned> for Vec<f64> {
    fn from(aligned: Aligned) -> Self {
        aligned.to_vec()
    }
}

impl PartialEq for Aligned {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl std::fmt::Debug for Aligned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_on_a_cache_line_and_keep_their_order() {
        for len in [1, 7, 19, 264] {
            let values: Vec<f64> = (0..len).map(f64::from).collect();
            let mut aligned = Aligned::from(values.as_slice());
            assert_eq!((aligned.as_ptr() as usize % LINE, &*aligned), (0, &*values));
            aligned[0] = -1.0;
            let copy = aligned.clone();
            assert_eq!((copy.as_ptr() as usize % LINE, copy.len(), copy[0]), (0, values.len(), -1.0));
        }
    }
}
