//! A verdict as rows have it.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::factor::Factor;

/// The direction of a verdict. Names are those of JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Word {
    /// Less time than the other tree.
    #[serde(rename = "better")]
    Better,
    /// More time.
    #[serde(rename = "worse")]
    Worse,
    /// Both are the same tree, node for node.
    #[serde(rename = "the same tree")]
    SameTree,
    /// The rounds do not decide.
    #[serde(rename = "not decided")]
    Undecided,
    /// One of the two was measured only once.
    #[serde(rename = "measured once")]
    Once,
}

/// How a time of a tree compares with that of another. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RowVerdict {
    /// Name of the time.
    pub number: String,
    /// The other tree, or the policy.
    pub against: String,
    /// Which is better.
    pub verdict: Word,
    /// The median factor of this tree's time over the other's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// The interval in which the true factor is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Number of rounds or frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounds: Option<usize>,
    /// In how many of them this tree took less time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub less: Option<usize>,
    /// Of `animate`, against rebuilding: the frame from which on that takes less time in each to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pays_from: Option<usize>,
    /// Of `animate`, against rebuilding: rays of a frame above which that takes less time, the median over the frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub break_even_rays: Option<f64>,
    /// The interval in which they are; null for infinity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub break_even_interval: Option<[Option<f64>; 2]>,
}

impl RowVerdict {
    /// The verdict of a factor.
    pub fn of_factor(number: &str, against: String, factor: &Factor) -> Self {
        let verdict = match factor.decided() {
            Some(Ordering::Less) => Word::Better,
            Some(_) => Word::Worse,
            None => Word::Undecided,
        };
        Self {
            number: number.to_owned(),
            against,
            verdict,
            factor: Some(factor.median).filter(|median| median.is_finite()),
            interval: factor.interval.filter(|ends| ends.iter().all(|end| end.is_finite())),
            rounds: Some(factor.count),
            less: factor.less,
            pays_from: None,
            break_even_rays: None,
            break_even_interval: None,
        }
    }
}
