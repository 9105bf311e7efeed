//! A table as aligned text: units in the head, numbers right-aligned.

use std::borrow::Cow;
use std::fmt;

use crate::catalog::numbers::Direction;
use crate::text::cut;

/// Most characters of a cell; longer ones are cut.
const MAX_CELL: usize = 60;

/// A table with a title line, a head of one or two lines, and notes below.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportTable {
    /// The title.
    pub title: String,
    /// Name and unit of each column; the first is left-aligned.
    pub columns: Vec<(String, String)>,
    /// The cells of each row; missing ones are empty.
    pub rows: Vec<Vec<String>>,
    /// Notes on how to read the table.
    pub notes: Vec<String>,
    /// For each column, where the better numbers are; missing ones have none.
    pub better: Vec<Option<Direction>>,
    /// Indices of the columns whose best number is no better than another for certain.
    pub undecided: Vec<usize>,
    /// For each row the index of its measurement, where each row is of one.
    pub sources: Vec<usize>,
}

impl ReportTable {
    pub(super) fn new(title: impl Into<String>, columns: &[(&str, &str)]) -> Self {
        let columns = columns.iter().map(|(name, unit)| ((*name).to_owned(), (*unit).to_owned())).collect();
        Self { title: title.into(), columns, ..Self::default() }
    }
}

impl ReportTable {
    /// The head and the rows for spreadsheets: cells between tabs, without title and notes.
    pub fn tab_separated(&self) -> String {
        let head = self.columns.iter().map(|(name, unit)| format!("{name} {unit}").trim_end().to_owned()).collect();
        let lines = std::iter::once(&head).chain(&self.rows);
        lines
            .map(|cells: &Vec<String>| cells.iter().map(|cell| cell.trim()).collect::<Vec<_>>().join("\t") + "\n")
            .collect()
    }
}

impl fmt::Display for ReportTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows: Vec<Vec<Cow<'_, str>>> =
            self.rows.iter().map(|row| row.iter().map(|cell| cut(cell, MAX_CELL)).collect()).collect();
        let width = |index: usize| {
            let cells = rows.iter().filter_map(|row| row.get(index)).map(|cell| cell.chars().count());
            let (name, unit) = &self.columns[index];
            cells.chain([name.chars().count(), unit.chars().count()]).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        if !self.title.is_empty() {
            writeln!(f, "{}", self.title)?;
        }
        let mut line = |cells: &mut dyn Iterator<Item = &str>| -> fmt::Result {
            let mut text = String::new();
            for (index, (cell, width)) in cells.zip(&widths).enumerate() {
                let cell = if index == 0 { format!("{cell:<width$}") } else { format!("  {cell:>width$}") };
                text.push_str(&cell);
            }
            writeln!(f, "{}", text.trim_end())
        };
        let has_units = self.columns.iter().any(|(_, unit)| !unit.is_empty());
        line(&mut self.columns.iter().map(|(name, _)| name.as_str()))?;
        if has_units {
            line(&mut self.columns.iter().map(|(_, unit)| unit.as_str()))?;
        }
        for row in &rows {
            line(&mut row.iter().map(AsRef::as_ref))?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_cells_are_cut() {
        let rows = vec![vec!["n".repeat(70_000), "1".to_owned()], vec!["short".to_owned()]];
        let table = ReportTable { rows, ..ReportTable::new("", &[("builder", ""), ("value", "")]) };
        let text = table.to_string();
        assert!(text.lines().all(|line| line.chars().count() <= MAX_CELL + 7), "{text}");
        assert!(text.contains("n…") && text.contains("short"), "{text}");
    }
}
