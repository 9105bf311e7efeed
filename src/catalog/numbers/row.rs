//! Parts of rows of numbers: values for fields that most rows leave out, and readers that several share.

use serde_json::Value;

use super::{Compared, Digits, Direction, Number, millions_per_second};
use crate::catalog::reading::TreeReading;
use crate::text::number;

/// A row that is shown nowhere beyond JSON and CSV.
pub(super) const ROW: Number = Number {
    key: "",
    unit: "",
    digits: Digits::Significant,
    label: "",
    meaning: "",
    term: None,
    note: None,
    get: |_| None,
    spread: None,
    compared: None,
    panel: None,
    info: None,
    column: None,
    axis: None,
};

/// A number of the tree alone, of which less is better.
pub(super) const LESS: Compared = Compared {
    name: "",
    better: Some(Direction::Less),
    is_timed: false,
    depends_on_view: false,
    across_containers: true,
};
/// A number that describes the tree and is neither good nor bad.
pub(super) const NEITHER: Compared = Compared { better: None, ..LESS };
/// A count of the picture's rays.
pub(super) const OF_VIEW: Compared = Compared { depends_on_view: true, ..LESS };

/// An f32 with its own digits: 0.2 and not 0.20000000298023224.
pub(super) fn single(value: f32) -> Option<Value> {
    value.to_string().parse::<f64>().ok().map(Value::from)
}

/// A number that is known; `null` where it is infinite or not a number.
#[expect(clippy::unnecessary_wraps, reason = "every row is read through an option")]
pub(super) fn known(value: impl Into<Value>) -> Option<Value> {
    Some(value.into())
}

pub(super) fn singles<const N: usize>(values: [f32; N]) -> Option<Value> {
    values.map(single).into_iter().collect::<Option<Vec<_>>>().map(Value::from)
}

pub(super) fn hash(tree: &TreeReading<'_>, index: usize) -> Option<Value> {
    known(format!("{:016x}", tree.hashes?[index]))
}

pub(super) fn tests(tree: &TreeReading<'_>, select: fn([f32; 2]) -> f32) -> Option<Value> {
    single(select(tree.trace?.tests?))
}

pub(super) fn megabytes(bytes: usize) -> String {
    format!("{} MB", number(bytes as f64 / 1e6))
}

/// Rays of `tree` in millions a second where all took `ms` milliseconds.
pub(super) fn rate(tree: &TreeReading<'_>, ms: f64) -> Option<f64> {
    Some(millions_per_second(tree.trace?.rays, ms))
}
