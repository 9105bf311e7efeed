//! Which containers are drawn, and how.

use bvhscope_engine::tree::ContainerKind;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::container_set::ContainerSet;
use crate::catalog::metrics::{self, METRICS, Metric, Source};

/// The quantity that the colour of a container encodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorBy {
    /// A number of the node.
    Metric(&'static Metric),
    /// Whether another tree has a node of the same triangles.
    Survival,
    /// Which planes an oriented box lies between.
    Planes,
}

impl ColorBy {
    /// Depth in the tree.
    pub const DEPTH: Self = Self::Metric(metrics::DEPTH);
    /// All quantities, in the order of menus.
    pub const ALL: [Self; METRICS.len() + 2] = {
        let mut all = [Self::Planes; METRICS.len() + 2];
        let mut at = 0;
        while at < METRICS.len() {
            all[at] = Self::Metric(METRICS[at]);
            at += 1;
        }
        all[at] = Self::Survival;
        all
    };

    /// The name on the command line and in saved settings.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metric(metric) => metric.key,
            Self::Survival => "survival",
            Self::Planes => "planes",
        }
    }

    /// Names in earlier versions, which are still read.
    pub const fn former_names(self) -> &'static [&'static str] {
        match self {
            Self::Metric(metric) => metric.former_keys,
            Self::Survival | Self::Planes => &[],
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Metric(metric) => metric.label,
            Self::Survival => "Survival",
            Self::Planes => "Planes",
        }
    }

    /// Its meaning, in one sentence.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Metric(metric) => metric.meaning,
            Self::Survival => {
                "Whether tree B has a node of the same triangles too; without a B, whether the tree had it before its passes"
            }
            Self::Planes => "Whether an oriented box is a plain one, turned to fit or skewed: see the pass Orient",
        }
    }

    /// The data of one tree that it needs.
    pub const fn source(self) -> Source {
        match self {
            Self::Metric(metric) => metric.source,
            Self::Survival | Self::Planes => Source::Tree,
        }
    }
}

impl Serialize for ColorBy {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for ColorBy {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let is_named = |color: &Self| color.name() == name || color.former_names().contains(&name.as_str());
        let found = Self::ALL.into_iter().find(is_named);
        found.ok_or_else(|| serde::de::Error::custom(format!("no colour of containers is named '{name}'")))
    }
}

/// Which containers are drawn, and how. Fields that a saved file lacks have their defaults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a check box of its own")]
pub struct OverlaySettings {
    /// Draws the kind of container that the tree is made of, whatever `containers` says.
    pub follows_tree: bool,
    /// The kinds of containers that are drawn; oriented boxes of a tree that has none are plain ones.
    #[serde(flatten)]
    pub containers: ContainerSet,
    /// First and last depth drawn, root 0, as the user chose them; clamped to the tree only where it is drawn. `None` for the
    /// range that suits the tree, see [`NodeTable::automatic_depths`](super::NodeTable::automatic_depths).
    pub depth: Option<[u32; 2]>,
    /// Draws only the leaves of the depth range.
    pub leaves_only: bool,
    /// Draws all levels above the depth range too.
    pub parents: bool,
    /// The quantity that colours encode.
    pub color_by: ColorBy,
    /// Opacity of lines behind the surface, 0 to 1.
    pub hidden_alpha: f32,
    /// Width of lines in points.
    pub line_width: f32,
    /// The triangles below hidden nodes are left out of the picture too.
    pub hide_triangles: bool,
    /// Fills the sides of containers that face the viewer, faintly.
    pub faces: bool,
    /// Fills the volume that children of the selected node have in common, visible through the surface.
    pub overlap: bool,
    /// Maximum number of containers drawn of each kind; the largest are kept. `None` for what the graphics adapter bears.
    pub budget: Option<u32>,
}

impl Default for OverlaySettings {
    fn default() -> Self {
        Self {
            follows_tree: true,
            containers: ContainerSet::of(ContainerKind::Aabb),
            depth: None,
            leaves_only: false,
            parents: false,
            color_by: ColorBy::DEPTH,
            hidden_alpha: 0.15,
            line_width: 1.25,
            hide_triangles: true,
            faces: false,
            overlap: false,
            budget: None,
        }
    }
}

impl OverlaySettings {
    /// The automatic budget of a graphics processor, and of a single picture.
    pub const BUDGET: u32 = 250_000;
    /// The automatic budget of a software renderer that draws many pictures a second.
    pub const SOFTWARE_BUDGET: u32 = 100_000;

    /// Maximum number of containers drawn of each kind.
    pub fn at_most(&self) -> u32 {
        self.budget.unwrap_or(Self::BUDGET)
    }

    /// Of the leaves of all depths only the largest are drawn, as many as suit the tree.
    pub fn takes_largest_leaves(&self) -> bool {
        self.leaves_only && self.depth.is_none()
    }

    /// The kinds that are drawn of a tree of `kind`.
    pub const fn kinds(&self, kind: ContainerKind) -> ContainerSet {
        if self.follows_tree { ContainerSet::of(kind) } else { self.containers }
    }

    /// These settings with the kinds that are drawn chosen by hand.
    #[must_use]
    pub const fn with_kinds(self, containers: ContainerSet) -> Self {
        Self { follows_tree: false, containers, ..self }
    }

    /// These settings with the kinds that are drawn of a tree of `kind` spelt out.
    #[must_use]
    pub fn spelt_out(&self, kind: ContainerKind) -> Self {
        self.with_kinds(self.kinds(kind))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn settings_of_older_versions_load() {
        let old = r#"{"show_boxes":false,"show_spheres":true,"depth":[2,5],"leaves_only":true,"parents":false,
            "color_by":"size","hidden_alpha":0.5,"line_width":2.0,"budget":123}"#;
        let settings: OverlaySettings = serde_json::from_str(old).unwrap();
        assert_eq!((settings.depth, settings.budget), (Some([2, 5]), Some(123)));
        assert_eq!(
            (settings.leaves_only, settings.color_by, settings.follows_tree),
            (true, ColorBy::Metric(metrics::AREA), true)
        );
        assert_eq!(settings.containers, ContainerSet::of(ContainerKind::Sphere));
        let settings: OverlaySettings = serde_json::from_str(r#"{"follows_tree":false,"show_dops":true}"#).unwrap();
        assert_eq!(settings.containers, ContainerSet::of(ContainerKind::Aabb).with(ContainerKind::Dop14));
    }

    #[test]
    fn colours_of_older_versions_are_read() {
        let names = ["depth", "size", "overlap", "primitives", "regret", "survival", "growth", "planes"];
        let now = ["depth", "area", "overlap", "primitives", "regret", "survival", "growth", "planes"];
        for (old, new) in names.into_iter().zip(now) {
            let read: ColorBy = serde_json::from_value(old.into()).unwrap();
            assert_eq!(serde_json::to_value(read).unwrap(), new, "{old}");
        }
        // Names of metrics in views.
        for (old, new) in [("empty_space", "empty-space"), ("visit_ratio", "visit-ratio")] {
            let read: &Metric = serde_json::from_value(old.into()).unwrap();
            assert_eq!(read.key, new);
        }
        assert!(serde_json::from_str::<ColorBy>("\"colour\"").is_err());
    }

    #[test]
    fn the_kind_follows_the_tree_until_it_is_chosen() {
        let mut settings = OverlaySettings::default();
        let kinds = |settings: OverlaySettings| ContainerKind::WITH_ORIENTED.map(|kind| settings.kinds(kind));
        assert_eq!(kinds(settings), ContainerKind::WITH_ORIENTED.map(ContainerSet::of));
        settings.follows_tree = false;
        assert_eq!(kinds(settings), [ContainerSet::of(ContainerKind::Aabb); 4]);
    }
}
