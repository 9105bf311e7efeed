//! Each number of a single node, in one row: by these, views colour, rank, plot and describe nodes.

use bvhscope_engine::construction::Regrets;
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::node_metrics;
use bvhscope_engine::tree::statistics::TreeStats;
use bvhscope_engine::tree::visits::Visits;
use bvhscope_engine::{AnyTree, with_tree};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::terms::{self, Term};

/// Predicted visits below which the ratio of measured to predicted visits is left to chance.
pub const LEAST_PREDICTED_VISITS: f64 = 16.0;
/// Part of the tree's cost below which savings have no colours of their own.
const LEAST_REGRET: f32 = 1e-5;

/// The source of the metrics of a tree's nodes.
#[derive(Debug, Clone, Copy)]
pub struct NodeReading<'a> {
    /// The tree.
    pub tree: &'a AnyTree,
    /// Its statistics.
    pub stats: &'a TreeStats,
    /// Depths and counts of its nodes, once they are known.
    pub ancestry: Option<&'a Ancestry>,
    /// Its visits, where they are measured.
    pub visits: Option<&'a Visits>,
    /// Savings from rebuilding subtrees, where they are known.
    pub regrets: Option<&'a Regrets>,
    /// Surface areas of its nodes when they were built, where it was kept or fitted since.
    pub built_areas: Option<&'a [f32]>,
    /// Depth of the node that is asked for, where it is known without `ancestry`.
    pub depth: Option<u32>,
}

impl NodeReading<'_> {
    /// The data of a metric are known.
    pub const fn has(&self, source: Source) -> bool {
        match source {
            Source::Tree => true,
            Source::Counts => self.ancestry.is_some(),
            Source::Visits => self.visits.is_some(),
            Source::Regrets => self.regrets.is_some(),
            Source::BuiltAreas => self.built_areas.is_some(),
        }
    }

    /// Measured and predicted visits of `node`; `None` until they are measured.
    pub fn visits(&self, node: u32) -> Option<(u32, f64)> {
        let visits = self.visits?;
        let measured = *visits.counts.get(node as usize)?;
        Some((measured, with_tree!(self.tree, tree => visits.predicted(tree, node))))
    }
}

/// A number of a node.
#[derive(Debug, Clone, Copy)]
pub struct Metric {
    /// Name in shared state and on the command line.
    pub key: &'static str,
    /// Names in earlier versions, which are still read.
    pub former_keys: &'static [&'static str],
    /// Name in the window.
    pub label: &'static str,
    /// Title of a legend of containers.
    pub quantity: &'static str,
    /// Its meaning, in one sentence with its formula.
    pub meaning: &'static str,
    /// The glossary's term that explains it.
    pub term: Option<&'static Term>,
    /// How it is written.
    pub form: Form,
    /// The data that it is computed from.
    pub source: Source,
    /// How places on its colour scale follow its values.
    pub scale: Scale,
    /// Ends of its colour scale.
    pub ends: Ends,
    /// The value of a node; `None` where it has none, as a leaf has no overlap of children, or where it is not known.
    pub get: fn(&NodeReading<'_>, u32) -> Option<f32>,
}

/// How a metric is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A fraction, in percent.
    Share,
    /// A ratio: "3.2 ×".
    Ratio,
    /// A whole number.
    Count,
}

impl Form {
    /// The value by which a container is coloured whose node has none.
    pub const fn neutral(self) -> f32 {
        match self {
            Self::Share | Self::Count => 0.0,
            Self::Ratio => 1.0,
        }
    }
}

/// The data that a metric is computed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The tree and its statistics.
    Tree,
    /// Counts of primitives below each node.
    Counts,
    /// Visits, once they are measured.
    Visits,
    /// Savings from rebuilding subtrees, which takes seconds.
    Regrets,
    /// Areas of the nodes when they were built, of a tree that was kept or fitted since.
    BuiltAreas,
}

/// How places on a colour scale follow the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// In proportion.
    Linear,
    /// By their square root, for depths: the few nodes above differ most.
    SquareRoot,
    /// By their logarithm, for values that span several powers of ten.
    Logarithmic,
}

/// Ends of a colour scale.
#[derive(Debug, Clone, Copy)]
pub enum Ends {
    /// The same for every tree.
    Fixed(f32, f32),
    /// From 0 to the largest value, at least 1.
    UpToLargest,
    /// From 0 to a number of the whole tree.
    OfTree(fn(&TreeStats) -> f32),
    /// Smallest and largest value; smaller ones count as this one.
    Fitting(f32),
}

impl Metric {
    /// It has this name, or had it in an earlier version.
    pub fn is_named(&self, name: &str) -> bool {
        self.key == name || self.former_keys.contains(&name)
    }
}

impl PartialEq for Metric {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for Metric {}

impl std::hash::Hash for Metric {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key.hash(state);
    }
}

impl Serialize for Metric {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key)
    }
}

impl<'de> Deserialize<'de> for &'static Metric {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        let found = METRICS.into_iter().find(|metric| metric.is_named(&key));
        found.ok_or_else(|| serde::de::Error::custom(format!("no metric of nodes is named '{key}'")))
    }
}

/// All metrics, in the order of menus.
pub const METRICS: [&Metric; 10] =
    [REGRET, GAIN, COST, OVERLAP, EMPTY_SPACE, GROWTH, VISIT_RATIO, AREA, PRIMITIVES, DEPTH];
/// The metrics by which a node can be bad.
pub const RANKED: [&Metric; 6] = [REGRET, COST, OVERLAP, EMPTY_SPACE, GROWTH, VISIT_RATIO];

/// Contribution of the node to the SAH cost of the tree, 0 to 1; see [`node_metrics::sah_share`].
pub const COST: &Metric = &Metric {
    key: "cost",
    former_keys: &[],
    label: "SAH cost",
    quantity: "Share of the SAH cost",
    meaning: "Contribution of the node alone to the SAH cost of the tree: area / root's area × (1 traversal step, or 1 test for \
              each triangle of a leaf)",
    term: Some(terms::SAH_COST),
    form: Form::Share,
    source: Source::Tree,
    scale: Scale::Logarithmic,
    ends: Ends::Fitting(0.0),
    get: |nodes, node| with_tree!(nodes.tree, tree => Some(node_metrics::sah_share(tree, node, nodes.stats))),
};

/// Surface area of the node over that when it was built, in a tree that follows a model that moves and keeps its nodes.
pub const GROWTH: &Metric = &Metric {
    key: "growth",
    label: "Area growth",
    quantity: "Area over that when built",
    meaning: "Surface area of the node now over that when the tree was built: where motion hurts. Known of trees that are kept or fitted \
              while the model moves",
    term: None,
    form: Form::Ratio,
    source: Source::BuiltAreas,
    get: |nodes, node| {
        let built = *nodes.built_areas?.get(node as usize)?;
        let now = with_tree!(nodes.tree, tree => tree.area(node));
        (built > 0.0).then(|| now / built)
    },
    ..*COST
};

/// Saving from rebuilding the node where that is most of its cost, 0 to 1; see [`Regrets::regret`].
pub const REGRET: &Metric = &Metric {
    key: "regret",
    label: "Regret",
    quantity: "Regret",
    meaning: "How much cheaper the tree would be with this subtree rebuilt, where that is a larger part of its cost than in its \
              children and its parent; elsewhere what its own split costs. Rebuilt by binned SAH, of up to 500 triangles by exact \
              clustering too",
    term: Some(terms::REGRET),
    source: Source::Regrets,
    ends: Ends::Fitting(LEAST_REGRET),
    get: |nodes, node| nodes.regrets?.regret(node),
    ..*COST
};

/// Saving from rebuilding the whole subtree, 0 to 1; see [`Regrets::gain`].
pub const GAIN: &Metric = &Metric {
    key: "gain",
    label: "Gain",
    quantity: "Gain from rebuilding",
    meaning: "How much cheaper the tree would be with this subtree rebuilt",
    get: |nodes, node| nodes.regrets?.gain(node),
    ..*REGRET
};

/// Overlap of the children, of two 0 to 1; see [`node_metrics::overlap`].
pub const OVERLAP: &Metric = &Metric {
    key: "overlap",
    label: "Overlap",
    quantity: "Overlap of the children",
    meaning: "Surface of what both children have in common, over the node's own: rays there must visit both. Of more than two, the \
              sum over all pairs",
    term: Some(terms::OVERLAP),
    scale: Scale::Linear,
    // Pairs of more than two children add up beyond 1.
    ends: Ends::UpToLargest,
    get: |nodes, node| with_tree!(nodes.tree, tree => node_metrics::overlap(tree, node)),
    ..*COST
};

/// Part that the children leave empty, 0 to 1; see [`node_metrics::empty_space`].
pub const EMPTY_SPACE: &Metric = &Metric {
    key: "empty-space",
    former_keys: &["empty_space"],
    label: "Empty space",
    quantity: "Part that the children leave empty",
    meaning: "Part of the node that its children leave empty: 1 − (areas of the children) / (their number × own area)",
    term: None,
    scale: Scale::Linear,
    ends: Ends::Fixed(0.0, 1.0),
    get: |nodes, node| with_tree!(nodes.tree, tree => node_metrics::empty_space(tree, node)),
    ..*COST
};

/// Measured over predicted visits; see [`Visits::predicted`].
pub const VISIT_RATIO: &Metric = &Metric {
    key: "visit-ratio",
    former_keys: &["visit_ratio"],
    label: "Visits ÷ predicted",
    quantity: "Visits over those predicted",
    meaning: "Visits by the chosen rays, over those that its area predicts (area / root's area × rays that hit the root): the part \
              that the SAH does not know",
    term: None,
    form: Form::Ratio,
    source: Source::Visits,
    ends: Ends::Fixed(0.125, 8.0),
    get: |nodes, node| {
        let (measured, predicted) = nodes.visits(node)?;
        (predicted >= LEAST_PREDICTED_VISITS).then(|| (f64::from(measured) / predicted) as f32)
    },
    ..*COST
};

/// Surface area over the root's, 0 to 1; see [`node_metrics::area_share`].
pub const AREA: &Metric = &Metric {
    key: "area",
    former_keys: &["size"],
    label: "Area",
    quantity: "Area over the root's",
    meaning: "Surface area over the root's: how likely a ray that hits the root hits the node",
    term: Some(terms::AREA_SHARE),
    get: |nodes, node| with_tree!(nodes.tree, tree => Some(node_metrics::area_share(tree, node))),
    ..*COST
};

/// Primitives below the node.
pub const PRIMITIVES: &Metric = &Metric {
    key: "primitives",
    label: "Triangles",
    quantity: "Triangles below",
    meaning: "Triangles below the node: where the model is dense",
    term: Some(terms::NODE),
    form: Form::Count,
    source: Source::Counts,
    get: |nodes, node| {
        let leaf = with_tree!(nodes.tree, tree => {
            let own = &tree.nodes[node as usize];
            own.is_leaf().then_some(own.count)
        });
        let below = || Some(nodes.ancestry?.primitive_counts[node as usize]);
        leaf.or_else(below).map(|count| count as f32)
    },
    ..*COST
};

/// Levels below the root.
pub const DEPTH: &Metric = &Metric {
    key: "depth",
    label: "Depth",
    quantity: "Depth",
    meaning: "Levels below the root, which has depth 0",
    term: Some(terms::DEPTH),
    form: Form::Count,
    scale: Scale::SquareRoot,
    ends: Ends::OfTree(|stats| stats.max_depth.max(1) as f32),
    get: |nodes, node| {
        let depth = nodes.depth.or_else(|| Some(nodes.ancestry?.depth(node)));
        depth.map(|depth| depth as f32)
    },
    ..*COST
};
