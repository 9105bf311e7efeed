//! Tables with one line per measurement: sweeps, builders, threads.

use std::collections::HashSet;

use super::aligned::ReportTable;
use super::format::{
    INTERVALS, TESTS, TRACE, conditions, conditions_and_threads, costs, name_among, number, setting, spread,
    spread_note,
};
use crate::catalog::numbers::rows::{
    BUILD_MS, EPO_MARGIN, MRAYS_PER_S, SPEEDUP, TRACE_MS, TRACE_SPEEDUP, WIDE_TRACE_MS,
};
use crate::catalog::numbers::{Direction, NUMBERS, Number};
use crate::catalog::settings::{Setting, parameters};
use crate::lab::measurement::{Measurement, ModelView, model_views};
use crate::lab::verdict::{Order, Verdict, base_of, has_fastest, judge_rows, sort_by_speed};
use crate::text::counted;

/// Note of the column "ready".
const READY: &str = "Ready: until rays can be traced at full speed, the binary tree and the wide one made from it.";

/// Note of the forms of a scene of copies.
const FORMS: &str = "Forms of the scene: those of the preset Fast beside the form of all other rows. Trees: what rays read, wide trees of all \
    levels and places of copies. SAH cost, nodes, depth and memory of two levels are those of the tree over the copies, a copy being a \
    primitive of it; a tree over parts of copies has none, and no binary tree.";

/// Note of the column "reads".
const READS: &str =
    "Reads: cache lines of the wide tree that a ray that enters the scene's box touches, 64 bytes each.";

/// Times, tests, costs and sizes of each tree.
pub(super) fn list_table(title: &str, rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable::new(
        format!("{title} ({})", conditions_and_threads(rows)),
        &[("scene", ""), ("builder", ""), ("container", "")],
    );
    table.columns.extend(symbols().map(|(_, symbol)| (symbol.to_owned(), String::new())));
    table.better.resize(table.columns.len(), None);
    let kinds: HashSet<_> = rows.iter().map(|row| row.container).collect();
    for (number, (name, unit)) in columns() {
        table.columns.push((name.to_owned(), unit.to_owned()));
        let compared = number.compared.filter(|compared| compared.across_containers || kinds.len() == 1);
        if !has_best(number, rows) {
            table.undecided.push(table.better.len());
        }
        table.better.push(compared.and_then(|compared| compared.better));
        table.columns.extend(number.spread.map(|_| ("spread".to_owned(), "%".to_owned())));
        table.better.resize(table.columns.len(), None);
    }
    let models = model_views(rows);
    for row in rows {
        let mut line = vec![name_among(row.view(), &models), row.name(), row.container.name().to_owned()];
        line.extend(symbols().map(|(parameter, _)| setting(row, parameter)));
        for (number, _) in columns() {
            line.push(number.digits.text(row.number(number)));
            line.extend(number.spread.map(|_| spread(row, number)));
        }
        table.rows.push(line);
    }
    table.sources = (0..rows.len()).collect();
    table.notes.extend([READY, TRACE, TESTS, READS].map(str::to_owned));
    table.notes.push(costs(rows));
    table.notes.push(overlap_basis(rows));
    table.notes.push(spread_note(rows));
    table
}

/// The trees of each scene and kind of container, the faster before the slower as far as that is decided, with a column for their speed
/// over that of the preset Fast, or else of the first that was measured.
pub(super) fn comparison_table(rows: &[Measurement]) -> ReportTable {
    let is_like =
        |row: &Measurement, other: &Measurement| row.view() == other.view() && row.container == other.container;
    let mut groups: Vec<Vec<(usize, &Measurement)>> = Vec::new();
    for row in rows.iter().enumerate() {
        match groups.iter_mut().find(|group| is_like(group[0].1, row.1)) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    let (mut relative, mut notes) = (Vec::new(), Vec::new());
    for group in &mut groups {
        let Some(base) = base_of(group.iter().map(|(_, row)| *row)) else { continue };
        sort_by_speed(group, |(_, row)| row);
        relative.extend(group.iter().map(|(_, row)| relative_speed(base, row)));
        notes.push(best_of(group, base, &model_views(rows)));
    }
    let (sources, sorted): (Vec<usize>, Vec<Measurement>) =
        groups.into_iter().flatten().map(|(index, row)| (index, row.clone())).unzip();
    let mut table = list_table("Builders, the faster to trace before the slower, as far as that is decided", &sorted);
    table.sources = sources;
    if sorted.iter().any(|row| row.form.is_some()) {
        table.columns.push(("trees".to_owned(), "MB".to_owned()));
        table.better.push(Some(Direction::Less));
        for (line, row) in table.rows.iter_mut().zip(&sorted) {
            line.push(row.form.map_or_else(|| "–".to_owned(), |form| number(form.traced_bytes as f64 / 1e6)));
        }
        notes.push(FORMS.to_owned());
    }
    table.columns.push(("relative".to_owned(), "speed".to_owned()));
    table.undecided.extend((!has_best(MRAYS_PER_S, rows)).then_some(table.better.len()));
    table.better.push(Some(Direction::More));
    for (line, relative) in table.rows.iter_mut().zip(relative) {
        line.push(relative);
    }
    notes.push(format!("Relative speed: in brackets where it is not decided. {INTERVALS}"));
    table.notes.splice(0..0, notes);
    table
}

/// The median factor of the speeds of a tree and its base: "1.31", "(1.02)" where it is not decided, "the same tree".
fn relative_speed(base: &Measurement, row: &Measurement) -> String {
    let (verdict, factor) = judge_rows(MRAYS_PER_S, base, row);
    if row == base {
        return "1.00".to_owned();
    }
    match (verdict, factor) {
        (Verdict::Same, _) => "the same tree".to_owned(),
        (Verdict::Better | Verdict::Worse, Some(factor)) => format!("{:.2}", factor.median),
        (_, Some(factor)) if factor.median.is_finite() => format!("({:.2})", factor.median),
        _ => {
            let once = row.number(MRAYS_PER_S) / base.number(MRAYS_PER_S);
            if once.is_finite() { format!("({once:.2})") } else { "–".to_owned() }
        }
    }
}

/// "teapot, box: best is the fastest to trace, 1.31 times as fast as fast (1.28 to 1.33 over 9 rounds), which all are relative to"; and which
/// others are not decidedly slower. `group` is sorted by speed.
fn best_of(group: &[(usize, &Measurement)], base: &Measurement, models: &[ModelView<'_>]) -> String {
    let best = group[0].1;
    let which = format!("{}, {}", name_among(best.view(), models), best.container.name());
    let (name, of) = (best.name(), base.name());
    let is_slower = |row: &Measurement| judge_rows(MRAYS_PER_S, best, row).0 == Verdict::Worse;
    let rivals: Vec<&Measurement> = group[1..].iter().map(|(_, row)| *row).filter(|row| !is_slower(row)).collect();
    let (verdict, factor) = judge_rows(MRAYS_PER_S, base, best);
    let interval = factor.and_then(|factor| Some((factor, factor.interval?)));
    let against = match interval.filter(|_| verdict == Verdict::Better) {
        Some((factor, [least, most])) => format!(
            ", {:.2} times as fast as {of} ({least:.2} to {most:.2} over {}), which all are relative to",
            factor.median,
            counted(factor.count as u64, "rounds")
        ),
        None => format!("; all are relative to {of}"),
    };
    if rivals.is_empty() && group.len() > 1 {
        return format!("{which}: {name} is the fastest to trace{against}.");
    }
    let names: Vec<String> = rivals.iter().map(|row| row.name()).collect();
    if names.is_empty() {
        return format!("{which}: {name} alone was measured.");
    }
    format!("{which}: the fastest to trace is not decided between {name}, {}{against}.", names.join(", "))
}

/// Whether the best value of a number among `rows` is better than the others for certain, as each count is.
fn has_best(number: &Number, rows: &[Measurement]) -> bool {
    let timed = if number == MRAYS_PER_S { WIDE_TRACE_MS } else { number };
    let times: Vec<&[f64]> = rows.iter().map(|row| row.rounds_of(timed)).collect();
    times.iter().all(|rounds| rounds.is_empty()) || has_fastest(&times, Order::InTurn)
}

/// The numbers that have a column, each with its head.
fn columns() -> impl Iterator<Item = (&'static Number, (&'static str, &'static str))> {
    NUMBERS.iter().filter_map(|number| Some((number, number.column?)))
}

/// The settings that have a column, each under its symbol.
fn symbols() -> impl Iterator<Item = (&'static Setting, &'static str)> {
    parameters().filter_map(|row| Some((row, row.symbol()?)))
}

/// The meaning of EPO, and the widest interval where any is an estimate.
fn overlap_basis(rows: &[Measurement]) -> String {
    let margins = rows.iter().filter_map(|row| row.values.known(EPO_MARGIN));
    let estimate = margins.max_by(f64::total_cmp).map_or_else(String::new, |margin| {
        format!(", estimated with 95 % confidence within ±{} or less", number(margin))
    });
    format!("EPO: end-point overlap (Aila, Karras and Laine 2013), surface inside nodes that do not hold it{estimate}.")
}

/// Speed-up and parallel efficiency of building and tracing.
pub(super) fn scaling_table(rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable::new(
        format!("Speed-up over one thread ({})", conditions(rows)),
        &[
            ("scene", ""),
            ("container", ""),
            ("threads", ""),
            ("build", "ms"),
            ("spread", "%"),
            ("speed-up", "×"),
            ("efficiency", "%"),
            ("trace", "ms"),
            ("spread", "%"),
            ("speed-up", "×"),
            ("efficiency", "%"),
        ],
    );
    let models = model_views(rows);
    for row in rows {
        let parts = |speedup: Option<f64>| match speedup {
            Some(speedup) => [format!("{speedup:.2}"), format!("{:.0}", speedup / row.threads.max(1) as f64 * 100.0)],
            None => ["–".to_owned(), "–".to_owned()],
        };
        let mut line = vec![name_among(row.view(), &models), row.container.name().to_owned(), row.threads.to_string()];
        for (time, speedup) in [(BUILD_MS, SPEEDUP), (TRACE_MS, TRACE_SPEEDUP)] {
            line.extend([number(row.number(time)), spread(row, time)]);
            line.extend(parts(row.values.known(speedup)));
        }
        table.rows.push(line);
    }
    table.notes.push(spread_note(rows));
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::TREE_HASH;
    use crate::catalog::settings::{CURVE, OPTIMIZE, Stated};
    use crate::lab::sample::sample;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};

    /// Each cell with the name and unit of its column.
    fn cells(table: &ReportTable, row: usize) -> Vec<String> {
        let cells = table.columns.iter().zip(&table.rows[row]);
        cells.map(|((name, unit), cell)| format!("{name} {unit}: {cell}").replace(" :", ":")).collect()
    }

    #[test]
    fn a_list_shows_each_column_of_its_row() {
        let lbvh = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
        let settings = Stated::of(&lbvh).with(&CURVE, "hilbert").with(&OPTIMIZE, "collapse");
        let other = Measurement { builder: "lbvh".to_owned(), settings, preset: None, threads: 4, ..sample() };
        let table = list_table("Sweep", &[sample()]);
        assert_eq!(
            table.title,
            "Sweep (101×103 primary rays, camera front, ordered traversal, medians of 5, 3 threads)"
        );
        let expected = [
            "scene: thing.obj",
            "builder: aac + hilbert + collapse",
            "container: box",
            "δ: 11",
            "ε: 0.25",
            "binary tree ms: 20.00",
            // From 17 to 23 ms.
            "spread %: 30",
            "ready ms: 23.75",
            "binary trace ms: 50.00",
            // From 47 to 61 ms.
            "spread %: 28",
            "speed Mray/s: 2.312",
            // From 2 to 2.5.
            "spread %: 22",
            "containers tests/ray: 26.25",
            "primitives tests/ray: 3.250",
            "all tests/ray: 29.50",
            "entering tests/ray: 41.50",
            "reads B/ray: 1472",
            "SAH cost: 67.30",
            "EPO: 0.875",
            "nodes: 14,001",
            "leaves: 7,013",
            "depth: 31",
            "memory B/tri: 98",
            "hits: 5,003",
        ];
        assert_eq!(cells(&table, 0), expected);
        assert_eq!(
            table.notes[5],
            "EPO: end-point overlap (Aila, Karras and Laine 2013), surface inside nodes that do not hold it, estimated with 95 % \
             confidence within ±0.031 or less."
        );
        let table = list_table("Sweep", &[sample(), other]);
        assert_eq!(
            table.title, "Sweep (101×103 primary rays, camera front, ordered traversal, medians of 5)",
            "threads differ"
        );
        let read = Measurement {
            tree: Some("x.bvh".to_owned()),
            settings: Stated::default(),
            preset: None,
            ..sample().with(BUILD_MS, f64::NAN)
        };
        let of_file = list_table("", &[read]);
        assert_eq!(
            cells(&of_file, 0)[1..7],
            ["builder: x.bvh (aac)", "container: box", "δ: –", "ε: –", "binary tree ms: –", "spread %: –"]
        );
        assert_eq!(cells(&table, 1)[1..5], ["builder: lbvh + hilbert + collapse", "container: box", "δ: –", "ε: –"]);
    }

    #[test]
    fn compared_builders_come_by_speed_relative_to_the_fast_preset() {
        let row = |preset: &str, speed: f64| {
            let (command, preset) = ("compare".to_owned(), preset.to_owned());
            let mut row = Measurement { command, ..sample().with(MRAYS_PER_S, speed) }.with(TREE_HASH, preset.clone());
            let rounds = (0..9).map(|round| (1.0 + 0.1 * f64::from(round)) / speed).collect();
            (row.preset, row.rounds) = (Some(preset), std::iter::once(("wide_trace_ms".to_owned(), rounds)).collect());
            row
        };
        let table = comparison_table(&[row("hq", 3.0), row("fast", 2.0), row("aac-fast", 1.0)]);
        let ends: Vec<_> = table.rows.iter().map(|row| (row[1].as_str(), row[row.len() - 1].as_str())).collect();
        assert_eq!(ends, [("hq", "1.50"), ("fast", "1.00"), ("aac-fast", "0.50")]);
        assert_eq!((&table.sources[..], table.better.len()), (&[0, 1, 2][..], table.columns.len()));
        let slow_first = comparison_table(&[row("aac-fast", 1.0), row("hq", 3.0), row("fast", 2.0)]);
        assert_eq!(slow_first.sources, [1, 2, 0], "the measurement of each row");
        assert_eq!(
            table.notes[0],
            "thing.obj, box: hq is the fastest to trace, 1.50 times as fast as fast (1.50 to 1.50 over 9 rounds), which all are relative to."
        );
        let alone = comparison_table(&[row("fast", 2.0)]);
        assert_eq!(alone.notes[0], "thing.obj, box: fast alone was measured.");
    }

    #[test]
    fn compared_builders_that_differ_by_noise_keep_their_order_and_have_no_fastest() {
        let row = |preset: &str, hash: &str, times: [f64; 3]| {
            let mut row = Measurement { command: "compare".to_owned(), ..sample() }.with(TREE_HASH, hash);
            row.preset = Some(preset.to_owned());
            row.rounds = std::iter::once(("wide_trace_ms".to_owned(), times.repeat(3))).collect();
            row
        };
        let rows = [row("fast", "a", [4.0, 5.0, 6.0]), row("hq", "b", [5.0, 4.0, 6.0]), row("best", "a", [1.0; 3])];
        let table = comparison_table(&rows);
        let ends: Vec<_> = table.rows.iter().map(|row| (row[1].as_str(), row[row.len() - 1].as_str())).collect();
        assert_eq!(ends[..2], [("fast", "1.00"), ("best", "the same tree")]);
        assert_eq!(ends[2], ("hq", "(1.00)"));
    }

    #[test]
    fn efficiency_is_the_speed_up_for_each_thread() {
        let one = Measurement { threads: 1, ..sample().with(SPEEDUP, f64::NAN).with(TRACE_SPEEDUP, 1.0) };
        let table = scaling_table(&[one, sample()]);
        let expected = [
            "scene: thing.obj",
            "container: box",
            "threads: 3",
            "build ms: 20.00",
            "spread %: 30",
            "speed-up ×: 2.75",
            // 2.75 with 3 threads.
            "efficiency %: 92",
            "trace ms: 50.00",
            "spread %: 28",
            "speed-up ×: 1.25",
            "efficiency %: 42",
        ];
        assert_eq!(cells(&table, 1), expected);
        assert_eq!(cells(&table, 0)[5..7], ["speed-up ×: –", "efficiency %: –"]);
        assert_eq!(cells(&table, 0)[9..], ["speed-up ×: 1.00", "efficiency %: 100"]);
    }
}
