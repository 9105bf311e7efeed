//! Which containers are drawn, and how.

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
    /// Overlap with the sibling as a fraction of the node's own area.
    Overlap = 2,
    /// Number of primitives in the subtree, logarithmic.
    Primitives = 3,
}

impl ColorBy {
    /// All quantities, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Depth, Self::Size, Self::Overlap, Self::Primitives];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Size => "size",
            Self::Overlap => "overlap",
            Self::Primitives => "primitives",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Depth => "Depth",
            Self::Size => "Size",
            Self::Overlap => "Overlap",
            Self::Primitives => "Primitives",
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
    /// Both.
    Both,
    /// Neither; highlighted nodes are still drawn.
    None,
}

impl OverlayKinds {
    /// All choices.
    pub const ALL: [Self; 4] = [Self::Box, Self::Sphere, Self::Both, Self::None];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Sphere => "sphere",
            Self::Both => "both",
            Self::None => "none",
        }
    }

    /// Whether boxes and whether spheres are drawn.
    pub const fn shown(self) -> [bool; 2] {
        [matches!(self, Self::Box | Self::Both), matches!(self, Self::Sphere | Self::Both)]
    }
}

/// Which containers are drawn, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a check box of its own")]
pub struct OverlaySettings {
    /// Draws boxes.
    pub show_boxes: bool,
    /// Draws spheres.
    pub show_spheres: bool,
    /// First and last depth drawn, root 0; clamped to the tree.
    pub depth: [u32; 2],
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
    /// Maximum number of containers drawn of each kind; the largest are kept.
    pub budget: u32,
}

impl Default for OverlaySettings {
    fn default() -> Self {
        Self {
            show_boxes: true,
            show_spheres: false,
            depth: [4, 6],
            leaves_only: false,
            parents: false,
            color_by: ColorBy::Depth,
            hidden_alpha: 0.15,
            line_width: 1.25,
            budget: 4_000,
        }
    }
}
