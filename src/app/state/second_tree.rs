//! A second tree B of the same scene, beside the tree A, and how the two are shown.

use serde::{Deserialize, Serialize};

use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;

/// One of the two trees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum TreeSide {
    /// The tree that is always there.
    #[default]
    A,
    /// The tree that it is compared with.
    B,
}

impl TreeSide {
    /// Both trees.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// The letter in the window.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// View of two trees in the viewport.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum CompareView {
    /// The picture through A.
    A,
    /// The picture through B.
    B,
    /// A left of the seam, B right of it.
    #[default]
    Split,
    /// The tests of B minus those of A, pixel by pixel.
    Difference,
}

impl CompareView {
    /// All views, in the order of menus.
    pub const ALL: [Self; 4] = [Self::A, Self::B, Self::Split, Self::Difference];

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::Split => "Split",
            Self::Difference => "Difference",
        }
    }

    /// Whether the containers of a tree are drawn in this view.
    pub const fn shows(self, side: TreeSide) -> bool {
        match side {
            TreeSide::A => !matches!(self, Self::B),
            TreeSide::B => matches!(self, Self::B | Self::Split),
        }
    }

    /// The view after this one, the first after the last.
    #[must_use]
    pub fn next(self) -> Self {
        let place = Self::ALL.iter().position(|&view| view == self).map_or(0, |place| place + 1);
        Self::ALL[place % Self::ALL.len()]
    }
}

/// The second tree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SecondTree {
    /// How it is built; everything else is shared with the first tree.
    pub build: BuildSettings,
    /// How it follows a model that moves.
    #[serde(default = "SecondTree::rebuilt")]
    pub policy: Policy,
    /// View of the two in the viewport.
    #[serde(default)]
    pub view: CompareView,
    /// Where the seam of [`CompareView::Split`] lies, as a fraction of the viewport's width from the left.
    #[serde(default = "SecondTree::middle")]
    pub seam: f32,
    /// Containers of A are drawn only where B has a node of the same triangles.
    #[serde(default)]
    pub only_common: bool,
    /// Containers are drawn over [`CompareView::Difference`], whose colours they would hide.
    #[serde(default)]
    pub over_difference: bool,
}

impl SecondTree {
    /// The least part of the viewport's width on either side of the seam.
    pub const SEAM_MARGIN: f32 = 0.02;

    /// A second tree with the settings of the first, in the split view.
    pub const fn new(build: BuildSettings) -> Self {
        Self {
            build,
            policy: Policy::Rebuild,
            view: CompareView::Split,
            seam: 0.5,
            only_common: false,
            over_difference: false,
        }
    }

    const fn rebuilt() -> Policy {
        Policy::Rebuild
    }

    const fn middle() -> f32 {
        0.5
    }

    /// Moves the seam to `position`, which is limited to where both sides are in view.
    pub fn move_seam(&mut self, position: f32) {
        let position = if position.is_finite() { position } else { Self::middle() };
        self.seam = position.clamp(Self::SEAM_MARGIN, 1.0 - Self::SEAM_MARGIN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seam_leaves_both_sides_in_view() {
        let mut second = SecondTree::new(BuildSettings::default());
        for (to, expected) in [(0.3, 0.3), (-5.0, 0.02), (2.0, 0.98), (f32::NAN, 0.5), (f32::INFINITY, 0.5)] {
            second.move_seam(to);
            assert_eq!(second.seam, expected, "{to}");
        }
    }

    #[test]
    fn the_views_follow_each_other_in_a_circle() {
        let seen: Vec<CompareView> =
            std::iter::successors(Some(CompareView::A), |view| Some(view.next())).take(5).collect();
        assert_eq!(seen[..4], CompareView::ALL);
        assert_eq!(seen[4], CompareView::A);
    }
}
