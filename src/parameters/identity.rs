//! The identities of grid points and jobs: hashes of what decides them.

use std::fmt;
use std::str::FromStr;

/// Raised whenever a change of the code makes a job give other numbers. Results of older versions then count as stale.
pub const PHYSICS_VERSION: u32 = 5;

/// Identity of a grid point: 80 bits of the hash of its canonical form, written as 20 hex digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PointId(u128);

/// Identity of a job: 80 bits of the hash of point, seed and physics version, written as 20 hex digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JobId(u128);

/// The first 80 bits of a blake3 hash. Among a million ids two are equal with probability 4e-13.
fn first_80_bits(hash: blake3::Hash) -> u128 {
    let mut wide = [0_u8; 16];
    wide[6..].copy_from_slice(&hash.as_bytes()[..10]);
    u128::from_be_bytes(wide)
}

impl PointId {
    /// Identity of the point with this canonical text.
    pub fn of_canonical(text: &str) -> Self {
        Self(first_80_bits(blake3::hash(text.as_bytes())))
    }
}

impl JobId {
    /// Identity of the job of a grid point and a seed, under the current [`PHYSICS_VERSION`].
    pub fn new(point: PointId, seed: u64) -> Self {
        Self::of_version(point, seed, PHYSICS_VERSION)
    }

    /// The same under any physics version.
    pub fn of_version(point: PointId, seed: u64, physics_version: u32) -> Self {
        let mut bytes = [0_u8; 28];
        bytes[..16].copy_from_slice(&point.0.to_be_bytes());
        bytes[16..24].copy_from_slice(&seed.to_be_bytes());
        bytes[24..].copy_from_slice(&physics_version.to_be_bytes());
        Self(first_80_bits(blake3::hash(&bytes)))
    }
}

/// A text that is not 20 hex digits.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` is no id: an id has 20 hexadecimal digits (see the column job_id of `runs`)")]
pub struct BadId(String);

macro_rules! hex_id {
    ($id:ident) => {
        impl fmt::Display for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{:020x}", self.0)
            }
        }
        impl fmt::Debug for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
        impl FromStr for $id {
            type Err = BadId;
            fn from_str(text: &str) -> Result<Self, BadId> {
                let digits = text.len() == 20 && text.bytes().all(|c| c.is_ascii_hexdigit());
                let value = u128::from_str_radix(text, 16).ok().filter(|_| digits);
                value.map(Self).ok_or_else(|| BadId(text.to_owned()))
            }
        }
    };
}
hex_id!(PointId);
hex_id!(JobId);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_reads_back_from_its_text() {
        let id = JobId::new(PointId::of_canonical("a point"), 7);
        assert_eq!(id.to_string().len(), 20);
        assert_eq!(id.to_string().parse::<JobId>().unwrap(), id);
        assert!("12".parse::<JobId>().is_err());
        assert!("+0000000000000000001".parse::<JobId>().is_err());
    }
}
