//! Verdicts of rows: each tree that was measured in turn with others against one of them, in JSON and in tables.

use super::factor::{Factor, Order};
use super::number::{Verdict, judge};
use super::word::{RowVerdict, Word};
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{BUILD_MS, MRAYS_PER_S, READY_MS, TRACE_MS, WIDE_TRACE_MS};
use crate::catalog::numbers::{Compared, Direction};
use crate::lab::measurement::Measurement;

/// The numbers that have verdicts.
const JUDGED: [&Number; 4] = [BUILD_MS, READY_MS, TRACE_MS, WIDE_TRACE_MS];

/// Judges a number of two rows that were measured in turn.
pub fn judge_rows(number: &Number, before: &Measurement, now: &Measurement) -> (Verdict, Option<Factor>) {
    if now.has_tree_of(before) {
        return (Verdict::Same, None);
    }
    let compared = number.compared.unwrap_or(Compared {
        name: "",
        better: Some(Direction::Less),
        is_timed: true,
        depends_on_view: false,
        across_containers: true,
    });
    judge(&compared, &before.reading(number), &now.reading(number), Order::InTurn)
}

/// The row that the others are judged against: of `compare` that of the preset Fast, else the first.
pub fn base_of<'a>(rows: impl IntoIterator<Item = &'a Measurement> + Clone) -> Option<&'a Measurement> {
    let is_fast = |row: &&Measurement| row.command == "compare" && row.preset.as_deref() == Some("fast");
    rows.clone().into_iter().find(is_fast).or_else(|| rows.into_iter().next())
}

/// Gives each of `rows`, which were measured in turn, its verdicts against their base.
pub fn add_verdicts(rows: &mut [Measurement]) {
    let Some(base) = base_of(&*rows).cloned() else { return };
    let against = format!("{}, {}", base.name(), base.container.name());
    for row in rows.iter_mut().filter(|row| **row != base) {
        row.verdicts = JUDGED.into_iter().filter_map(|number| of_row(number, &base, row, &against)).collect();
    }
}

fn of_row(number: &Number, base: &Measurement, row: &Measurement, against: &str) -> Option<RowVerdict> {
    if [base, row].iter().any(|row| row.rounds_of(number).is_empty()) {
        return None;
    }
    let (verdict, factor) = judge_rows(number, base, row);
    if let Some(factor) = factor {
        return Some(RowVerdict::of_factor(number.key, against.to_owned(), &factor));
    }
    Some(RowVerdict {
        number: number.key.to_owned(),
        against: against.to_owned(),
        verdict: if verdict == Verdict::Same { Word::SameTree } else { Word::Once },
        factor: None,
        interval: None,
        rounds: None,
        less: None,
        pays_from: None,
        break_even_rays: None,
        break_even_interval: None,
    })
}

/// Sorts by speed as far as it is decided: a row comes before those given before it that it is decidedly faster than, and all others keep
/// their order.
pub fn sort_by_speed<T>(rows: &mut [T], row: impl Fn(&T) -> &Measurement) {
    for at in 1..rows.len() {
        let mut place = at;
        while place > 0 && judge_rows(MRAYS_PER_S, row(&rows[place - 1]), row(&rows[at])).0 == Verdict::Better {
            place -= 1;
        }
        rows[place..=at].rotate_right(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::TREE_HASH;
    use crate::lab::sample::sample;

    /// A tree that is traced in about so many milliseconds in each of nine rounds.
    fn row(hash: &str, ms: f64, noise: [f64; 9]) -> Measurement {
        let mut row = sample().with(TREE_HASH, hash);
        row.rounds = std::iter::once(("wide_trace_ms".to_owned(), noise.map(|noise| ms * noise).to_vec())).collect();
        row.verdicts.clear();
        row
    }

    const NOISE: [f64; 9] = [1.0, 1.3, 1.01, 1.0, 0.99, 1.02, 5.0, 1.0, 1.01];
    const OTHER: [f64; 9] = [1.01, 1.29, 1.0, 1.01, 1.0, 1.0, 5.2, 0.99, 1.02];

    #[test]
    fn rows_are_judged_against_their_base() {
        let mut rows = [row("a", 5.0, NOISE), row("b", 4.0, NOISE), row("c", 5.0, OTHER), row("a", 3.0, NOISE)];
        add_verdicts(&mut rows);
        assert!(rows[0].verdicts.is_empty());
        let words: Vec<Word> = rows[1..].iter().map(|row| row.verdicts[0].verdict).collect();
        assert_eq!(words, [Word::Better, Word::Undecided, Word::SameTree]);
        let faster = &rows[1].verdicts[0];
        assert_eq!((faster.factor, faster.rounds, faster.less), (Some(0.8), Some(9), Some(9)));
        assert_eq!(faster.against, "aac + hilbert + collapse, box");
    }

    #[test]
    fn rows_that_differ_by_noise_keep_the_order_given() {
        let mut rows = [row("a", 5.0, NOISE), row("b", 4.99, OTHER), row("c", 4.0, NOISE), row("d", 5.0, OTHER)];
        sort_by_speed(&mut rows, |row| row);
        let hashes: Vec<_> = rows.iter().filter_map(|row| row.values.value(TREE_HASH)?.as_str()).collect();
        assert_eq!(hashes, ["c", "a", "b", "d"]);
    }
}
