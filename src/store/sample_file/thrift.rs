//! A walk through a structure of Thrift's compact protocol, in which the parts of a Parquet file that are not data are
//! written (<https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>).
//!
//! A reader that believes the lengths in such a structure can be made to reserve more memory than there is, which ends
//! the program. The walk reserves nothing: it only finds out whether all lengths fit the bytes that follow.

/// How deep structures may be nested. Those of Parquet files are nested six deep.
const DEEPEST: usize = 16;

/// Walks through the structure at the beginning of `bytes`, and calls `see` with the path and the value of each whole
/// number that stands in no list: `[5, 2]` is field 2 of the structure that is field 5. Returns how many bytes the
/// structure takes; `None` if it does not fit in `bytes`.
pub(super) fn walk(bytes: &[u8], see: &mut dyn FnMut(&[i64], i64)) -> Option<usize> {
    let mut walk = Walk { rest: bytes, path: Vec::with_capacity(DEEPEST), lists: 0, see };
    walk.structure()?;
    Some(bytes.len() - walk.rest.len())
}

struct Walk<'a> {
    rest: &'a [u8],
    /// The fields that lead here.
    path: Vec<i64>,
    /// How many lists lie around this place.
    lists: usize,
    see: &'a mut dyn FnMut(&[i64], i64),
}

impl Walk<'_> {
    fn structure(&mut self) -> Option<()> {
        if self.path.len() + self.lists >= DEEPEST {
            return None;
        }
        let mut field = 0_i64;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            field = match head >> 4 {
                0 => self.whole()?,
                further => field.checked_add(further.into())?,
            };
            self.path.push(field);
            // The truth of a field stands in its type, and takes no byte.
            if !matches!(head & 15, 1 | 2) {
                self.value(head & 15)?;
            }
            self.path.pop();
        }
    }

    fn value(&mut self, kind: u8) -> Option<()> {
        match kind {
            1..=3 => self.byte().map(drop),
            4..=6 => {
                let number = self.whole()?;
                if self.lists == 0 {
                    (self.see)(&self.path, number);
                }
                Some(())
            }
            7 => self.skip(8),
            8 => {
                let length = self.length()?;
                self.skip(length)
            }
            9 | 10 => self.list(),
            12 => self.structure(),
            // Parquet files hold no maps.
            _ => None,
        }
    }

    fn list(&mut self) -> Option<()> {
        let head = self.byte()?;
        let size = if head >> 4 == 15 { self.length()? } else { usize::from(head >> 4) };
        // Every element takes a byte at least.
        if size > self.rest.len() || self.path.len() + self.lists >= DEEPEST {
            return None;
        }
        self.lists += 1;
        (0..size).try_for_each(|_| self.value(head & 15))?;
        self.lists -= 1;
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(byte)
    }

    fn skip(&mut self, bytes: usize) -> Option<()> {
        self.rest = self.rest.get(bytes..)?;
        Some(())
    }

    /// A number of seven bits a byte, the lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Some(number);
            }
        }
        None
    }

    fn length(&mut self) -> Option<usize> {
        usize::try_from(self.varint()?).ok()
    }

    /// A whole number with a sign, which is its lowest bit.
    fn whole(&mut self) -> Option<i64> {
        let zigzag = self.varint()?;
        Some((zigzag >> 1) as i64 ^ -((zigzag & 1) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Field 1 is -3; field 2 a structure with field 3, the text "ab", and field 4, the list [7, 8].
    const SOUND: [u8; 14] = [0x15, 0x05, 0x1c, 0x38, 0x02, b'a', b'b', 0x19, 0x25, 0x0e, 0x10, 0x15, 0x02, 0x00];

    #[test]
    fn whole_numbers_are_seen_with_their_paths() {
        let bytes = [SOUND.as_slice(), &[0x00, 0xff]].concat();
        let mut seen = Vec::new();
        let taken = walk(&bytes, &mut |path, number| seen.push((path.to_vec(), number)));
        assert_eq!(taken, Some(15));
        assert_eq!(seen, [(vec![1], -3), (vec![2, 5], 1)]);
    }

    #[test]
    fn lengths_beyond_the_end_and_endless_nesting_are_refused() {
        let mut nothing = |_: &[i64], _| {};
        for length in 0..SOUND.len() {
            assert_eq!(walk(&SOUND[..length], &mut nothing), None);
        }
        // A list of 2^31 - 1 structures, and a text of as many bytes.
        assert_eq!(walk(&[0x19, 0xfc, 0xff, 0xff, 0xff, 0xff, 0x07, 0x00], &mut nothing), None);
        assert_eq!(walk(&[0x18, 0xff, 0xff, 0xff, 0xff, 0x07, 0x00], &mut nothing), None);
        assert_eq!(walk(&[0x1c; 1000], &mut nothing), None);
        assert_eq!(walk(&[0x19, 0x19].repeat(1000), &mut nothing), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_walked_within_their_length(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let taken = walk(&bytes, &mut |_, _| {});
            prop_assert!(taken.is_none_or(|taken| taken <= bytes.len()));
        }
    }
}
