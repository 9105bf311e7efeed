//! Rows as aligned tables for people. Pure text: units in the head, numbers right-aligned.

use std::fmt;

use super::Measurement;
use super::paper::{MEAN_RATIOS, PaperScene, scene_of};
use crate::bvh::ContainerKind;
use crate::bvh::stats::{INTERSECTION_COST, TRAVERSAL_COST};

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
        "bench" => bench_tables(rows),
        "scaling" => vec![scaling_table(rows)],
        _ => vec![list_table(command, rows)],
    }
}

/// How the rows were measured, in one sentence.
fn conditions(rows: &[Measurement]) -> String {
    let Some(row) = rows.first() else { return "nothing was measured".to_owned() };
    format!(
        "{}×{} primary rays, {} traversal, {} thread{}, medians of {}",
        row.width_px,
        row.height_px,
        row.traversal,
        row.threads,
        if row.threads == 1 { "" } else { "s" },
        row.repeat
    )
}

/// "2 % to 5 %": the widest spread of the builds and of the traces, as a share of their median.
fn spread(rows: &[Measurement]) -> String {
    let widest = |pairs: &mut dyn Iterator<Item = (f64, [f64; 2])>| {
        pairs
            .map(|(median, [low, high])| if median > 0.0 { (high - low) / median * 100.0 } else { 0.0 })
            .fold(0.0, f64::max)
    };
    format!(
        "Spread, slowest minus fastest over the median: builds up to {:.0} %, traces up to {:.0} %.",
        widest(&mut rows.iter().map(|row| (row.build_ms, row.build_ms_spread))),
        widest(&mut rows.iter().map(|row| (row.trace_ms, row.trace_ms_spread)))
    )
}

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

/// A model's name without its folders.
pub fn short(model: &str) -> String {
    if model.starts_with("builtin:") {
        return model.to_owned();
    }
    std::path::Path::new(model).file_name().map_or_else(|| model.to_owned(), |name| name.to_string_lossy().into_owned())
}

type Value = fn(&Measurement) -> f64;

fn bench_tables(rows: &[Measurement]) -> Vec<Table> {
    let times: [(&str, &str, Value); 2] = [("build", "ms", |row| row.build_ms), ("trace", "ms", |row| row.trace_ms)];
    let tests: [(&str, &str, Value); 3] = [
        ("containers", "/ray", |row| row.container_tests_per_ray),
        ("primitives", "/ray", |row| row.primitive_tests_per_ray),
        ("tests", "/ray", |row| row.tests_per_ray),
    ];
    let papers_times = |paper: &PaperScene| vec![Some(paper.build_ms), Some(paper.trace_ms)];
    let papers_tests = |paper: &PaperScene| vec![None, None, Some(paper.tests_per_ray)];
    let [build, trace, all] = MEAN_RATIOS;
    let mut tables = vec![
        pairs_table("Build and trace time", rows, &times, &papers_times, &[Some(build), Some(trace)]),
        pairs_table("Intersection tests per ray", rows, &tests, &papers_tests, &[None, None, Some(all)]),
    ];
    tables[0].notes.push(spread(rows));
    tables.push(quality_table(rows));
    tables
}

/// One line a model with box, sphere and their ratio for each value, the paper's figures below, means at the end.
fn pairs_table(
    title: &str,
    rows: &[Measurement],
    values: &[(&str, &str, Value)],
    papers: &dyn Fn(&PaperScene) -> Vec<Option<[f64; 2]>>,
    papers_means: &[Option<f64>],
) -> Table {
    let mut table = Table::new(format!("{title} ({})", conditions(rows)), &[("scene", ""), ("triangles", "")]);
    for (name, unit, _) in values {
        for kind in ContainerKind::ALL {
            table.columns.push((format!("{name} {}", kind.name()), (*unit).to_owned()));
        }
        table.columns.push(("ratio".to_owned(), "box:sph".to_owned()));
    }
    let mut ratios: Vec<Vec<f64>> = vec![Vec::new(); values.len()];
    let mut any_paper = false;
    for model in models(rows) {
        let of = |kind| rows.iter().find(|row| row.model == model && row.container == kind && row.builder != "none");
        let pair = [of(ContainerKind::Aabb), of(ContainerKind::Sphere)];
        let triangles = pair.iter().flatten().next().map_or_else(String::new, |row| row.triangles.to_string());
        let mut line = vec![short(model), triangles];
        for (index, (_, _, value)) in values.iter().enumerate() {
            let numbers = pair.map(|row| row.map(value));
            line.extend(numbers.iter().map(|number_| number_.map_or_else(String::new, number)));
            let ratio = match numbers {
                [Some(a), Some(b)] if b > 0.0 => Some(a / b),
                _ => None,
            };
            ratios[index].extend(ratio);
            line.push(ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}")));
        }
        table.rows.push(line);
        if let Some(paper) = scene_of(model) {
            any_paper = true;
            let mut line = vec![format!("  the paper's {}", paper.name), String::new()];
            for pair in papers(paper) {
                match pair {
                    Some([a, b]) => line.extend([format!("{a}"), format!("{b}"), format!("{:.2}", a / b)]),
                    None => line.extend([const { String::new() }; 3]),
                }
            }
            table.rows.push(line);
        }
    }
    let mean = |label: &str, means: &mut dyn Iterator<Item = Option<f64>>| {
        let mut line = vec![label.to_owned(), String::new()];
        for mean in means {
            line.extend([String::new(), String::new(), mean.map_or_else(String::new, |mean| format!("{mean:.2}"))]);
        }
        line
    };
    if ratios.iter().any(|ratios| !ratios.is_empty()) {
        let mut means =
            ratios.iter().map(|list| (!list.is_empty()).then(|| list.iter().sum::<f64>() / list.len() as f64));
        table.rows.push(mean("mean of the ratios", &mut means));
        if any_paper {
            table.rows.push(mean("  the paper's mean", &mut papers_means.iter().copied()));
        }
    }
    table
}

/// What the trees look like, and the row without any.
fn quality_table(rows: &[Measurement]) -> Table {
    let mut table = Table { title: "The trees".to_owned(), ..list_table("bench", rows) };
    for row in rows.iter().filter(|row| row.builder == "none") {
        let pixels = u64::from(row.width_px) * u64::from(row.height_px);
        table.notes.push(format!(
            "{} without BVH: {} of {pixels} pixels, evenly spread, in {} ms; {} tests a ray.",
            short(&row.model),
            row.rays,
            number(row.trace_ms),
            number(row.tests_per_ray)
        ));
    }
    table
}

/// One line a row.
fn list_table(command: &str, rows: &[Measurement]) -> Table {
    let mut table = Table::new(
        format!("{} ({})", if command == "compare" { "Builders" } else { "Sweep" }, conditions(rows)),
        &[
            ("scene", ""),
            ("builder", ""),
            ("container", ""),
            ("δ", ""),
            ("ε", ""),
            ("build", "ms"),
            ("trace", "ms"),
            ("speed", "Mray/s"),
            ("containers", "/ray"),
            ("primitives", "/ray"),
            ("tests", "/ray"),
            ("SAH cost", ""),
            ("EPO", ""),
            ("nodes", ""),
            ("leaves", ""),
            ("depth", ""),
            ("memory", "B/tri"),
            ("hits", ""),
        ],
    );
    for row in rows {
        let aac = row.builder == "aac";
        table.rows.push(vec![
            short(&row.model),
            row.preset.clone().unwrap_or_else(|| row.builder.clone()),
            row.container.name().to_owned(),
            if aac { row.threshold.to_string() } else { "–".to_owned() },
            if aac { row.epsilon.to_string() } else { "–".to_owned() },
            number(row.build_ms),
            number(row.trace_ms),
            number(row.mrays_per_s),
            number(row.container_tests_per_ray),
            number(row.primitive_tests_per_ray),
            number(row.tests_per_ray),
            number(row.sah_cost),
            number(row.epo),
            row.nodes.to_string(),
            row.leaves.to_string(),
            row.max_depth.to_string(),
            format!("{:.0}", row.bytes_per_triangle),
            row.hits.to_string(),
        ]);
    }
    table.notes.push(costs());
    if command != "bench" {
        table.notes.push(spread(rows));
    }
    table
}

fn scaling_table(rows: &[Measurement]) -> Table {
    let mut table = Table::new(
        format!(
            "Speed-up over one thread ({})",
            rows.first().map_or_else(String::new, |row| {
                format!(
                    "{}×{} primary rays, {} traversal, medians of {}",
                    row.width_px, row.height_px, row.traversal, row.repeat
                )
            })
        ),
        &[
            ("scene", ""),
            ("container", ""),
            ("threads", ""),
            ("build", "ms"),
            ("speed-up", "×"),
            ("efficiency", "%"),
            ("trace", "ms"),
            ("speed-up", "×"),
            ("efficiency", "%"),
        ],
    );
    for row in rows {
        let parts = |speedup: Option<f64>| match speedup {
            Some(speedup) => [format!("{speedup:.2}"), format!("{:.0}", speedup / row.threads.max(1) as f64 * 100.0)],
            None => ["–".to_owned(), "–".to_owned()],
        };
        let mut line =
            vec![short(&row.model), row.container.name().to_owned(), row.threads.to_string(), number(row.build_ms)];
        line.extend(parts(row.speedup));
        line.push(number(row.trace_ms));
        line.extend(parts(row.trace_speedup));
        table.rows.push(line);
    }
    table.notes.push(spread(rows));
    table
}
