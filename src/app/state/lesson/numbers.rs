//! The numbers that captions name.

use std::collections::BTreeMap;

use crate::app::format;
use crate::app::state::model::Presented;

/// Numbers of a presented tree and its picture, by name, with their text.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers(BTreeMap<&'static str, (f64, String)>);

impl Numbers {
    /// Every name, with what it stands for.
    pub const NAMES: [(&'static str, &'static str); 9] = [
        ("triangles", "triangles of the model"),
        ("nodes", "nodes of the tree"),
        ("leaves", "leaves of the tree"),
        ("levels", "depth of the deepest node"),
        ("sah", "SAH cost of the tree"),
        ("build", "build time"),
        ("containers", "container tests per primary ray"),
        ("primitives", "triangle tests per primary ray"),
        ("tests", "container and triangle tests per primary ray"),
    ];

    /// The numbers of what is presented; `None` until its tests are counted.
    pub fn of(shown: &Presented) -> Option<Self> {
        let [containers, primitives] = shown.tests_per_ray?.map(f64::from);
        let report = &shown.accel.report;
        let stats = &report.stats;
        let count = |value: u64| (value as f64, format::count(value));
        let decimal = |value: f64| (value, format::significant(value));
        let numbers = [
            count(shown.accel.scene.triangles.len() as u64),
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
