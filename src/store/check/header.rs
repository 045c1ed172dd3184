//! The laws of an SQLite database header, for a database that no seal vouches for
//! (<https://www.sqlite.org/fileformat2.html#the_database_header>).

use crate::store::migrate::APPLICATION_ID;
use crate::store::seal::page_size;

/// Bytes of a header.
pub(super) const LENGTH: usize = 100;

const MAGIC: &[u8] = b"SQLite format 3\0";

fn number(header: &[u8], at: usize) -> u32 {
    header[at..at + 4].iter().fold(0, |number, &byte| number << 8 | u32::from(byte))
}

/// What no store's header says, in words; with a log, which may hold newer pages, the size of the file says nothing.
pub(super) fn problems(header: &[u8], file_bytes: u64, has_log: bool) -> Vec<String> {
    if header.len() < LENGTH {
        return vec![format!("it ends within its header, after {} bytes", header.len())];
    }
    let mut problems = Vec::new();
    let mut must = |holds: bool, problem: &str| {
        if !holds {
            problems.push(problem.to_owned());
        }
    };
    must(header.starts_with(MAGIC), "its header does not begin as that of an SQLite database");
    must(matches!(header[18..20], [1, 1] | [2, 2]), "its header names a file format that no store has");
    must(header[20] == 0 && header[21..24] == [64, 32, 32], "its header states page fractions that SQLite forbids");
    must(number(header, 44) == 4, "its header states a schema format that no store has");
    must([48, 52, 64].iter().all(|&at| number(header, at) == 0), "its header states settings that no store has");
    must(number(header, 56) == 1, "its header states another text encoding than UTF-8");
    must(number(header, 68) == APPLICATION_ID as u32, "its header does not say that it is a store");
    must(header[72..92].iter().all(|&byte| byte == 0), "its header is not empty where SQLite keeps it empty");
    must((number(header, 32) == 0) == (number(header, 36) == 0), "its header contradicts itself about unused pages");
    must(number(header, 24) == number(header, 92), "the two change counters of its header differ");
    match page_size(header).map(|size| size as u64) {
        None => must(false, "its header states a page size that SQLite does not have"),
        Some(size) if !has_log => {
            must(file_bytes == size * u64::from(number(header, 28)), "its header states another size than it has")
        }
        Some(_) => {}
    }
    problems
}

/// A header that SQLite takes, for a file of so many bytes: what it says of the database itself is kept where it can be.
pub(super) fn rebuilt(header: &[u8], file_bytes: u64, schema: u32) -> [u8; LENGTH] {
    let mut new = [0; LENGTH];
    new[..16].copy_from_slice(MAGIC);
    new[16..18].copy_from_slice(&4096_u16.to_be_bytes());
    new[18..24].copy_from_slice(&[1, 1, 0, 64, 32, 32]);
    let mut set = |at: usize, number: u32| new[at..at + 4].copy_from_slice(&number.to_be_bytes());
    set(24, 1);
    set(28, u32::try_from(file_bytes / 4096).unwrap_or(u32::MAX));
    set(40, 1);
    set(44, 4);
    set(56, 1);
    // The schema that it says it has, if there is such a one.
    let said = header.get(60..64).map_or(0, |bytes| number(bytes, 0));
    set(60, if (1..=schema).contains(&said) { said } else { schema });
    set(68, APPLICATION_ID as u32);
    set(92, 1);
    set(96, 3_007_000);
    new
}
