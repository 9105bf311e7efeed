//! Settings that decide which tree is built: builder, container, parameters, curve and passes, with named presets.

use crate::tree::ContainerKind;

/// The algorithm that builds the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum BuilderKind {
    /// Approximate agglomerative clustering (Gu et al., HPG 2013).
    Aac,
    /// Approximate agglomerative clustering of leaf blocks: leaves of up to four neighbours along the curve, which are joined first,
    /// for a faster build.
    Swift,
    /// Linear BVH: splits where the highest differing bit of the Morton codes flips (Lauterbach et al., 2009).
    Lbvh,
    /// Top-down splits by the surface area heuristic, estimated at bin boundaries (Wald, 2007). Not with spheres.
    BinnedSah,
    /// Top-down splits by the surface area heuristic, each the best of all along the three axes (Wald, 2007). Not with spheres.
    Sweep,
    /// Top-down splits by the surface area heuristic, of the list of triangles as by [`BuilderKind::Sweep`] or of space by a plane: then
    /// several leaves can refer to the same triangle (Stich et al., 2009: spatial splits in bounding volume hierarchies). Boxes only.
    Sbvh,
    /// Parallel locally-ordered clustering: merges mutual nearest neighbours along the curve, round by round (Meister and Bittner, 2018).
    Ploc,
    /// Hierarchical PLOC: the same on short lists, those of the nodes of an LBVH (Benthin et al., 2024).
    Hploc,
    /// Exact agglomerative clustering (Walter et al., 2008): always merges the globally closest pair. Small scenes only.
    Exact,
    /// No hierarchy: one leaf, so that every ray tests every triangle.
    None,
}

impl BuilderKind {
    /// Every builder, in the order in which menus list them.
    pub const ALL: [Self; 10] = [
        Self::Aac,
        Self::Swift,
        Self::Lbvh,
        Self::Ploc,
        Self::Hploc,
        Self::BinnedSah,
        Self::Sweep,
        Self::Sbvh,
        Self::Exact,
        Self::None,
    ];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aac => "aac",
            Self::Swift => "swift",
            Self::Lbvh => "lbvh",
            Self::Ploc => "ploc",
            Self::Hploc => "hploc",
            Self::BinnedSah => "binned-sah",
            Self::Sweep => "sweep",
            Self::Sbvh => "sbvh",
            Self::Exact => "exact",
            Self::None => "none",
        }
    }

    /// True if it clusters by the threshold and exponent of [`BuildSettings`].
    pub const fn is_aac(self) -> bool {
        matches!(self, Self::Aac | Self::Swift)
    }

    /// True if it sorts primitives along the curve of [`BuildSettings`].
    pub const fn sorts_along_curve(self) -> bool {
        matches!(self, Self::Aac | Self::Swift | Self::Lbvh | Self::Ploc | Self::Hploc)
    }

    /// True if it works on triangles themselves, which it cuts, not only on their containers.
    pub const fn needs_triangles(self) -> bool {
        matches!(self, Self::Sbvh)
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aac => "AAC",
            Self::Swift => "AAC of leaf blocks",
            Self::Lbvh => "LBVH (Morton)",
            Self::Ploc => "PLOC",
            Self::Hploc => "H-PLOC",
            Self::BinnedSah => "Binned SAH",
            Self::Sweep => "Sweep SAH",
            Self::Sbvh => "SBVH",
            Self::Exact => "Exact agglomerative",
            Self::None => "No BVH",
        }
    }
}

/// The space-filling curve along which primitives are sorted before they are clustered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Curve {
    /// Morton curve: interleaves the bits of the three axes (1966). The paper's.
    #[default]
    Morton,
    /// Hilbert curve, along which successive cells are always adjacent (1891).
    Hilbert,
    /// Extended Morton codes: the primitive's size as a fourth axis (Vinkler, Bittner, Havran, 2017).
    Extended,
}

impl Curve {
    /// Every curve, in the order in which menus list them.
    pub const ALL: [Self; 3] = [Self::Morton, Self::Hilbert, Self::Extended];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Morton => "morton",
            Self::Hilbert => "hilbert",
            Self::Extended => "extended",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Morton => "Morton",
            Self::Hilbert => "Hilbert",
            Self::Extended => "Extended Morton",
        }
    }
}

/// An optimization beside the builder's own work. Passes over the finished tree never raise its SAH cost, except that costs of
/// oriented boxes do not compare with those of others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Pass {
    /// Before the build, splits the boxes of large triangles (Ernst and Greiner, 2007; Karras and Aila, 2013), so that several
    /// leaves can refer to the same triangle. Boxes only; not with the builders SBVH, which splits them itself, Exact and None.
    Split,
    /// Collapses subtrees into leaves where that lowers the SAH cost (Goldsmith and Salmon, 1987).
    Collapse,
    /// Rebuilds treelets top-down by the surface area heuristic where that lowers the SAH cost. Boxes only.
    Restructure,
    /// Reinserts subtrees where that lowers the SAH cost (Meister and Bittner, 2018). Boxes only.
    Reinsert,
    /// Reinserts every subtree again and again, at first even where that costs a little more, and rebuilds every treelet, in
    /// [`BuildSettings::rounds`] rounds on one thread. Boxes only.
    Anneal,
    /// Gives each node of the finished tree the smallest of its box, of one turned to fit (DiTO-14: Larsson and Källberg, 2011) and of
    /// one skewed to the directions of the 14-DOP (SOBB: Káčerik and Bittner, 2025). Boxes only; the tree is one of
    /// [`ContainerKind::Oriented`] then.
    Orient,
}

impl Pass {
    /// Every pass, in the order in which they run.
    pub const ALL: [Self; 6] =
        [Self::Split, Self::Collapse, Self::Restructure, Self::Reinsert, Self::Anneal, Self::Orient];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::Restructure => "restructure",
            Self::Reinsert => "reinsert",
            Self::Anneal => "anneal",
            Self::Collapse => "collapse",
            Self::Orient => "orient",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Split => "Split",
            Self::Restructure => "Restructure",
            Self::Reinsert => "Reinsert",
            Self::Anneal => "Anneal",
            Self::Collapse => "Collapse",
            Self::Orient => "Orient",
        }
    }

    /// True if it works on boxes only: it needs unions that do not depend on the order of their operands, and kernels of six numbers.
    pub const fn boxes_only(self) -> bool {
        !matches!(self, Self::Collapse)
    }
}

/// Set of passes. Serialized as the list of their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Vec<Pass>", into = "Vec<Pass>")
)]
pub struct Passes(u8);

impl Passes {
    /// No pass: the tree as the builder made it.
    pub const NONE: Self = Self(0);
    /// Every pass over the finished tree but the slow one, annealing.
    pub const FINISHED: Self = Self::NONE.with(Pass::Collapse).with(Pass::Restructure).with(Pass::Reinsert);
    /// Every pass that leaves plain boxes: all but [`Pass::Orient`].
    pub const ALL: Self = Self::FINISHED.with(Pass::Split).with(Pass::Anneal);

    /// This set with `pass`.
    #[must_use]
    pub const fn with(self, pass: Pass) -> Self {
        Self(self.0 | 1 << pass as u8)
    }

    /// This set without `pass`.
    #[must_use]
    pub const fn without(self, pass: Pass) -> Self {
        Self(self.0 & !(1 << pass as u8))
    }

    /// Whether the set contains `pass`.
    pub const fn contains(self, pass: Pass) -> bool {
        self.0 >> pass as u8 & 1 == 1
    }

    /// The passes in the order in which they run.
    pub fn iter(self) -> impl Iterator<Item = Pass> {
        Pass::ALL.into_iter().filter(move |&pass| self.contains(pass))
    }
}

impl From<Vec<Pass>> for Passes {
    fn from(list: Vec<Pass>) -> Self {
        list.into_iter().fold(Self::NONE, Self::with)
    }
}

impl From<Passes> for Vec<Pass> {
    fn from(passes: Passes) -> Self {
        passes.iter().collect()
    }
}

/// The names separated by commas; "none" for the empty set.
impl std::fmt::Display for Passes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<&str> = self.iter().map(Pass::name).collect();
        f.write_str(if names.is_empty() { "none".to_owned() } else { names.join(",") }.as_str())
    }
}

/// Everything that decides which tree is built. Equal settings and triangles give the identical tree, node for node,
/// whatever the number of threads.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BuildSettings {
    /// The algorithm.
    pub builder: BuilderKind,
    /// The bounding volume.
    pub container: ContainerKind,
    /// The traversal stopping threshold δ in primitives: a range of fewer is clustered, not partitioned further. 2 to 64; a higher
    /// threshold gives a better tree and a slower build. AAC and Swift only.
    pub threshold: u32,
    /// The exponent ε of the reduction function f(x) = ½·δ^(½+ε)·x^(½−ε). 0 to 0.5; a lower ε leaves more clusters, for a better
    /// tree and a slower build. AAC and Swift only.
    pub epsilon: f32,
    /// The curve along which primitives are sorted. AAC, Swift, LBVH, PLOC and H-PLOC only.
    #[cfg_attr(feature = "serde", serde(default))]
    pub curve: Curve,
    /// The passes wanted; those that run are [`BuildSettings::passes`].
    #[cfg_attr(feature = "serde", serde(default))]
    pub optimize: Passes,
    /// The number of rounds of the pass Anneal. 1 to 4096; more rounds give a better tree in proportionally more time.
    #[cfg_attr(feature = "serde", serde(default = "BuildSettings::default_rounds"))]
    pub rounds: u32,
}

/// Named parameters of the agglomerative builder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Preset {
    /// The paper's fast setting over leaf blocks of up to four triangles, the fastest build of AAC.
    Swift,
    /// δ 6, ε 0.2: the paper's fast setting.
    Fast,
    /// δ 12, ε 0.1: the paper's high-quality setting.
    Hq,
    /// δ 4, ε 0.2: Gu et al.'s AAC-Fast.
    AacFast,
    /// δ 20, ε 0.1: Gu et al.'s AAC-HQ.
    AacHq,
    /// The paper's fast setting, then collapse, restructuring and reinsertion.
    Best,
    /// The paper's fast setting and every pass: minutes for what Best does in a tenth of a second.
    Finest,
}

impl Preset {
    /// Every preset, in the order in which menus list them.
    pub const ALL: [Self; 7] =
        [Self::Swift, Self::Fast, Self::Hq, Self::AacFast, Self::AacHq, Self::Best, Self::Finest];

    /// The builder.
    pub const fn builder(self) -> BuilderKind {
        match self {
            Self::Swift => BuilderKind::Swift,
            _ => BuilderKind::Aac,
        }
    }

    /// Threshold δ and exponent ε.
    pub const fn parameters(self) -> (u32, f32) {
        match self {
            Self::Swift | Self::Fast | Self::Best | Self::Finest => (6, 0.2),
            Self::Hq => (12, 0.1),
            Self::AacFast => (4, 0.2),
            Self::AacHq => (20, 0.1),
        }
    }

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Swift => "swift",
            Self::Fast => "fast",
            Self::Hq => "hq",
            Self::AacFast => "aac-fast",
            Self::AacHq => "aac-hq",
            Self::Best => "best",
            Self::Finest => "finest",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Swift => "Swift",
            Self::Fast => "Fast",
            Self::Hq => "HQ",
            Self::AacFast => "AAC-Fast",
            Self::AacHq => "AAC-HQ",
            Self::Best => "Best",
            Self::Finest => "Finest",
        }
    }

    /// Passes beside the builder's own work.
    pub const fn passes(self) -> Passes {
        match self {
            Self::Swift | Self::Fast | Self::Hq | Self::AacFast | Self::AacHq => Passes::NONE,
            Self::Best => Passes::FINISHED,
            Self::Finest => Passes::ALL,
        }
    }

    /// Whether a build takes hundreds of times as long as with the other presets.
    pub const fn is_slow(self) -> bool {
        self.passes().contains(Pass::Anneal)
    }
}

impl BuildSettings {
    /// Minimum threshold.
    pub const MIN_THRESHOLD: u32 = 2;
    /// Maximum threshold.
    pub const MAX_THRESHOLD: u32 = 64;
    /// Maximum ε.
    pub const MAX_EPSILON: f32 = 0.5;
    /// Rounds of annealing where nothing else is given.
    pub const DEFAULT_ROUNDS: u32 = 200;
    /// Maximum number of rounds of annealing.
    pub const MAX_ROUNDS: u32 = 4096;
    /// Maximum number of primitives of [`BuilderKind::Exact`], which takes quadratic time.
    pub const MAX_EXACT_PRIMITIVES: usize = 20_000;

    /// Settings with builder and parameters of `preset`.
    ///
    /// ```
    /// use bvhscope_engine::{BuildSettings, ContainerKind, Passes, Preset};
    ///
    /// let settings = BuildSettings::preset(Preset::Best, ContainerKind::Aabb);
    /// assert_eq!((settings.threshold, settings.epsilon), (6, 0.2));
    /// assert_eq!(settings.optimize, Passes::FINISHED);
    /// // A preset is a starting point.
    /// let finer = BuildSettings { threshold: 16, ..settings };
    /// assert!(finer.refusal(1_000_000).is_none());
    /// ```
    pub const fn preset(preset: Preset, container: ContainerKind) -> Self {
        let (threshold, epsilon) = preset.parameters();
        Self {
            builder: preset.builder(),
            container,
            threshold,
            epsilon,
            curve: Curve::Morton,
            optimize: preset.passes(),
            rounds: Self::DEFAULT_ROUNDS,
        }
    }

    /// For settings that were written before there was annealing.
    #[cfg(feature = "serde")]
    const fn default_rounds() -> u32 {
        Self::DEFAULT_ROUNDS
    }

    /// The number of rounds of annealing; `None` where that does not run.
    pub fn annealing_rounds(&self) -> Option<u32> {
        self.passes().contains(Pass::Anneal).then_some(self.rounds)
    }

    /// Why these settings cannot build a tree over `primitive_count` triangles; `None` if they can.
    pub fn refusal(&self, primitive_count: usize) -> Option<String> {
        match self.builder {
            BuilderKind::BinnedSah if self.container == ContainerKind::Sphere => {
                Some("the binned SAH builder makes no spheres: choose boxes or 14-DOPs".to_owned())
            }
            BuilderKind::Sweep if self.container == ContainerKind::Sphere => {
                Some("the sweep SAH builder makes no spheres: choose boxes or 14-DOPs".to_owned())
            }
            _ if self.container == ContainerKind::Oriented => {
                Some(format!("no builder makes oriented boxes: choose boxes and the pass '{}'", Pass::Orient.name()))
            }
            BuilderKind::Sbvh if self.container != ContainerKind::Aabb => {
                Some(format!("the SBVH builder makes no {}: choose boxes", self.container.plural()))
            }
            BuilderKind::Exact if primitive_count > Self::MAX_EXACT_PRIMITIVES => Some(format!(
                "exact clustering takes quadratic time: it builds at most {} triangles, this scene has {primitive_count}",
                Self::MAX_EXACT_PRIMITIVES
            )),
            _ => None,
        }
    }

    /// These settings for trees of `container`: oriented boxes are boxes with the pass that makes them.
    #[must_use]
    pub const fn for_container(self, container: ContainerKind) -> Self {
        match container {
            ContainerKind::Oriented => {
                Self { container: ContainerKind::Aabb, optimize: self.optimize.with(Pass::Orient), ..self }
            }
            _ => Self { container, ..self },
        }
    }

    /// Kind of the containers of the finished tree: those of the builder, or oriented boxes after the pass that makes them.
    pub fn tree_container(&self) -> ContainerKind {
        if self.passes().contains(Pass::Orient) { ContainerKind::Oriented } else { self.container }
    }

    /// The passes that run: those in `optimize` that support the container and the builder.
    pub fn passes(&self) -> Passes {
        let splits = !matches!(self.builder, BuilderKind::Sbvh | BuilderKind::Exact | BuilderKind::None);
        let runs = |pass: &Pass| {
            (self.container == ContainerKind::Aabb || !pass.boxes_only()) && (splits || *pass != Pass::Split)
        };
        self.optimize.iter().filter(runs).fold(Passes::NONE, Passes::with)
    }
}

impl Default for BuildSettings {
    fn default() -> Self {
        Self::preset(Preset::Fast, ContainerKind::Aabb)
    }
}
