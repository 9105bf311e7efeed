//! Rows as aligned tables for people. Pure text: units in the head, numbers right-aligned.

mod lists;
mod pairs;

use std::fmt;

use super::Measurement;
use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// A table with a title line, a head of one or two lines and notes below.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// Name and unit of each column; the first is left-aligned.
    pub columns: Vec<(String, String)>,
    /// One text a column; missing ones are empty.
    pub rows: Vec<Vec<String>>,
    /// What must be known to read it.
    pub notes: Vec<String>,
}

impl Table {
    fn new(title: impl Into<String>, columns: &[(&str, &str)]) -> Self {
        let columns = columns.iter().map(|(name, unit)| ((*name).to_owned(), (*unit).to_owned())).collect();
        Self { title: title.into(), columns, ..Self::default() }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |index: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(index)).map(|cell| cell.chars().count());
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
        for row in &self.rows {
            line(&mut row.iter().map(String::as_str))?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        Ok(())
    }
}

/// A number with about four digits: 0.123, 12.34, 123.4, 12 345.
pub fn number(value: f64) -> String {
    match value.abs() {
        size if size < 10.0 => format!("{value:.3}"),
        size if size < 100.0 => format!("{value:.2}"),
        size if size < 1000.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Rows of one command: the tables that it prints.
pub fn tables(command: &str, rows: &[Measurement]) -> Vec<Table> {
    match command {
        "bench" => pairs::bench_tables(rows),
        "scaling" => vec![lists::scaling_table(rows)],
        "compare" => vec![lists::list_table("Builders", rows)],
        _ => vec![lists::list_table("Sweep", rows)],
    }
}

/// One row in a sentence, for those who wait for the table.
pub fn summary(row: &Measurement) -> String {
    let tree = match row.builder.as_str() {
        "aac" => {
            let curve = if row.curve == Curve::Morton { String::new() } else { format!(", {}", row.curve.name()) };
            let passes = if row.optimize == Passes::NONE { String::new() } else { format!(", {}", row.optimize) };
            format!("{}, δ {}, ε {}{curve}{passes}", row.container.name(), row.threshold, row.epsilon)
        }
        "none" => "without BVH".to_owned(),
        builder => format!("{}, {builder}", row.container.name()),
    };
    format!(
        "{}, {tree}, {}: build {} ms, trace {} ms, {} tests per ray",
        short(&row.model),
        threads(row.threads),
        number(row.build_ms),
        number(row.trace_ms),
        number(row.tests_per_ray)
    )
}

fn threads(count: usize) -> String {
    format!("{count} {}", if count == 1 { "thread" } else { "threads" })
}

/// How the rows were traced and how often, in one sentence.
fn conditions(rows: &[Measurement]) -> String {
    let Some(row) = rows.first() else { return "nothing was measured".to_owned() };
    let repeats = || rows.iter().filter(|row| row.builder != "none").map(|row| row.repeat);
    let (fewest, most) = (repeats().min().unwrap_or(1), repeats().max().unwrap_or(1));
    let medians = match (fewest, most) {
        (1, 1) => "measured once".to_owned(),
        _ if fewest == most => format!("medians of {most}"),
        _ => format!("medians of {fewest} to {most}"),
    };
    format!("{}×{} primary rays, {} traversal, {medians}", row.width_px, row.height_px, row.traversal)
}

/// The same with the number of threads, where all rows have the same.
fn conditions_and_threads(rows: &[Measurement]) -> String {
    let same = rows.first().filter(|first| rows.iter().all(|row| row.threads == first.threads));
    match same {
        Some(row) => format!("{}, {}", conditions(rows), threads(row.threads)),
        None => conditions(rows),
    }
}

/// Slowest minus fastest as a share of the median, in percent.
fn spread(median: f64, [fastest, slowest]: [f64; 2]) -> String {
    let percent = if median > 0.0 { (slowest - fastest) / median * 100.0 } else { 0.0 };
    format!("{percent:.0}")
}

const SPREAD: &str = "Spread: slowest minus fastest repetition, over the median.";

fn costs() -> String {
    format!("SAH cost with container test {TRAVERSAL_COST}, primitive test {INTERSECTION_COST}, over the root's area.")
}

/// Models in order of first appearance.
pub fn models(rows: &[Measurement]) -> Vec<&str> {
    let mut models: Vec<&str> = Vec::new();
    for row in rows {
        if !models.contains(&row.model.as_str()) {
            models.push(&row.model);
        }
    }
    models
}

/// What a model is called among `models`: its file's name, with the folder where another one has the same name.
pub fn name_among(model: &str, models: &[&str]) -> String {
    let name = short(model);
    let shared = models.iter().any(|other| *other != model && short(other) == name);
    let folder = std::path::Path::new(model).parent().and_then(|folder| folder.file_name());
    match folder.filter(|_| shared) {
        Some(folder) => format!("{}/{name}", folder.to_string_lossy()),
        None => name,
    }
}

/// A model's name without its folders.
pub fn short(model: &str) -> String {
    if model.starts_with("builtin:") {
        return model.to_owned();
    }
    std::path::Path::new(model).file_name().map_or_else(|| model.to_owned(), |name| name.to_string_lossy().into_owned())
}

type Value = fn(&Measurement) -> f64;
