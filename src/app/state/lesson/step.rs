//! A step of a lesson: the state it shows, the numbers that its caption names, and what must be true of them so that the caption
//! is: `tests < 0.5 before.tests`.

use std::collections::BTreeMap;

use crate::app::format;
use crate::app::state::model::Presented;
use crate::app::state::state_line::SharedState;

/// A step of a lesson.
#[derive(Debug, Clone, PartialEq)]
pub struct LessonStep {
    /// State of the window.
    pub state: SharedState,
    /// Two or three sentences; `{name}` stands for a measured number.
    pub caption: String,
    /// A question that the next step answers; empty where there is none.
    pub question: String,
    /// Conditions on the measured numbers under which the caption is true.
    pub checks: Vec<Check>,
}

/// A comparison of two products.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    left: Product,
    less: bool,
    right: Product,
    text: String,
}

/// A factor times a number, or the factor alone.
#[derive(Debug, Clone, PartialEq)]
struct Product {
    factor: f64,
    /// The number's name, and whether it is that of the step before.
    number: Option<(String, bool)>,
}

impl Check {
    /// Reads a check; `Err` describes the fault.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (less, (left, right)) = match (text.split_once('<'), text.split_once('>')) {
            (Some(sides), None) => (true, sides),
            (None, Some(sides)) => (false, sides),
            _ => return Err(format!("a check compares with one < or >, which '{text}' does not")),
        };
        Ok(Self { left: Product::parse(left)?, less, right: Product::parse(right)?, text: text.trim().to_owned() })
    }

    /// Whether it holds; `None` where one of its numbers is unknown.
    pub fn holds(&self, now: &Numbers, before: Option<&Numbers>) -> Option<bool> {
        let (left, right) = (self.left.value(now, before)?, self.right.value(now, before)?);
        Some(if self.less { left < right } else { left > right })
    }

    /// The check as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

impl Product {
    fn parse(text: &str) -> Result<Self, String> {
        let mut product = Self { factor: 1.0, number: None };
        for word in text.split_whitespace() {
            let (name, before) = word.strip_prefix("before.").map_or((word, false), |name| (name, true));
            if let Ok(factor) = word.parse::<f64>() {
                product.factor *= factor;
            } else if Numbers::is_name(name) && product.number.is_none() {
                product.number = Some((name.to_owned(), before));
            } else {
                return Err(format!("'{word}' is no measured number, and there may be one on each side"));
            }
        }
        Ok(product)
    }

    fn value(&self, now: &Numbers, before: Option<&Numbers>) -> Option<f64> {
        let number = match &self.number {
            None => Some(1.0),
            Some((name, true)) => before?.value(name),
            Some((name, false)) => now.value(name),
        };
        Some(self.factor * number?)
    }
}

/// Numbers of a presented tree and its picture, by name, with their text.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers(BTreeMap<&'static str, (f64, String)>);

impl Numbers {
    /// Every name, with its number.
    pub const NAMES: [(&'static str, &'static str); 9] = [
        ("triangles", "triangles of the model"),
        ("nodes", "nodes of the tree"),
        ("leaves", "leaves of the tree"),
        ("levels", "depth of the deepest node"),
        ("sah", "SAH cost of the tree"),
        ("build", "build time"),
        ("containers", "container tests per ray"),
        ("primitives", "triangle tests per ray"),
        ("tests", "container and triangle tests per ray"),
    ];

    /// The numbers of what is presented; `None` until its tests are counted. In the model's own view, which the headline's is of too, tests
    /// are those of the headline, else those of the picture.
    pub fn of(shown: &Presented, is_own_view: bool) -> Option<Self> {
        let accel = &shown.accel;
        let [containers, primitives] = if is_own_view {
            let counts = accel.entering().or(accel.entering_estimate())?;
            [counts.container_tests, counts.tests - counts.container_tests].map(f64::from)
        } else {
            shown.tests_per_ray?.map(f64::from)
        };
        let report = &shown.accel.report;
        let stats = &report.stats;
        let count = |value: u64| (value as f64, format::count(value));
        let decimal = |value: f64| (value, format::significant(value));
        let numbers = [
            count(shown.accel.scene.triangle_count()),
            count(stats.nodes as u64),
            count(stats.leaves as u64),
            count(u64::from(stats.max_depth)),
            decimal(f64::from(stats.sah_cost)),
            (report.build_time.as_secs_f64(), format::duration(report.build_time)),
            decimal(containers),
            decimal(primitives),
            decimal(containers + primitives),
        ];
        Some(Self(Self::NAMES.map(|(name, _)| name).into_iter().zip(numbers).collect()))
    }

    /// A number by its name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.0.get(name).map(|(value, _)| *value)
    }

    /// A number as text, by its name.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(|(_, text)| &text[..])
    }

    /// Whether there is a number of this name.
    pub fn is_name(name: &str) -> bool {
        Self::NAMES.iter().any(|(known, _)| *known == name)
    }
}
