//! Arbitrary bytes as campaign files and as stores: no panic, no hang, no endless memory.
//!
//! Inputs are mutated valid files, two files spliced, and pure noise. Each input is made from its number alone, so a
//! failure names what to run again. A few run with the other tests; these lines run many, or one of them:
//!
//! ```text
//! MENISCUS_FUZZ_INPUTS=500000 cargo test --release --test fuzz -- --nocapture --test-threads 2
//! MENISCUS_FUZZ_FROM=4711 MENISCUS_FUZZ_INPUTS=1 cargo test --release --test fuzz -- --nocapture stores
//! ```
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

#[path = "fuzz/mutate.rs"]
mod mutate;
#[path = "fuzz/store.rs"]
mod store;

use meniscus::campaign::file::Campaign;
use mutate::{Random, campaign_text};
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

/// The numbers of the inputs to try: `few`, unless the environment says otherwise.
fn inputs(few: u64) -> Range<u64> {
    let number = |name| std::env::var(name).ok().map(|text| text.parse::<u64>().unwrap());
    let from = number("MENISCUS_FUZZ_FROM").unwrap_or(0);
    from..from + number("MENISCUS_FUZZ_INPUTS").unwrap_or(few)
}

/// Tries every input; says which one panicked, and what the slowest and the whole cost.
fn try_all(target: &str, inputs: Range<u64>, mut run: impl FnMut(u64)) {
    let (begin, count) = (Instant::now(), inputs.end - inputs.start);
    let mut slowest = (Duration::ZERO, 0);
    for input in inputs {
        let start = Instant::now();
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(input)));
        assert!(done.is_ok(), "{target}: input {input} panicked; run it alone with MENISCUS_FUZZ_FROM={input}");
        slowest = slowest.max((start.elapsed(), input));
        if input % 20_000 == 19_999 {
            println!("{target}: {input}, slowest {slowest:?}, {}", peak_memory());
        }
    }
    println!("{target}: {count} inputs in {:.1?}, slowest {slowest:?}, {}", begin.elapsed(), peak_memory());
}

/// The most memory that this process ever had.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.map_or_else(String::new, |line| line.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Campaign files, good and bad, of the tests and of the program.
fn corpus() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["campaigns", "tests/campaign_files/good", "tests/campaign_files/bad"];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap());
    let mut paths: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    paths.sort();
    paths.iter().filter_map(|path| std::fs::read_to_string(path).ok()).collect()
}

#[test]
fn campaign_files_of_any_bytes_are_read_or_refused_with_a_place() {
    let corpus = corpus();
    assert!(corpus.len() > 20);
    try_all("campaigns", inputs(3_000), |input| {
        let text = campaign_text(&corpus, &mut Random::new(input));
        match Campaign::parse("any.toml", &text) {
            Ok(campaign) => assert!(campaign.n_jobs() > 0),
            Err(problems) => assert!(!problems.render(false).is_empty()),
        }
    });
}

#[test]
fn stores_of_any_bytes_are_opened_refused_or_repaired() {
    let stores = store::corpus();
    let scratch = store::scratch();
    try_all("stores", inputs(150), |input| store::run(&stores, scratch.path(), &mut Random::new(input)));
}
