//! A table as text: for a terminal, or for a Markdown page.
//!
//! A table wider than the terminal stands in parts, one below the other. Each part repeats the columns that tell rows
//! apart.

use comfy_table::{CellAlignment, Table};

/// Stands in a cell that has no answer.
pub(super) const NOTHING: &str = "-";

/// Lines above and below the table and under its head, none between rows or columns.
const LINES: &str = "  ── ──      ──    ";

/// A table of texts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TextTable {
    /// The line above it.
    pub title: String,
    /// Names of the columns.
    pub headers: Vec<String>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// How many columns, from the left, hold names; the others hold numbers and are aligned to the right.
    pub names: usize,
    /// How many columns, from the left, tell rows apart.
    pub keys: usize,
}

/// Columns of the terminal that stdout goes to; `None` if it goes elsewhere, where lines may have any length.
pub(crate) fn terminal_width() -> Option<usize> {
    terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0))
}

impl TextTable {
    /// For a terminal.
    pub(super) fn text(&self) -> String {
        self.text_within(terminal_width().unwrap_or(usize::MAX))
    }

    /// In lines of at most `width` characters, if the columns that tell rows apart and one more are no wider.
    fn text_within(&self, width: usize) -> String {
        let parts: String = self.parts(width).iter().map(|columns| self.part(columns)).collect();
        format!("{}\n{parts}", self.title)
    }

    /// The columns of each part of the table.
    fn parts(&self, width: usize) -> Vec<Vec<usize>> {
        // A column has a blank on either side, and one stands between two.
        let letters = |column: usize| {
            let cells = std::iter::once(&self.headers).chain(&self.rows).filter_map(|row| row.get(column));
            3 + cells.map(|cell| cell.chars().count()).max().unwrap_or_default()
        };
        let keys: Vec<usize> = (0..self.keys).collect();
        let room = width.saturating_add(1).saturating_sub(keys.iter().map(|&key| letters(key)).sum());
        let (mut parts, mut left): (Vec<Vec<usize>>, usize) = (Vec::new(), 0);
        for column in self.keys..self.headers.len() {
            let letters = letters(column);
            match parts.last_mut() {
                Some(part) if letters <= left => part.push(column),
                _ => {
                    parts.push(keys.iter().copied().chain([column]).collect());
                    left = room;
                }
            }
            left = left.saturating_sub(letters);
        }
        if parts.is_empty() { vec![keys] } else { parts }
    }

    fn part(&self, columns: &[usize]) -> String {
        let cells =
            |row: &Vec<String>| columns.iter().filter_map(|&column| row.get(column).cloned()).collect::<Vec<_>>();
        let mut table = Table::new();
        table.load_preset(LINES).set_header(cells(&self.headers)).add_rows(self.rows.iter().map(cells));
        for (column, &origin) in table.column_iter_mut().zip(columns) {
            if origin >= self.names {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        format!("{table}\n")
    }

    /// For a Markdown page; all columns are aligned to the right.
    pub(super) fn markdown(&self) -> String {
        let row = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('*', "\\*").replace('<', "&lt;"));
        let rule = format!("|{}\n", "---:|".repeat(self.headers.len()));
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("**{}**\n\n{}{rule}{rows}\n", self.title, row(&self.headers))
    }
}

/// The lines of a text, those that are wider than the terminal broken at blanks; what follows a break is set in by so
/// many columns.
pub(crate) fn hanging(text: &str, indent: usize) -> String {
    terminal_width().map_or_else(|| text.to_owned(), |width| hanging_within(text, indent, width.max(2 * indent)))
}

fn hanging_within(text: &str, indent: usize, width: usize) -> String {
    let mut broken = String::new();
    for line in text.lines() {
        let mut length = 0;
        for (place, word) in line.split(' ').enumerate() {
            let letters = word.chars().count();
            match place > 0 && length > indent && length + 1 + letters > width {
                true => {
                    broken.push('\n');
                    broken.extend(std::iter::repeat_n(' ', indent));
                    length = indent;
                }
                false if place > 0 => {
                    broken.push(' ');
                    length += 1;
                }
                false => {}
            }
            broken += word;
            length += letters;
        }
        broken.push('\n');
    }
    broken
}

/// The texts, owned.
pub(super) fn owned<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(str::to_owned).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_shows_stars_and_angles_as_they_are() {
        let rows = vec![owned(["*", "1"])];
        let table = TextTable { title: "T".to_owned(), headers: owned(["", "<v_g>"]), rows, names: 0, keys: 1 };
        assert_eq!(table.markdown(), "**T**\n\n|  | &lt;v_g> |\n|---:|---:|\n| \\* | 1 |\n\n");
        let lines = ["T", "───────────", "     <v_g> ", "───────────", " *       1 ", "───────────", ""];
        assert_eq!(table.text_within(80), lines.join("\n"));
    }

    #[test]
    fn a_long_line_is_broken_at_blanks_and_set_in() {
        let text = "name\n  on       gravity (drives along +x), contact (e_w = 1)\n";
        let broken = "name\n  on       gravity (drives\n           along +x), contact\n           (e_w = 1)\n";
        assert_eq!(hanging_within(text, 11, 30), broken);
        assert_eq!(hanging_within(text, 11, 80), text);
    }

    #[test]
    fn a_table_that_is_too_wide_stands_in_parts_that_repeat_what_tells_its_rows_apart() {
        let headers = owned(["gamma", "runs", "lambda [95%]", "least sq."]);
        let rows = vec![owned(["0.5", "10", "24.9 [19.1, 33.3]", "24"]), owned(["1.09", "10", "> 133", "-"])];
        let table = TextTable { title: "T".to_owned(), headers, rows, names: 0, keys: 1 };
        let wide = table.text_within(46);
        assert_eq!(wide.lines().count(), 1 + 6, "{wide}");
        assert_eq!(table.text_within(usize::MAX), wide, "elsewhere than on a terminal");
        for width in [45, 30, 27] {
            let text = table.text_within(width);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}: {text}");
            assert_eq!(text.matches("1.09").count(), text.matches("gamma").count());
            assert!(text.matches("gamma").count() > 1 && text.matches("24.9 [19.1, 33.3]").count() == 1, "{text}");
        }
    }
}
