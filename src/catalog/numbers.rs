//! Each number of a tree, in one row: name, unit, digits, label, meaning, and how it is read. JSON, CSV, `info`, the side
//! panel, the tables of the measuring commands, plots, differences and the glossary follow from it.

use serde_json::Value;

use super::reading::TreeReading;
use super::terms::{self, Term};
use crate::text::{count, number};
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

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
            Self::Count | Self::Bytes => count(value as u64),
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

/// A row that is shown nowhere beyond JSON and CSV.
const ROW: Number = Number {
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
const LESS: Compared = Compared {
    name: "",
    better: Some(Direction::Less),
    is_timed: false,
    depends_on_view: false,
    across_containers: true,
};
/// A number that describes the tree and is neither good nor bad.
const NEITHER: Compared = Compared { better: None, ..LESS };
/// A count of the picture's rays.
const OF_VIEW: Compared = Compared { depends_on_view: true, ..LESS };

/// An f32 with its own digits: 0.2 and not 0.20000000298023224.
fn single(value: f32) -> Option<Value> {
    value.to_string().parse::<f64>().ok().map(Value::from)
}

/// A number that is known; `null` where it is infinite or not a number.
#[expect(clippy::unnecessary_wraps, reason = "every row is read through an option")]
fn known(value: impl Into<Value>) -> Option<Value> {
    Some(value.into())
}

fn singles<const N: usize>(values: [f32; N]) -> Option<Value> {
    values.map(single).into_iter().collect::<Option<Vec<_>>>().map(Value::from)
}

fn hash(tree: &TreeReading<'_>, index: usize) -> Option<Value> {
    known(format!("{:016x}", tree.hashes?[index]))
}

fn tests(tree: &TreeReading<'_>, select: fn([f32; 2]) -> f32) -> Option<Value> {
    single(select(tree.trace?.tests?))
}

fn megabytes(bytes: usize) -> String {
    format!("{} MB", number(bytes as f64 / 1e6))
}

/// Rays of `tree` in millions a second where all took `ms` milliseconds.
fn rate(tree: &TreeReading<'_>, ms: f64) -> Option<f64> {
    Some(millions_per_second(tree.trace?.rays, ms))
}

/// Millions a second of `count` things that took `ms` milliseconds; 0 where no time was measured.
pub fn millions_per_second(count: u64, ms: f64) -> f64 {
    if ms > 0.0 { count as f64 / ms / 1e3 } else { 0.0 }
}

/// All numbers, in the order of JSON, CSV and tables.
pub const NUMBERS: &[Number] = &[
    Number {
        key: "build_ms",
        unit: "ms",
        label: "Build time",
        meaning: "Wall-clock time of building the binary tree, as in the paper: the median of the repetitions; null where the \
                  file of the tree does not state it",
        term: Some(&terms::BUILD_TIME),
        get: |tree| known(tree.build.map_or(f64::NAN, |build| build.ms)),
        spread: Some(("build_ms_spread", |tree| tree.build?.spread)),
        compared: Some(Compared { name: "build ms", is_timed: true, ..LESS }),
        column: Some(("binary tree", "ms")),
        axis: Some("Build time (ms)"),
        ..ROW
    },
    Number {
        key: "ready_ms",
        unit: "ms",
        label: "Ready to trace",
        meaning: "Wall-clock time until rays can be traced at full speed: the binary tree and the wide one made from it; absent \
                  where the file of the tree does not state its build time",
        get: |tree| tree.ready_ms.map(Value::from),
        column: Some(("ready", "ms")),
        ..ROW
    },
    Number {
        key: "build_stages_ms",
        unit: "ms",
        label: "Stages",
        meaning: "Time of each stage of the build, each the median of its own repetitions",
        get: |tree| serde_json::to_value(&tree.stages_ms).ok(),
        ..ROW
    },
    Number {
        key: "mtriangles_per_s",
        unit: "Mtri/s",
        label: "Speed",
        meaning: "Triangles built per second, in millions",
        get: |tree| known(millions_per_second(tree.triangles as u64, tree.build?.ms)),
        panel: Some(Section::Build),
        ..ROW
    },
    Number {
        key: "trace_ms",
        unit: "ms",
        label: "Trace time",
        meaning: "Wall-clock time of tracing the primary rays one by one through the binary tree without shading, as in the paper: \
                  the median of the repetitions; of `render` the time of the whole picture",
        get: |tree| known(tree.trace?.binary?.ms),
        spread: Some(("trace_ms_spread", |tree| tree.trace?.binary?.spread)),
        column: Some(("binary trace", "ms")),
        axis: Some("Trace time, binary tree (ms)"),
        ..ROW
    },
    Number {
        key: "binary_mrays_per_s",
        unit: "Mray/s",
        meaning: "Primary rays per second through the binary tree, in millions, from `trace_ms`",
        get: |tree| tree.trace?.wide.and_then(|_| known(rate(tree, tree.trace?.binary?.ms)?)),
        ..ROW
    },
    Number {
        key: "wide_trace_ms",
        unit: "ms",
        meaning: "Wall-clock time of tracing the same primary rays in packets through the wide tree, as pictures are traced: the \
                  median of the repetitions",
        get: |tree| known(tree.trace?.wide?.ms),
        ..ROW
    },
    Number {
        key: "mrays_per_s",
        unit: "Mray/s",
        label: "Speed",
        meaning: "Primary rays per second through the wide tree, in millions, from `wide_trace_ms`; of `render` and in the window \
                  with the shading of the picture",
        term: Some(&terms::MRAYS_PER_SECOND),
        get: |tree| match tree.trace?.wide {
            Some(wide) => known(rate(tree, wide.ms)?),
            None => tree.trace?.picture_mrays_per_s.map(Value::from),
        },
        spread: Some(("mrays_per_s_spread", |tree| {
            let [fastest, slowest] = tree.trace?.wide?.spread?;
            Some([rate(tree, slowest)?, rate(tree, fastest)?])
        })),
        compared: Some(Compared { name: "speed Mray/s", better: Some(Direction::More), is_timed: true, ..OF_VIEW }),
        column: Some(("speed", "Mray/s")),
        ..ROW
    },
    Number {
        key: "container_tests_per_ray",
        label: "Container tests",
        meaning: "Containers tested by a primary ray, on average",
        term: Some(&terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[containers, _]| containers),
        compared: Some(Compared { name: "container tests/ray", ..OF_VIEW }),
        panel: Some(Section::Trace),
        column: Some(("containers", "tests/ray")),
        ..ROW
    },
    Number {
        key: "primitive_tests_per_ray",
        label: "Triangle tests",
        meaning: "Triangles tested by a primary ray, on average",
        term: Some(&terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[_, primitives]| primitives),
        compared: Some(Compared { name: "triangle tests/ray", ..OF_VIEW }),
        panel: Some(Section::Trace),
        column: Some(("primitives", "tests/ray")),
        ..ROW
    },
    Number {
        key: "tests_per_ray",
        label: "Tests per ray",
        meaning: "Containers and triangles tested by a primary ray, on average",
        term: Some(&terms::TESTS_PER_RAY),
        get: |tree| tests(tree, |[containers, primitives]| containers + primitives),
        compared: Some(Compared { name: "tests/ray", ..OF_VIEW }),
        column: Some(("all", "tests/ray")),
        axis: Some("Tests per ray"),
        ..ROW
    },
    Number {
        key: "sah_cost",
        label: "SAH cost",
        meaning: "Expected cost of a ray that hits the root, by the surface area heuristic: each test weighted by the area of the \
                  node over the root's",
        term: Some(&terms::SAH_COST),
        get: |tree| single(tree.report.stats.sah_cost),
        compared: Some(Compared { name: "SAH cost", across_containers: false, ..LESS }),
        info: Some(("SAH cost", |tree| {
            let cost = number(tree.report.stats.sah_cost.into());
            Some(format!("{cost} (container test {TRAVERSAL_COST}, primitive test {INTERSECTION_COST})"))
        })),
        column: Some(("SAH cost", "")),
        axis: Some("SAH cost"),
        ..ROW
    },
    Number {
        key: "optimize_sah_costs",
        meaning: "SAH cost before the optimisation passes, under `tree`, and after each pass",
        get: |tree| {
            let costs = tree.report.stages.costs.iter().map(|&(pass, cost)| (pass.to_owned(), Value::from(cost)));
            Some(Value::Object(costs.collect())).filter(|_| !tree.report.stages.costs.is_empty())
        },
        ..ROW
    },
    Number {
        key: "traversal_cost",
        meaning: "Cost of a container test in the SAH cost",
        get: |_| single(TRAVERSAL_COST),
        ..ROW
    },
    Number {
        key: "intersection_cost",
        meaning: "Cost of a primitive test in the SAH cost",
        get: |_| single(INTERSECTION_COST),
        ..ROW
    },
    Number {
        key: "epo",
        label: "EPO",
        meaning: "End-point overlap (Aila et al. 2013): surface inside nodes that do not contain it",
        term: Some(&terms::EPO),
        note: Some(|tree| tree.epo?.estimate_note()),
        get: |tree| single(tree.epo?.value),
        compared: Some(Compared { name: "EPO", across_containers: false, ..LESS }),
        panel: Some(Section::Tree),
        info: Some(("EPO", |tree| {
            let epo = tree.epo?;
            let note = epo.estimate_note().map_or_else(String::new, |note| format!(" ({note})"));
            Some(format!("{}{note}", number(epo.value.into())))
        })),
        column: Some(("EPO", "")),
        ..ROW
    },
    Number {
        key: "epo_triangles",
        meaning: "Number of triangles that `epo` was computed from; fewer than those of the model where it is an estimate",
        get: |tree| known(tree.epo?.sampled),
        ..ROW
    },
    Number {
        key: "nodes",
        digits: Digits::Count,
        label: "Nodes",
        meaning: "Interior nodes and leaves",
        term: Some(&terms::NODE),
        get: |tree| known(tree.report.stats.nodes),
        compared: Some(Compared { name: "nodes", ..NEITHER }),
        panel: Some(Section::Tree),
        info: Some(("nodes", |tree| {
            let stats = &tree.report.stats;
            Some(format!("{}, leaves {}", stats.nodes, stats.leaves))
        })),
        column: Some(("nodes", "")),
        ..ROW
    },
    Number {
        key: "leaves",
        digits: Digits::Count,
        label: "Leaves",
        meaning: "Nodes that hold triangles",
        term: Some(&terms::LEAF),
        get: |tree| known(tree.report.stats.leaves),
        compared: Some(Compared { name: "leaves", ..NEITHER }),
        panel: Some(Section::Tree),
        column: Some(("leaves", "")),
        ..ROW
    },
    Number {
        key: "max_depth",
        digits: Digits::Count,
        label: "Depth",
        meaning: "Depth of the deepest node, root 0",
        term: Some(&terms::DEPTH),
        note: Some(|tree| Some(format!("leaves lie at {:.1} on average", tree.report.stats.mean_leaf_depth))),
        get: |tree| known(tree.report.stats.max_depth),
        compared: Some(Compared { name: "depth", ..NEITHER }),
        panel: Some(Section::Tree),
        info: Some(("depth", |tree| {
            let stats = &tree.report.stats;
            Some(format!("{}, mean over leaves {:.1}", stats.max_depth, stats.mean_leaf_depth))
        })),
        column: Some(("depth", "")),
        ..ROW
    },
    Number {
        key: "mean_leaf_depth",
        meaning: "Depth of the leaves, on average",
        get: |tree| single(tree.report.stats.mean_leaf_depth),
        ..ROW
    },
    Number {
        key: "children_per_node",
        label: "Children",
        meaning: "Children of an interior node: fewest, mean, most; absent for a binary tree",
        term: Some(&terms::NODE),
        note: Some(|tree| {
            let counts = tree.report.stats.arity_histogram.iter().enumerate().filter(|(_, nodes)| **nodes > 0);
            let list: Vec<String> =
                counts.map(|(arity, nodes)| format!("{arity}: {}", count((*nodes).into()))).collect();
            Some(format!("nodes by children: {}", list.join(", ")))
        }),
        get: |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            singles([stats.min_arity() as f32, stats.mean_arity, stats.max_arity as f32])
        },
        panel: Some(Section::Tree),
        info: Some(("children", |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            Some(format!("{} to {} a node, mean {:.2}", stats.min_arity(), stats.max_arity, stats.mean_arity))
        })),
        ..ROW
    },
    Number {
        key: "nodes_per_arity",
        meaning: "Number of interior nodes by number of children, from 0; absent for a binary tree",
        get: |tree| {
            let stats = Some(&tree.report.stats).filter(|stats| !stats.is_binary())?;
            known(stats.arity_histogram.clone())
        },
        ..ROW
    },
    Number {
        key: "leaf_size",
        label: "Leaf size",
        meaning: "Triangles in a leaf: smallest, mean, largest",
        term: Some(&terms::LEAF),
        get: |tree| {
            let stats = &tree.report.stats;
            singles([stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32])
        },
        panel: Some(Section::Tree),
        info: Some(("leaf size", |tree| {
            let stats = &tree.report.stats;
            let [min, mean, max] = [stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32];
            Some(format!("{min} to {max} triangles, mean {mean:.2}"))
        })),
        ..ROW
    },
    Number {
        key: "tree_hash",
        meaning: "Hash of the binary tree, 16 hexadecimal digits: the same on every machine",
        get: |tree| hash(tree, 0),
        ..ROW
    },
    Number {
        key: "wide_tree_hash",
        meaning: "Hash of the wide tree, 16 hexadecimal digits",
        get: |tree| hash(tree, 1),
        ..ROW
    },
    Number {
        key: "tree_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Tree",
        meaning: "Nodes and triangle indices of the binary tree",
        get: |tree| known(tree.report.tree_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "triangle_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Leaf triangles",
        meaning: "Triangles in leaf order",
        get: |tree| known(tree.report.triangle_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "bytes_per_triangle",
        unit: "B",
        digits: Digits::Rounded,
        label: "Bytes per triangle",
        meaning: "Bytes of the binary tree and its triangles, per triangle of the model",
        get: |tree| known(tree.report.bytes_per_triangle()),
        info: Some(("memory", |tree| {
            let (report, each) = (tree.report, tree.report.bytes_per_triangle());
            let [nodes, triangles] = [report.tree_bytes, report.triangle_bytes].map(megabytes);
            Some(format!("{nodes} tree, {triangles} triangles, {each:.0} bytes a triangle"))
        })),
        column: Some(("memory", "B/tri")),
        ..ROW
    },
    Number {
        key: "rays",
        digits: Digits::Count,
        label: "Primary rays",
        meaning: "Number of primary rays, one through the centre of each pixel",
        get: |tree| known(tree.trace?.rays),
        ..ROW
    },
    Number {
        key: "hits",
        digits: Digits::Count,
        label: "Hits",
        meaning: "Number of primary rays that hit something",
        get: |tree| known(tree.trace?.hits),
        column: Some(("hits", "")),
        ..ROW
    },
    Number {
        key: "collapse_ms",
        unit: "ms",
        meaning: "Time of making the wide tree from the binary one: the median of the repetitions",
        get: |tree| known(tree.wide?.collapse_ms),
        info: Some(("wide tree", |tree| {
            let wide = tree.wide?;
            let [nodes, triangles] = [wide.node_bytes, wide.triangle_bytes].map(megabytes);
            let each = wide.bytes_per_triangle;
            let ready =
                tree.ready_ms.map_or_else(String::new, |ms| format!(", ready to trace after {} ms", number(ms)));
            let made = number(wide.collapse_ms);
            Some(format!("{nodes} nodes, {triangles} triangles, {each:.0} bytes a triangle, made in {made} ms{ready}"))
        })),
        ..ROW
    },
    Number {
        key: "wide_node_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Wide tree",
        meaning: "Nodes of the wide tree, with up to eight children, which camera rays traverse",
        get: |tree| known(tree.wide?.node_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "wide_triangle_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Wide triangles",
        meaning: "Triangles of the wide tree in leaf order, without gaps",
        get: |tree| known(tree.wide?.triangle_bytes),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "wide_bytes_per_triangle",
        unit: "B",
        digits: Digits::Rounded,
        meaning: "Bytes of the wide tree and its triangles, per triangle of the model",
        get: |tree| known(tree.wide?.bytes_per_triangle),
        ..ROW
    },
    Number {
        key: "overlay_bytes",
        unit: "B",
        digits: Digits::Bytes,
        label: "Overlay",
        meaning: "Indices of the nodes at each depth, for the overlay",
        get: |tree| known(Levels::bytes(tree.report.stats.nodes)),
        panel: Some(Section::Memory),
        ..ROW
    },
    Number {
        key: "speedup",
        label: "Speed-up of the build",
        meaning: "Of `scaling`: build time with one thread divided by this one",
        ..ROW
    },
    Number {
        key: "trace_speedup",
        label: "Speed-up of tracing",
        meaning: "Of `scaling`: trace time with one thread divided by this one",
        ..ROW
    },
];

/// The row of a name; a name without a row does not compile.
const fn named(key: &str) -> &'static Number {
    let mut index = 0;
    while index < NUMBERS.len() {
        if is_same(NUMBERS[index].key.as_bytes(), key.as_bytes()) {
            return &NUMBERS[index];
        }
        index += 1;
    }
    panic!("no number has this name")
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut index = 0;
    while index < a.len() && index < b.len() && a[index] == b[index] {
        index += 1;
    }
    index == a.len() && index == b.len()
}

/// The whole glossary: the tree, its numbers, how it is built, improved and traced; then what numbers bring themselves.
pub fn glossary() -> Vec<&'static Term> {
    let mut terms = terms::TERMS.to_vec();
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
    pub const SAH_COST: &Number = named("sah_cost");
    pub const EPO: &Number = named("epo");
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
        assert_eq!(found("sah COST ")[..1], [&terms::SAH_COST]);
        assert_eq!(found("Meister"), [&terms::REINSERTION]);
        assert_eq!(found("").len(), glossary().len());
        assert!(found("xyzzy").is_empty());
    }
}
