//! What a tree is built with.

use crate::tree::ContainerKind;

/// How the tree is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum BuilderKind {
    /// Approximate agglomerative clustering (Gu et al., HPG 2013).
    Aac,
    /// Median split by Morton code (Lauterbach et al., 2009): "LBVH".
    Lbvh,
    /// Top-down splits by the surface area heuristic over bins (Wald, 2007). Boxes only.
    BinnedSah,
    /// Exact agglomerative clustering (Walter et al., 2008): always the globally closest pair. Small scenes only.
    Exact,
    /// No hierarchy: every ray tests every triangle.
    None,
}

impl BuilderKind {
    /// Every builder, in the order in which menus list them.
    pub const ALL: [Self; 5] = [Self::Aac, Self::Lbvh, Self::BinnedSah, Self::Exact, Self::None];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aac => "aac",
            Self::Lbvh => "lbvh",
            Self::BinnedSah => "binned-sah",
            Self::Exact => "exact",
            Self::None => "none",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aac => "AAC",
            Self::Lbvh => "LBVH (Morton)",
            Self::BinnedSah => "Binned SAH",
            Self::Exact => "Exact agglomerative",
            Self::None => "No BVH",
        }
    }
}

/// The line through space along which primitives are sorted before they are clustered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Curve {
    /// Morton's: the bits of the three axes in turn (1966). The paper's.
    #[default]
    Morton,
    /// Hilbert's, on which neighbours always touch (1891).
    Hilbert,
    /// Morton's with the bits of the primitives' size as a fourth axis (Vinkler, Bittner, Havran, 2017).
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
            Self::Extended => "Morton and size",
        }
    }
}

/// Work beside the builder's own that makes a tree better. Passes over the finished tree never raise its SAH cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Pass {
    /// Before anything is built, large triangles go into several boxes (Ernst and Greiner, 2007; Karras and Aila, 2013). Several
    /// leaves can hold the same triangle then. Boxes only, and not where there is nothing to choose: exact or no clustering.
    Split,
    /// Subtrees become leaves where that is cheaper (Goldsmith and Salmon, 1987).
    Collapse,
    /// Treelets are built again from the top by the surface area heuristic and kept where they are cheaper. Boxes only.
    Restructure,
    /// Subtrees move to where they cost less (Meister and Bittner, 2018). Boxes only.
    Reinsert,
}

impl Pass {
    /// Every pass, in the order in which they run.
    pub const ALL: [Self; 4] = [Self::Split, Self::Collapse, Self::Restructure, Self::Reinsert];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::Restructure => "restructure",
            Self::Reinsert => "reinsert",
            Self::Collapse => "collapse",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Split => "Split",
            Self::Restructure => "Restructure",
            Self::Reinsert => "Reinsert",
            Self::Collapse => "Collapse",
        }
    }

    /// Whether it is for boxes only: it needs unions that do not depend on the order of what is united.
    pub const fn boxes_only(self) -> bool {
        !matches!(self, Self::Collapse)
    }
}

/// Which passes run. In JSON the list of their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Vec<Pass>", into = "Vec<Pass>")
)]
pub struct Passes(u8);

impl Passes {
    /// No pass: the tree stays as the builder made it.
    pub const NONE: Self = Self(0);
    /// Every pass over the finished tree.
    pub const FINISHED: Self = Self::NONE.with(Pass::Collapse).with(Pass::Restructure).with(Pass::Reinsert);
    /// Every pass.
    pub const ALL: Self = Self::FINISHED.with(Pass::Split);

    /// With `pass` on top.
    #[must_use]
    pub const fn with(self, pass: Pass) -> Self {
        Self(self.0 | 1 << pass as u8)
    }

    /// Without `pass`.
    #[must_use]
    pub const fn without(self, pass: Pass) -> Self {
        Self(self.0 & !(1 << pass as u8))
    }

    /// Whether `pass` runs.
    pub const fn contains(self, pass: Pass) -> bool {
        self.0 >> pass as u8 & 1 == 1
    }

    /// The passes that run, in their order.
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

/// The names with commas between; "none" where there is none.
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
    /// Which algorithm.
    pub builder: BuilderKind,
    /// Boxes or spheres around the primitives.
    pub container: ContainerKind,
    /// δ, the traversal stopping threshold in primitives: fewer than δ are clustered, not split. 2 to 64; larger is
    /// slower to build and gives a better tree. AAC only.
    pub threshold: u32,
    /// ε of the reduction function f(x) = ½·δ^(½+ε)·x^(½−ε). 0 to 0.5; smaller keeps more clusters, slower and better. AAC only.
    pub epsilon: f32,
    /// Along which line primitives are sorted. AAC and LBVH only.
    #[cfg_attr(feature = "serde", serde(default))]
    pub curve: Curve,
    /// What is done to make it better; see [`BuildSettings::passes`].
    #[cfg_attr(feature = "serde", serde(default))]
    pub optimize: Passes,
}

/// Named settings of the agglomerative builder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Preset {
    /// Threshold 6, ε 0.2: the paper's fast setting.
    Fast,
    /// Threshold 12, ε 0.1: the paper's good setting.
    Hq,
    /// Threshold 4, ε 0.2: Gu et al.'s AAC-Fast.
    AacFast,
    /// Threshold 20, ε 0.1: Gu et al.'s AAC-HQ.
    AacHq,
    /// The paper's fast setting and every pass over the finished tree.
    Best,
}

impl Preset {
    /// Every preset, in the order in which they are offered.
    pub const ALL: [Self; 5] = [Self::Fast, Self::Hq, Self::AacFast, Self::AacHq, Self::Best];

    /// Threshold and ε.
    pub const fn parameters(self) -> (u32, f32) {
        match self {
            Self::Fast | Self::Best => (6, 0.2),
            Self::Hq => (12, 0.1),
            Self::AacFast => (4, 0.2),
            Self::AacHq => (20, 0.1),
        }
    }

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Hq => "hq",
            Self::AacFast => "aac-fast",
            Self::AacHq => "aac-hq",
            Self::Best => "best",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Fast => "Fast",
            Self::Hq => "HQ",
            Self::AacFast => "AAC-Fast",
            Self::AacHq => "AAC-HQ",
            Self::Best => "Best",
        }
    }

    /// What is done to the finished tree.
    pub const fn passes(self) -> Passes {
        if matches!(self, Self::Best) { Passes::FINISHED } else { Passes::NONE }
    }
}

impl BuildSettings {
    /// Smallest threshold that can be set.
    pub const MIN_THRESHOLD: u32 = 2;
    /// Largest threshold that can be set.
    pub const MAX_THRESHOLD: u32 = 64;
    /// Largest ε that can be set.
    pub const MAX_EPSILON: f32 = 0.5;
    /// Exact agglomerative clustering takes quadratic time: it refuses more primitives than this.
    pub const MAX_EXACT_PRIMITIVES: usize = 20_000;

    /// AAC with a preset's parameters.
    pub const fn preset(preset: Preset, container: ContainerKind) -> Self {
        let (threshold, epsilon) = preset.parameters();
        Self {
            builder: BuilderKind::Aac,
            container,
            threshold,
            epsilon,
            curve: Curve::Morton,
            optimize: preset.passes(),
        }
    }

    /// Why these settings cannot build `primitive_count` triangles; `None` where they can.
    pub fn refusal(&self, primitive_count: usize) -> Option<String> {
        match self.builder {
            BuilderKind::BinnedSah if self.container == ContainerKind::Sphere => {
                Some("the binned SAH builder makes boxes only: choose the box container".to_owned())
            }
            BuilderKind::Exact if primitive_count > Self::MAX_EXACT_PRIMITIVES => Some(format!(
                "exact clustering takes quadratic time: it builds at most {} triangles, this scene has {primitive_count}",
                Self::MAX_EXACT_PRIMITIVES
            )),
            _ => None,
        }
    }

    /// The passes that run: of those in `optimize` the ones that container and builder allow.
    pub fn passes(&self) -> Passes {
        let splits = !matches!(self.builder, BuilderKind::Exact | BuilderKind::None);
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
