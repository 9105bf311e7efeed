//! The table of two trees side by side: each number of A, of B, and the difference with the word for its direction.

use super::aligned::ReportTable;
use super::format::{conditions_and_threads, costs, number, short};
use crate::lab::measurement::Measurement;
use crate::lab::quantity::{Quantity, Verdict};
use crate::text::count;

/// The rows of the table: name, unit and quantity.
const ROWS: [(&str, Quantity); 10] = [
    ("build ms", Quantity::BuildTime),
    ("speed Mray/s", Quantity::Speed),
    ("container tests/ray", Quantity::ContainerTests),
    ("triangle tests/ray", Quantity::TriangleTests),
    ("tests/ray", Quantity::TestsPerRay),
    ("SAH cost", Quantity::SahCost),
    ("EPO", Quantity::Epo),
    ("nodes", Quantity::Nodes),
    ("leaves", Quantity::Leaves),
    ("depth", Quantity::Depth),
];

/// Both trees and their difference. The words say whether B is better than A.
pub fn difference_table([a, b]: &[Measurement; 2]) -> ReportTable {
    let rows = [a.clone(), b.clone()];
    let title = format!("{}, {} triangles", short(&a.model), count(a.triangles as u64));
    let mut table = ReportTable::new(
        format!("{title} ({})", conditions_and_threads(&rows)),
        &[("", ""), ("A", ""), ("B", ""), ("B - A", ""), ("%", ""), ("B is", "")],
    );
    for (name, quantity) in ROWS {
        table.rows.push(line(name, quantity, a, b));
    }
    table.notes = [("A", a), ("B", b)].map(|(name, row)| format!("{name}: {}", settings(row))).to_vec();
    table.notes.push(costs());
    if a.container != b.container {
        let note = "Costs are relative to the root's surface, so those of boxes and of spheres do not compare.";
        table.notes.push(note.to_owned());
    }
    table
}

fn line(name: &str, quantity: Quantity, a: &Measurement, b: &Measurement) -> Vec<String> {
    let [before, now] = [a, b].map(|row| quantity.of(row));
    let is_count = matches!(quantity, Quantity::Nodes | Quantity::Leaves | Quantity::Depth);
    let text = |value: f64| if is_count { count(value as u64) } else { number(value) };
    let mut cells = vec![name.to_owned(), text(before), text(now)];
    if a.container == b.container || quantity.compares_across_containers() {
        let difference = now - before;
        let sign = if difference < 0.0 { "-" } else { "+" };
        let percent = if before == 0.0 || difference.is_nan() {
            "–".to_owned()
        } else {
            format!("{:+.1}", difference / before * 100.0)
        };
        let verdict = quantity.verdict(before, now);
        let word = if verdict == Verdict::Different && !difference.is_nan() { "other" } else { verdict.word() };
        let difference =
            if difference.is_nan() { number(difference) } else { format!("{sign}{}", text(difference.abs())) };
        cells.extend([difference, percent, word.to_owned()]);
    }
    cells
}

/// The settings of a row as `diff` takes them.
fn settings(row: &Measurement) -> String {
    if let Some(tree) = &row.tree {
        return format!("{tree}, {} of {}", row.container.name(), row.builder);
    }
    let mut words = vec![format!("builder={}", row.builder), format!("container={}", row.container.name())];
    if row.builder == "aac" {
        words.extend([format!("threshold={}", row.threshold), format!("epsilon={}", row.epsilon)]);
    }
    if matches!(row.builder.as_str(), "aac" | "lbvh") {
        words.push(format!("curve={}", row.curve.name()));
    }
    words.push(format!("optimize={}", row.optimize));
    words.extend(row.rounds.map(|rounds| format!("rounds={rounds}")));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn each_row_has_sign_percentage_and_word() {
        let b = Measurement { build_ms: 15.0, mrays_per_s: 0.416_12, nodes: 12_001, sah_cost: 67.31, ..sample() };
        let table = difference_table(&[sample(), b]);
        let row = |name: &str| table.rows.iter().find(|row| row[0] == name).map(|row| row[1..].join(" "));
        assert_eq!(row("build ms").as_deref(), Some("20.00 15.00 -5.000 -25.0 better"));
        assert_eq!(row("speed Mray/s").as_deref(), Some("0.208 0.416 +0.208 +100.0 better"));
        assert_eq!(row("SAH cost").as_deref(), Some("67.30 67.31 +0.010 +0.0 same"));
        assert_eq!(row("nodes").as_deref(), Some("14,001 12,001 -2,000 -14.3 other"));
        assert_eq!(row("depth").as_deref(), Some("31 31 +0 +0.0 same"));
        let settings =
            "A: builder=aac container=box threshold=11 epsilon=0.25 curve=hilbert optimize=collapse rounds=13";
        assert_eq!(table.notes[0], settings);
    }

    #[test]
    fn a_tree_of_a_file_is_named_and_its_unknown_build_time_a_dash() {
        let b = Measurement {
            builder: "mine".to_owned(),
            tree: Some("a/mine.bvh".to_owned()),
            build_ms: f64::NAN,
            build_ms_spread: [f64::NAN; 2],
            ..sample()
        };
        let table = difference_table(&[sample(), b]);
        assert_eq!(table.rows[0][1..].join(" "), "20.00 – – – ");
        assert_eq!(table.notes[1], "B: a/mine.bvh, box of mine");
    }

    #[test]
    fn costs_of_boxes_and_of_spheres_do_not_compare() {
        let table = difference_table(&[sample(), Measurement { container: ContainerKind::Sphere, ..sample() }]);
        let compared = |name: &str| table.rows.iter().any(|row| row[0] == name && row.len() == 6);
        assert!(!compared("SAH cost") && !compared("EPO") && compared("tests/ray"));
        assert!(table.notes.last().is_some_and(|note| note.contains("do not compare")), "{:?}", table.notes);
    }
}
