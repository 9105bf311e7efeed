//! The policies by which a tree follows triangles that move.

use crate::settings::BuildSettings;
use crate::tree::ContainerKind;

/// A policy: what becomes of a tree whose triangles have moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Policy {
    /// Containers enclose their triangles in all frames, and stay.
    Keep,
    /// Containers are fitted.
    Refit,
    /// Fitted, and nodes rotated where areas fall.
    Rotate,
    /// Fitted, and the most inefficient subtrees moved.
    Reinsert,
    /// Fitted, and subtrees built again whose cost has grown.
    PartialRebuild,
    /// Built again in each frame.
    Rebuild,
    /// Fitted, while a new tree is built in the background.
    RebuildBehind,
    /// One tree for the whole clip, fitted in each frame.
    WholeClip,
}

/// Names of a policy, its definition, and the containers that it takes.
#[derive(Clone, Copy)]
struct Row {
    policy: Policy,
    name: &'static str,
    label: &'static str,
    meaning: &'static str,
    boxes_only: bool,
}

/// One row for each policy, in their order.
const ROWS: [Row; 8] = [
    Row {
        policy: Policy::Keep,
        name: "keep",
        label: "Keep",
        meaning: "The first frame's tree, whose containers enclose their triangles in all frames: nothing is updated",
        boxes_only: false,
    },
    Row {
        policy: Policy::Refit,
        name: "refit",
        label: "Refit",
        meaning: "The first frame's tree, whose containers are fitted in each frame (Wald, Boulos, Shirley 2007)",
        boxes_only: false,
    },
    Row {
        policy: Policy::Rotate,
        name: "rotate",
        label: "Refit + rotations",
        meaning: "Fitted, and children change places with grandchildren where areas fall (Kopta et al. 2012)",
        boxes_only: false,
    },
    Row {
        policy: Policy::Reinsert,
        name: "reinsert",
        label: "Refit + reinsertion",
        meaning: "Fitted, and one in a hundred subtrees, the most inefficient, moves to where it costs less (Bittner, Hapala, Havran 2013)",
        boxes_only: true,
    },
    Row {
        policy: Policy::PartialRebuild,
        name: "partial-rebuild",
        label: "Partial rebuild",
        meaning: "Fitted, and subtrees are built again whose SAH cost has grown by a fifth since they were built",
        boxes_only: false,
    },
    Row {
        policy: Policy::Rebuild,
        name: "rebuild",
        label: "Rebuild",
        meaning: "A new tree in each frame",
        boxes_only: false,
    },
    Row {
        policy: Policy::RebuildBehind,
        name: "rebuild-behind",
        label: "Rebuild behind",
        meaning: "Fitted, while a new tree is built on other threads, which takes over four frames later, fitted (Wald, Ize, Parker 2008)",
        boxes_only: false,
    },
    Row {
        policy: Policy::WholeClip,
        name: "whole-clip",
        label: "Whole clip",
        meaning: "One tree, optimised for its mean cost in eight poses of the clip and fitted in each frame (Bittner, Meister 2015)",
        boxes_only: false,
    },
];

impl Policy {
    /// Every policy, in the order in which menus list them: from the least work in a frame to the most, then those that work beforehand or
    /// beside.
    pub const ALL: [Self; ROWS.len()] = {
        let (mut all, mut index) = ([Self::Keep; ROWS.len()], 0);
        while index < ROWS.len() {
            all[index] = ROWS[index].policy;
            index += 1;
        }
        all
    };

    const fn row(self) -> Row {
        ROWS[self as usize]
    }

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        self.row().label
    }

    /// Definition, in one sentence without a full stop.
    pub const fn meaning(self) -> &'static str {
        self.row().meaning
    }

    /// Why trees of these settings over `primitive_count` triangles cannot follow by this policy; `None` if they can.
    pub fn refusal(self, settings: &BuildSettings, primitive_count: usize) -> Option<String> {
        if self.row().boxes_only && settings.container != ContainerKind::Aabb {
            return Some(format!(
                "the policy '{}' moves subtrees of boxes only: choose the box container, or '{}' for {}",
                self.name(),
                Self::Rotate.name(),
                settings.container.plural()
            ));
        }
        settings.refusal(primitive_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_policy_has_its_row() {
        for (index, row) in ROWS.iter().enumerate() {
            assert_eq!(row.policy as usize, index, "{}", row.name);
            assert!(!row.meaning.ends_with('.'), "{}", row.meaning);
        }
    }
}
