//! Each number of a tree, in one row: name, unit, digits, label, meaning, and how it is read. JSON, CSV, `info`, the side
//! panel, the tables of the measuring commands, plots, differences and the glossary follow from it.

use serde_json::Value;

use super::is_same;
use super::reading::TreeReading;
use super::terms::{self, Term};
use crate::text::{number, whole};

/// A number of a tree.
#[derive(Debug, Clone, Copy)]
pub struct Number {
    /// Name in JSON and CSV.
    pub key: &'static str,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// How it is written in tables.
    pub digits: Digits,
    /// Name in the window.
    pub label: &'static str,
    /// Its meaning, in one sentence without a full stop: the tooltip in the window and the entry in the list of fields.
    pub meaning: &'static str,
    /// The glossary's term that explains it.
    pub term: Option<&'static Term>,
    /// Its addition to the tooltip that depends on the tree.
    pub note: Option<Text>,
    /// Reads it; `None` where it is not known, or does not apply.
    pub get: fn(&TreeReading<'_>) -> Option<Value>,
    /// Name in JSON and CSV of the fastest and slowest repetition, and how they are read.
    pub spread: Option<(&'static str, Spread)>,
    /// How two trees are compared by it.
    pub compared: Option<Compared>,
    /// Section of the side panel that shows it.
    pub panel: Option<Section>,
    /// Line of `info`: its name and text.
    pub info: Option<(&'static str, Text)>,
    /// Name and unit of its column in the tables of single trees.
    pub column: Option<(&'static str, &'static str)>,
    /// Label of its axis in plots.
    pub axis: Option<&'static str>,
}

/// Reads fastest and slowest repetition.
pub type Spread = fn(&TreeReading<'_>) -> Option<[f64; 2]>;
/// Writes a line of `info`, or what a tooltip adds.
pub type Text = fn(&TreeReading<'_>) -> Option<String>;

/// How a number is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Digits {
    /// A whole number with its thousands separated.
    Count,
    /// About four significant digits.
    Significant,
    /// Rounded to a whole number.
    Rounded,
    /// A size in bytes.
    Bytes,
}

impl Digits {
    /// `value` as text.
    pub fn text(self, value: f64) -> String {
        match self {
            _ if value.is_nan() => number(value),
            Self::Count | Self::Bytes => whole(value),
            Self::Significant => number(value),
            Self::Rounded => format!("{value:.0}"),
        }
    }
}

/// Sections of the side panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// The build.
    Build,
    /// The tree.
    Tree,
    /// The traced rays.
    Trace,
    /// Memory.
    Memory,
}

/// How two trees are compared by a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compared {
    /// Name in the table of differences.
    pub name: &'static str,
    /// The better direction; `None` where neither is.
    pub better: Option<Direction>,
    /// It is measured by a clock, so that small differences are noise.
    pub is_timed: bool,
    /// It depends on camera, size and shading of the picture.
    pub depends_on_view: bool,
    /// Values of boxes and of spheres compare. Costs are relative to the root's container, and a box's surface is another than a
    /// sphere's.
    pub across_containers: bool,
}

/// A direction of change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Towards smaller values.
    Less,
    /// Towards larger values.
    More,
}

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for Number {}

impl std::hash::Hash for Number {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key.hash(state);
    }
}

mod row;

mod speed;

mod shape;

mod size;

/// Millions a second of `count` things that took `ms` milliseconds; 0 where no time was measured.
pub fn millions_per_second(count: u64, ms: f64) -> f64 {
    if ms > 0.0 { count as f64 / ms / 1e3 } else { 0.0 }
}

const PARTS: [&[Number]; 3] = [speed::ROWS, shape::ROWS, size::ROWS];
const COUNT: usize = PARTS[0].len() + PARTS[1].len() + PARTS[2].len();

/// All numbers, in the order of JSON, CSV and tables.
pub const NUMBERS: &[Number] = &joined();

/// The parts one after another. Iterators are not for constants.
const fn joined() -> [Number; COUNT] {
    let mut all = [row::ROW; COUNT];
    let (mut at, mut part) = (0, 0);
    while part < PARTS.len() {
        let mut index = 0;
        while index < PARTS[part].len() {
            all[at] = PARTS[part][index];
            at += 1;
            index += 1;
        }
        part += 1;
    }
    all
}

/// The row of a name; a name without a row does not compile.
const fn named(key: &str) -> &'static Number {
    let mut index = 0;
    while index < NUMBERS.len() {
        if is_same(NUMBERS[index].key, key) {
            return &NUMBERS[index];
        }
        index += 1;
    }
    panic!("no number has this name")
}

/// The whole glossary: the tree, its numbers, how it is built, improved and traced; then what numbers bring themselves.
pub fn glossary() -> Vec<&'static Term> {
    let mut terms: Vec<_> = terms::TERMS.iter().collect();
    for term in NUMBERS.iter().filter_map(|number| number.term) {
        if !terms.contains(&term) {
            terms.push(term);
        }
    }
    terms
}

/// The rows that code names.
pub mod rows {
    #![expect(missing_docs, reason = "each row explains itself")]
    use crate::catalog::numbers::{Number, named};

    pub const BUILD_MS: &Number = named("build_ms");
    pub const READY_MS: &Number = named("ready_ms");
    pub const MTRIANGLES_PER_S: &Number = named("mtriangles_per_s");
    pub const BUILD_STAGES_MS: &Number = named("build_stages_ms");
    pub const TRACE_MS: &Number = named("trace_ms");
    pub const MRAYS_PER_S: &Number = named("mrays_per_s");
    pub const CONTAINER_TESTS_PER_RAY: &Number = named("container_tests_per_ray");
    pub const PRIMITIVE_TESTS_PER_RAY: &Number = named("primitive_tests_per_ray");
    pub const TESTS_PER_RAY: &Number = named("tests_per_ray");
    pub const TESTS_PER_ENTERING_RAY: &Number = named("tests_per_entering_ray");
    pub const BYTES_PER_ENTERING_RAY: &Number = named("bytes_per_entering_ray");
    pub const ENTERING_RAYS: &Number = named("entering_rays");
    pub const SAH_COST: &Number = named("sah_cost");
    pub const EPO: &Number = named("epo");
    pub const EPO_MARGIN: &Number = named("epo_margin");
    pub const EPO_TRIANGLES: &Number = named("epo_triangles");
    pub const NODES: &Number = named("nodes");
    pub const LEAVES: &Number = named("leaves");
    pub const MAX_DEPTH: &Number = named("max_depth");
    pub const BYTES_PER_TRIANGLE: &Number = named("bytes_per_triangle");
    pub const RAYS: &Number = named("rays");
    pub const HITS: &Number = named("hits");
    pub const COLLAPSE_MS: &Number = named("collapse_ms");
    pub const WIDE_TRACE_MS: &Number = named("wide_trace_ms");
    pub const BINARY_MRAYS_PER_S: &Number = named("binary_mrays_per_s");
    pub const SPEEDUP: &Number = named("speedup");
    pub const TRACE_SPEEDUP: &Number = named("trace_speedup");
    pub const MEAN_LEAF_DEPTH: &Number = named("mean_leaf_depth");
    pub const LEAF_SIZE: &Number = named("leaf_size");
    pub const TREE_BYTES: &Number = named("tree_bytes");
    pub const TRIANGLE_BYTES: &Number = named("triangle_bytes");
    pub const PREPARATION_MS: &Number = named("preparation_ms");
    pub const UPDATE_MS: &Number = named("update_ms");
    pub const BEHIND_MS: &Number = named("behind_ms");
    pub const RAY_NS: &Number = named("ray_ns");
    pub const POPULATION_TESTS_PER_RAY: &Number = named("population_tests_per_ray");
    pub const TREE_HASH: &Number = named("tree_hash");
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_term_has_its_own_name_and_at_most_two_sentences() {
        let terms = glossary();
        let names: HashSet<&str> = terms.iter().map(|term| term.name).collect();
        assert_eq!(names.len(), terms.len());
        for term in terms {
            let sentences = term.text.matches(". ").count() + 1;
            assert!(term.text.ends_with('.') && sentences <= 3, "{}: {}", term.name, term.text);
        }
    }

    #[test]
    fn a_filter_finds_names_texts_and_authors() {
        let found = |filter: &str| glossary().into_iter().filter(|term| term.matches(filter)).collect::<Vec<_>>();
        assert_eq!(found("sah COST ")[..1], [terms::SAH_COST]);
        assert_eq!(found("Meister"), [terms::PLOC, terms::REINSERTION]);
        assert_eq!(found("").len(), glossary().len());
        assert!(found("xyzzy").is_empty());
    }
}
