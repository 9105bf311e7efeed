//! Which containers are drawn, and how.

use bvhscope_engine::tree::ContainerKind;
use serde::{Deserialize, Serialize};

/// The quantity that the colour of a container encodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u32)]
pub enum ColorBy {
    /// Depth in the tree.
    Depth = 0,
    /// Surface area relative to the root's, logarithmic.
    Size = 1,
    /// Overlap of the children as a fraction of the node's own area.
    Overlap = 2,
    /// Number of primitives in the subtree, logarithmic.
    Primitives = 3,
    /// Regret of the node, logarithmic.
    Regret = 4,
    /// Whether another tree has a node of the same triangles.
    Survival = 5,
    /// Surface area now over that when the tree was built, logarithmic.
    Growth = 6,
    /// Which planes an oriented box lies between.
    Planes = 7,
}

impl ColorBy {
    /// All quantities, in the order of menus.
    pub const ALL: [Self; 8] = [
        Self::Depth,
        Self::Size,
        Self::Overlap,
        Self::Primitives,
        Self::Regret,
        Self::Survival,
        Self::Growth,
        Self::Planes,
    ];
    /// Those that need neither another tree nor another moment.
    pub const OF_ONE_TREE: [Self; 6] =
        [Self::Depth, Self::Size, Self::Overlap, Self::Primitives, Self::Regret, Self::Planes];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Size => "size",
            Self::Overlap => "overlap",
            Self::Primitives => "primitives",
            Self::Regret => "regret",
            Self::Survival => "survival",
            Self::Growth => "growth",
            Self::Planes => "planes",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Depth => "Depth",
            Self::Size => "Size",
            Self::Overlap => "Overlap",
            Self::Primitives => "Primitives",
            Self::Regret => "Regret",
            Self::Survival => "Survival",
            Self::Growth => "Growth",
            Self::Planes => "Planes",
        }
    }
}

/// Which kinds of containers are drawn over the picture, as one choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OverlayKinds {
    /// Boxes.
    Box,
    /// Spheres.
    Sphere,
    /// Polytopes.
    Dop,
    /// Boxes and spheres.
    Both,
    /// Boxes and polytopes.
    BoxDop,
    /// Spheres and polytopes.
    SphereDop,
    /// Boxes, spheres and polytopes.
    All,
    /// Oriented boxes.
    Oriented,
    /// Plain boxes and oriented ones.
    BoxOriented,
    /// None; highlighted nodes are still drawn.
    None,
}

impl OverlayKinds {
    /// All choices.
    pub const ALL: [Self; 10] = [
        Self::Box,
        Self::Sphere,
        Self::Dop,
        Self::Both,
        Self::BoxDop,
        Self::SphereDop,
        Self::All,
        Self::Oriented,
        Self::BoxOriented,
        Self::None,
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Sphere => "sphere",
            Self::Dop => "dop",
            Self::Both => "both",
            Self::BoxDop => "box-dop",
            Self::SphereDop => "sphere-dop",
            Self::All => "all",
            Self::Oriented => "oriented",
            Self::BoxOriented => "box-oriented",
            Self::None => "none",
        }
    }

    /// True for each of [`ContainerKind::WITH_ORIENTED`] that is drawn.
    pub const fn shown(self) -> [bool; 4] {
        [
            matches!(self, Self::Box | Self::Both | Self::BoxDop | Self::All | Self::BoxOriented),
            matches!(self, Self::Sphere | Self::Both | Self::SphereDop | Self::All),
            matches!(self, Self::Dop | Self::BoxDop | Self::SphereDop | Self::All),
            matches!(self, Self::Oriented | Self::BoxOriented),
        ]
    }
}

/// Which containers are drawn, and how. Fields that a saved file lacks have their defaults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a check box of its own")]
pub struct OverlaySettings {
    /// Draws the kind of container that the tree is made of, whatever the next four say.
    pub follows_tree: bool,
    /// Draws boxes.
    pub show_boxes: bool,
    /// Draws spheres.
    pub show_spheres: bool,
    /// Draws polytopes.
    pub show_dops: bool,
    /// Draws oriented boxes; plain ones of a tree that has none.
    pub show_oriented: bool,
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
            show_boxes: true,
            show_spheres: false,
            show_dops: false,
            show_oriented: false,
            depth: None,
            leaves_only: false,
            parents: false,
            color_by: ColorBy::Depth,
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

    /// For a tree of `kind`: true for each of [`ContainerKind::WITH_ORIENTED`] that is drawn.
    pub fn kinds(&self, kind: ContainerKind) -> [bool; 4] {
        if self.follows_tree {
            ContainerKind::WITH_ORIENTED.map(|own| own == kind)
        } else {
            [self.show_boxes, self.show_spheres, self.show_dops, self.show_oriented]
        }
    }

    /// These settings with the kinds that are drawn chosen by hand, in the order of [`ContainerKind::WITH_ORIENTED`].
    #[must_use]
    pub const fn with_kinds(self, [show_boxes, show_spheres, show_dops, show_oriented]: [bool; 4]) -> Self {
        Self { follows_tree: false, show_boxes, show_spheres, show_dops, show_oriented, ..self }
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
        assert_eq!((settings.leaves_only, settings.color_by, settings.follows_tree), (true, ColorBy::Size, true));
    }

    #[test]
    fn the_kind_follows_the_tree_until_it_is_chosen() {
        let mut settings = OverlaySettings::default();
        let each = [0, 1, 2, 3].map(|own| [0, 1, 2, 3].map(|kind| kind == own));
        assert_eq!(ContainerKind::WITH_ORIENTED.map(|kind| settings.kinds(kind)), each);
        settings.follows_tree = false;
        assert_eq!(ContainerKind::WITH_ORIENTED.map(|kind| settings.kinds(kind)), [each[0]; 4]);
    }

    #[test]
    fn every_choice_of_kinds_has_a_name() {
        for choice in 0..8 {
            let kinds = [0, 1, 2, 3].map(|bit| choice >> bit & 1 == 1);
            assert_eq!(OverlayKinds::ALL.iter().filter(|named| named.shown() == kinds).count(), 1, "{kinds:?}");
        }
    }
}
