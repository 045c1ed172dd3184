//! "Did you mean": the known name nearest to a misspelt one.

/// The candidate nearest to `word`, if slips of the fingers explain the difference: at most one in three letters. A
/// slip inserts, drops or replaces a letter, or swaps it with its neighbour.
pub(crate) fn nearest<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let word = word.to_lowercase().replace('-', "_");
    candidates
        .into_iter()
        .map(|candidate| (strsim::osa_distance(&word, &candidate.to_lowercase()), candidate))
        .filter(|(slips, candidate)| *slips <= (candidate.len().max(word.len()) / 3).max(1))
        .min_by_key(|(slips, _)| *slips)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_finds_its_key_and_a_stranger_finds_none() {
        let keys = ["gamma", "kappa", "runs_per_point", "e_w", "v_t"];
        assert_eq!(nearest("gama", keys), Some("gamma"));
        assert_eq!(nearest("gmama", keys), Some("gamma"));
        assert_eq!(nearest("run-per-point", keys), Some("runs_per_point"));
        assert_eq!(nearest("V_t", keys), Some("v_t"));
        assert_eq!(nearest("temperature", keys), None);
    }
}
