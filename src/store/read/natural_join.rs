//! A natural join of two views that hold the parameters of points finds no row, and must not do so silently.
//!
//! It compares every column that both have. Some of these are NULL in every row, as the width of a channel is among
//! obstacles, and NULL equals nothing.

/// The views that hold the parameters of points.
const OF_POINTS: [&str; 5] = ["runs", "all_runs", "stale_runs", "lambda_fits", "speed_averages"];

/// What to write instead, if the statement has such a join.
pub(super) fn way_out(sql: &str) -> Option<String> {
    let words = words(sql);
    let natural = (0..words.len()).filter(|&at| words[at] == "natural");
    natural.filter_map(|at| Some((left_of(&words[..at])?, right_of(&words[at..])?))).next().map(|(left, right)| {
        format!(
            "a natural join of {left} and {right} finds no row: it compares all parameters, and NULL equals nothing\n  \
             join by the point: {left} join {right} using (point_id)"
        )
    })
}

/// The view of points that the words after `natural` join.
fn right_of(words: &[String]) -> Option<&'static str> {
    let join = words.iter().position(|word| word == "join")?;
    of_points(words.get(join + 1)?)
}

/// The last view of points among the tables that stand before `natural` in the same FROM.
fn left_of(words: &[String]) -> Option<&'static str> {
    let mut depth = 0_i32;
    for word in words.iter().rev() {
        match word.as_str() {
            ")" => depth += 1,
            "(" => depth -= 1,
            "from" if depth == 0 => return None,
            word if depth == 0 => {
                if let Some(view) = of_points(word) {
                    return Some(view);
                }
            }
            _ => {}
        }
        if depth < 0 {
            return None;
        }
    }
    None
}

fn of_points(word: &str) -> Option<&'static str> {
    OF_POINTS.into_iter().find(|view| *view == word)
}

/// The words of a statement in lower case, and its parentheses; texts and comments are left out.
fn words(sql: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = sql;
    while let Some(first) = rest.chars().next() {
        let ends_after = |end: &str| rest[1..].find(end).map_or(rest.len(), |at| 1 + at + end.len());
        let length = match first {
            '\'' => ends_after("'"),
            _ if rest.starts_with("--") => ends_after("\n"),
            _ if rest.starts_with("/*") => ends_after("*/"),
            _ => rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len()).max(first.len_utf8()),
        };
        if first.is_alphanumeric() || "_()".contains(first) {
            words.push(rest[..length].to_lowercase());
        }
        rest = &rest[length..];
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_natural_join_that_finds_no_row_is_told_from_those_that_do() {
        for lossy in [
            "select * from runs natural join lambda_fits",
            "SELECT count(*) FROM Lambda_Fits AS f NATURAL LEFT JOIN \"runs\"",
            "select 1 from clog_events natural join runs r natural join speed_averages where 'it''s' = '('",
            "with a as (select 1 from speed_averages natural inner join lambda_fits) select * from a",
        ] {
            assert!(way_out(lossy).is_some_and(|text| text.contains("using (point_id)")), "{lossy}");
        }
        for sound in [
            "select * from runs natural join clog_events join lambda_fits using (point_id)",
            "select * from runs join lambda_fits using (point_id) -- not runs natural join lambda_fits",
            "select runs.r_end from samples natural join runs",
            "select * from (select point_id, r_end from runs) natural join lambda_fits",
            "select * from lambda_fits natural join (select point_id, r_end from runs)",
            "select 'runs natural join lambda_fits' from runs, lambda_fits",
            "select é /* runs */ from t natural",
        ] {
            assert_eq!(way_out(sound), None, "{sound}");
        }
    }
}
