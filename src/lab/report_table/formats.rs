//! Tables for papers and notes: Markdown and LaTeX.

use super::aligned::ReportTable;

/// How tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TableFormat {
    /// Aligned with spaces.
    #[default]
    Text,
    /// A table of GitHub's Markdown.
    Markdown,
    /// A `tabular` between the rules of the package booktabs.
    Latex,
}

impl TableFormat {
    /// All, in the order of lists.
    pub const ALL: [Self; 3] = [Self::Text, Self::Markdown, Self::Latex];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Markdown => "markdown",
            Self::Latex => "latex",
        }
    }
}

impl ReportTable {
    /// The table without columns that have no value in any row, in a format.
    pub fn written(&self, format: TableFormat) -> String {
        let table = self.without_empty_columns();
        match format {
            TableFormat::Text => table.to_string(),
            TableFormat::Markdown => table.markdown(),
            TableFormat::Latex => table.latex(),
        }
    }

    fn without_empty_columns(&self) -> Self {
        let is_empty = |cell: Option<&String>| cell.is_none_or(|cell| matches!(cell.trim(), "" | "–"));
        let kept: Vec<usize> = (0..self.columns.len())
            .filter(|&column| self.rows.is_empty() || !self.rows.iter().all(|row| is_empty(row.get(column))))
            .collect();
        let cells = |row: &Vec<String>| kept.iter().filter_map(|&column| row.get(column).cloned()).collect();
        Self {
            columns: kept.iter().map(|&column| self.columns[column].clone()).collect(),
            rows: self.rows.iter().map(cells).collect(),
            better: kept.iter().map(|&column| self.better.get(column).copied().flatten()).collect(),
            ..self.clone()
        }
    }

    /// The names of the columns with their units.
    fn heads(&self) -> impl Iterator<Item = String> {
        self.columns.iter().map(|(name, unit)| format!("{name} {unit}").trim().to_owned())
    }

    fn markdown(&self) -> String {
        let escaped = |text: &str| text.trim().replace('|', "\\|");
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = if self.title.is_empty() { String::new() } else { format!("**{}**\n\n", self.title) };
        text += &line(self.heads().map(|head| escaped(&head)).collect());
        text += &line((0..self.columns.len()).map(|at| if at == 0 { "---" } else { "---:" }.to_owned()).collect());
        for row in &self.rows {
            text += &line(row.iter().map(|cell| escaped(cell)).collect());
        }
        text.extend(self.notes.iter().flat_map(|note| ["\n", note, "\n"]));
        text
    }

    fn latex(&self) -> String {
        let line = |cells: Vec<String>| format!("{} \\\\\n", cells.join(" & "));
        let mut text =
            format!("% {}\n\\begin{{tabular}}{{l{}}}\n\\toprule\n", self.title, "r".repeat(self.columns.len() - 1));
        text += &line(self.heads().map(|head| in_latex(&head)).collect());
        text += "\\midrule\n";
        for row in &self.rows {
            text += &line(row.iter().map(|cell| in_latex(cell.trim())).collect());
        }
        text += "\\bottomrule\n\\end{tabular}\n";
        text.extend(self.notes.iter().flat_map(|note| ["% ", note, "\n"]));
        text
    }
}

/// Text for LaTeX, whose special characters are escaped.
fn in_latex(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', character]),
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            'δ' => escaped += "$\\delta$",
            'ε' => escaped += "$\\varepsilon$",
            'α' => escaped += "$\\alpha$",
            '×' => escaped += "$\\times$",
            '÷' => escaped += "$\\div$",
            '±' => escaped += "$\\pm$",
            '–' => escaped += "--",
            '…' => escaped += "\\ldots{}",
            'µ' => escaped += "$\\mu$",
            '²' => escaped += "$^2$",
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ReportTable {
        let rows =
            vec![vec!["a|b_1".to_owned(), " 2.5".to_owned(), "–".to_owned()], vec!["c".to_owned(), "10 %".to_owned()]];
        let notes = vec!["Lower is better.".to_owned()];
        ReportTable { rows, notes, ..ReportTable::new("Costs", &[("builder", ""), ("δ", "ms"), ("sphere", "ms")]) }
    }

    #[test]
    fn markdown_has_a_head_and_escapes_bars() {
        let expected =
            "**Costs**\n\n| builder | δ ms |\n| --- | ---: |\n| a\\|b_1 | 2.5 |\n| c | 10 % |\n\nLower is better.\n";
        assert_eq!(table().written(TableFormat::Markdown), expected);
    }

    #[test]
    fn latex_escapes_what_it_would_read_as_commands() {
        let text = table().written(TableFormat::Latex);
        assert!(text.contains("\\begin{tabular}{lr}\n\\toprule\nbuilder & $\\delta$ ms \\\\\n"), "{text}");
        assert!(text.contains("a|b\\_1 & 2.5 \\\\\nc & 10 \\% \\\\\n"), "{text}");
    }

    #[test]
    fn columns_without_values_are_left_out() {
        assert!(!table().written(TableFormat::Text).contains("sphere"));
    }
}
