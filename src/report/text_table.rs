//! A table as text: for a terminal, or for a Markdown page.

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
}

impl TextTable {
    /// For a terminal.
    pub(super) fn text(&self) -> String {
        let mut table = Table::new();
        table.load_preset(LINES).set_header(&self.headers).add_rows(&self.rows);
        for column in table.column_iter_mut().skip(self.names) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        format!("{}\n{table}\n", self.title)
    }

    /// For a Markdown page; all columns are aligned to the right.
    pub(super) fn markdown(&self) -> String {
        let row = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('*', "\\*").replace('<', "&lt;"));
        let rule = format!("|{}\n", "---:|".repeat(self.headers.len()));
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("**{}**\n\n{}{rule}{rows}\n", self.title, row(&self.headers))
    }
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
        let table = TextTable { title: "T".to_owned(), headers: owned(["", "<v_g>"]), rows, names: 0 };
        assert_eq!(table.markdown(), "**T**\n\n|  | &lt;v_g> |\n|---:|---:|\n| \\* | 1 |\n\n");
        let lines = ["T", "───────────", "     <v_g> ", "───────────", " *       1 ", "───────────", ""];
        assert_eq!(table.text(), lines.join("\n"));
    }
}
