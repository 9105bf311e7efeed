//! The table of two trees side by side: each number of A, of B, and the difference with the word for its direction.

use super::aligned::ReportTable;
use super::format::{
    COSTS_DO_NOT_COMPARE, INTERVALS, conditions_and_threads, costs, disturbed_text, factor_text, number, short,
};
use crate::catalog::numbers::rows::{EPO, TESTS_PER_ENTERING_RAY};
use crate::catalog::numbers::{Compared, Digits, NUMBERS, Number};
use crate::lab::measurement::Measurement;
use crate::lab::population::MeasuredRays;
use crate::lab::verdict::{Order, Reading, Verdict, judge, judge_rows};
use crate::text::{count, factor};

/// Both trees and their difference. The words say whether B is better than A.
pub fn difference_table([a, b]: &[Measurement; 2]) -> ReportTable {
    let rows = [a.clone(), b.clone()];
    let title = format!("{}, {} triangles", short(&a.model), count(a.triangles as u64));
    let mut table = ReportTable::new(
        format!("{title} ({})", conditions_and_threads(&rows)),
        &[("", ""), ("A", ""), ("B", ""), ("B - A", ""), ("%", ""), ("B is", "")],
    );
    let compared = NUMBERS.iter().filter_map(|number| Some((number, number.compared.as_ref()?)));
    table.rows.extend(compared.map(|(number, compared)| line(number, compared, a, b)));
    table.rows.extend(a.populations.iter().zip(&b.populations).filter_map(|(a, b)| rays_line(a, b)));
    table.notes = [("A", a), ("B", b)].map(|(name, row)| format!("{name}: {}", settings(row))).to_vec();
    let bases: Vec<String> = NUMBERS.iter().filter_map(|number| basis(number, a, b)).collect();
    if !bases.is_empty() {
        table.notes.extend(bases);
        table.notes.push(INTERVALS.to_owned());
    }
    let margins = rows.each_ref().map(|row| row.reading(EPO).margin);
    if margins.iter().any(|margin| *margin > 0.0) {
        let [a, b] = margins.map(number);
        table.notes.push(format!("EPO is an estimate, with 95 % confidence within ±{a} of A and ±{b} of B."));
    }
    table.notes.push(costs(&rows));
    if a.container != b.container {
        table.notes.push(COSTS_DO_NOT_COMPARE.to_owned());
    }
    table
}

fn line(of: &Number, compared: &Compared, a: &Measurement, b: &Measurement) -> Vec<String> {
    let values = [a, b].map(|row| row.number(of));
    let is_comparable = a.container == b.container || compared.across_containers;
    cells(compared.name, of.digits, values, is_comparable.then(|| judge_rows(of, a, b).0))
}

/// Tests by a ray of a population that enters the scene's box.
fn rays_line(a: &MeasuredRays, b: &MeasuredRays) -> Option<Vec<String>> {
    let values = [a.tests_per_entering_ray?, b.tests_per_entering_ray?];
    let [before, now] = values.map(|value| Reading { value, ..Reading::default() });
    let compared = TESTS_PER_ENTERING_RAY.compared?;
    let verdict = judge(&compared, &before, &now, Order::InTurn).0;
    let name = format!("{}, {}", compared.name, a.population.name());
    Some(cells(&name, TESTS_PER_ENTERING_RAY.digits, values, Some(verdict)))
}

/// A line of both values; the difference only with a verdict, without which they do not compare.
fn cells(name: &str, digits: Digits, [before, now]: [f64; 2], verdict: Option<Verdict>) -> Vec<String> {
    let text = |value: f64| digits.text(value);
    let mut cells = vec![name.to_owned(), text(before), text(now)];
    let Some(verdict) = verdict else { return cells };
    let difference = now - before;
    let sign = if difference < 0.0 { "-" } else { "+" };
    let percent = if before == 0.0 || difference.is_nan() {
        "–".to_owned()
    } else {
        factor(before, now).unwrap_or_else(|| format!("{:+.1}", difference / before * 100.0))
    };
    let word = match verdict {
        Verdict::Different if !difference.is_nan() => "other",
        Verdict::Once => "measured once",
        verdict => verdict.word(),
    };
    let difference = if difference.is_nan() { text(difference) } else { format!("{sign}{}", text(difference.abs())) };
    cells.extend([difference, percent, word.to_owned()]);
    cells
}

/// The measurements behind the verdict on a time or speed: "build ms: B × 0.50, 0.48 to 0.52 over 9 rounds; A 19.00 to 21.00, B 9.000 to 10.00 (1 of 9 disturbed)".
fn basis(of: &Number, a: &Measurement, b: &Measurement) -> Option<String> {
    let compared = of.compared.as_ref().filter(|compared| compared.is_timed)?;
    let factor = judge_rows(of, a, b).1?;
    let [a, b] = [("A", a), ("B", b)].map(|(name, row)| {
        let [lower, upper] = row.values.spread(of)?;
        Some(format!("{name} {} to {}{}", number(lower), number(upper), disturbed_text(&row.reading(of).rounds)))
    });
    Some(format!("{}: B {}; {}, {}.", compared.name, factor_text(&factor), a?, b?))
}

/// The settings of a row as `diff` takes them.
fn settings(row: &Measurement) -> String {
    let label = row.label.as_ref().map(|label| format!("{label}: "));
    let label = label.as_deref().unwrap_or_default();
    if let Some(tree) = &row.tree {
        return format!("{label}{tree}, {} of {}", row.container.name(), row.builder);
    }
    let mut words = vec![format!("{label}builder={}", row.builder), format!("container={}", row.container.name())];
    words.extend(row.settings.all().map(|(setting, text)| format!("{}={text}", setting.key)));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::{BUILD_MS, EPO_MARGIN, MRAYS_PER_S, NODES, SAH_COST, TREE_HASH};
    use crate::lab::sample::sample;
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn each_row_has_sign_percentage_and_word() {
        let mut b = sample().with(BUILD_MS, 9.0).with(MRAYS_PER_S, 4.625).with(NODES, 12_001).with(SAH_COST, 67.31);
        b.values.set(EPO, 196.0);
        b.values.set(TREE_HASH, "another");
        b.rounds =
            rounds([8.0, 9.0, 10.0, 9.0, 9.0, 8.5, 9.5, 30.0, 9.0], [4.0, 5.0, 4.0, 5.0, 4.0, 5.0, 4.0, 5.0, 4.0]);
        let a = Measurement { rounds: rounds([20.0; 9], [4.5; 9]), ..sample() };
        let table = difference_table(&[a, b]);
        let row = |name: &str| table.rows.iter().find(|row| row[0] == name).map(|row| row[1..].join(" "));
        assert_eq!(row("build ms").as_deref(), Some("20.00 9.000 -11.00 -55.0 better"));
        assert_eq!(row("speed Mray/s").as_deref(), Some("2.312 4.625 +2.312 +100.0 not decided"));
        assert_eq!(row("EPO").as_deref(), Some("0.875 196.0 +195.1 × 224 worse"));
        assert_eq!(row("SAH cost").as_deref(), Some("67.30 67.31 +0.010 +0.0 same"));
        assert_eq!(row("nodes").as_deref(), Some("14,001 12,001 -2,000 -14.3 other"));
        assert_eq!(row("depth").as_deref(), Some("31 31 +0 +0.0 same"));
        let settings =
            "A: builder=aac container=box threshold=11 epsilon=0.25 curve=hilbert optimize=collapse rounds=13";
        assert_eq!(table.notes[0], settings);
        assert_eq!(
            table.notes[2],
            "build ms: B × 0.450, 0.425 to 0.500 over 9 rounds; A 17.00 to 23.00, B 17.00 to 23.00 (1 of 9 disturbed)."
        );
    }

    fn rounds(build: [f64; 9], trace: [f64; 9]) -> std::collections::BTreeMap<String, Vec<f64>> {
        [("build_ms", build), ("wide_trace_ms", trace)].map(|(key, rounds)| (key.to_owned(), rounds.to_vec())).into()
    }

    #[test]
    fn within_the_intervals_of_estimates_no_word_is_said() {
        let other = |value: f64| sample().with(TREE_HASH, "another").with(EPO, value).with(EPO_MARGIN, 0.04);
        let word = |value: f64| {
            let table = difference_table(&[sample().with(EPO_MARGIN, 0.03), other(value)]);
            assert!(table.notes.iter().any(|note| note.contains("within ±0.030 of A and ±0.040 of B")), "{table}");
            table.rows.into_iter().find(|row| row[0] == "EPO").map(|row| row[5].clone())
        };
        // The sample has 0.875; the root of the sum of squares is 0.05.
        assert_eq!(
            [0.92, 0.83, 0.93, 0.82].map(word),
            ["not decided", "not decided", "worse", "better"].map(|word| Some(word.to_owned()))
        );
    }

    /// However much the times of two builds of it differ.
    #[test]
    fn a_tree_is_never_better_or_worse_than_itself() {
        let mut b = sample().with(BUILD_MS, 2.0).with(MRAYS_PER_S, 9.0);
        b.rounds = rounds([2.0; 9], [1.0; 9]);
        let table = difference_table(&[sample(), b]);
        assert!(table.rows.iter().all(|row| row[5] == "same"), "{table}");
    }

    #[test]
    fn a_tree_of_a_file_is_named_and_its_unknown_build_time_a_dash() {
        let b = Measurement {
            builder: "mine".to_owned(),
            tree: Some("a/mine.bvh".to_owned()),
            ..sample().with(BUILD_MS, f64::NAN).with(TREE_HASH, "another")
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
