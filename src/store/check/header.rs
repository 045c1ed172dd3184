//! What every store's database has in its header, for a database that no seal vouches for
//! (<https://www.sqlite.org/fileformat2.html#the_database_header>).

use crate::store::schema::{APPLICATION_ID, LATEST};
use crate::store::seal::page_size;

/// Bytes of a header.
pub(super) const LENGTH: usize = 100;

/// Bytes that are the same in every store: where they begin, and what they are.
const SAME: [(usize, &[u8]); 5] = [
    (0, b"SQLite format 3\0"),
    // No bytes are reserved in a page; then three fractions that SQLite prescribes.
    (20, &[0, 64, 32, 32]),
    // Schema format 4, no suggested cache, no vacuum on commit, UTF-8.
    (44, &[0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]),
    // No incremental vacuum.
    (64, &[0; 4]),
    // Kept empty by SQLite.
    (72, &[0; 20]),
];

fn number(header: &[u8], at: usize) -> u32 {
    header[at..at + 4].iter().fold(0, |number, &byte| number << 8 | u32::from(byte))
}

/// What no store's header says, in words. With a log, which may hold newer pages, the size of the file says nothing.
pub(super) fn problem(header: &[u8], file_bytes: u64, has_log: bool) -> Option<String> {
    if header.len() < LENGTH {
        return Some(format!("it ends within its header, after {} bytes", header.len()));
    }
    let number = |at| number(header, at);
    let size = page_size(header).map(|size| size as u64);
    let laws = [
        (
            SAME.iter().all(|(at, bytes)| header[*at..].starts_with(bytes)),
            "bytes that are the same in all stores differ",
        ),
        (matches!(header[18..20], [1, 1] | [2, 2]), "the file format is one that no store has"),
        // Zero is what other programs' databases have, which are not for this program to judge.
        ([0, APPLICATION_ID].contains(&number(68)), "it does not say that this is a store"),
        (number(24) == number(92), "the two counters of changes differ"),
        ((number(32) == 0) == (number(36) == 0), "it contradicts itself about unused pages"),
        (size.is_some_and(|size| has_log || file_bytes == size * u64::from(number(28))), "the size is another"),
    ];
    let broken: Vec<_> = laws.iter().filter(|(holds, _)| !holds).map(|(_, problem)| *problem).collect();
    (!broken.is_empty()).then(|| format!("its header is not that of a store: {}", broken.join(", ")))
}

/// Makes a header that SQLite takes, for a file of so many bytes. The number of the schema is kept if there is such a
/// one.
pub(super) fn rebuild(header: &mut [u8], file_bytes: u64, has_log: bool) {
    let schema =
        Some(number(header, 60)).filter(|schema| (1..=LATEST as u32).contains(schema)).unwrap_or(LATEST as u32);
    header[..LENGTH].fill(0);
    for (at, bytes) in SAME {
        header[at..at + bytes.len()].copy_from_slice(bytes);
    }
    header[16..18].copy_from_slice(&4096_u16.to_be_bytes());
    header[18..20].fill(if has_log { 2 } else { 1 });
    let pages = u32::try_from(file_bytes / 4096).unwrap_or(u32::MAX);
    let numbers = [(24, 1), (28, pages), (40, 1), (60, schema), (68, APPLICATION_ID), (92, 1), (96, 3_007_000)];
    for (at, number) in numbers {
        header[at..at + 4].copy_from_slice(&number.to_be_bytes());
    }
}
