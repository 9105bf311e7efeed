//! The steps of a recorded ray.

use bvhscope_engine::tree::traverse::{RayEvent, TestCounts};

/// A step of the traversal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// A step of the traversal. Nodes are those of the tree that was traversed, as [`RayEvent`] names them.
    Event(RayEvent),
    /// The nearest hit was on a hidden triangle: the ray is traced again from `t` on.
    Again {
        /// Distance along the ray.
        t: f32,
    },
}

/// A step with what is known after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayStep {
    /// The step.
    pub what: Step,
    /// The node of the tree that it is about: of a triangle its leaf's. Of a wide tree's node or leaf that which it was
    /// collapsed from, or where it stands for some of the children of a node, that node.
    pub tree_node: u32,
    /// Depth of the node in the traversed tree, root 0.
    pub depth: u32,
    /// Container and primitive tests up to here.
    pub counts: TestCounts,
    /// Number of nodes on the stack.
    pub waiting: u32,
    /// Distance of the nearest hit; infinity before the first.
    pub nearest: f32,
    /// The span of its container, by index; `None` where that is missed.
    pub span: Option<u32>,
}

impl Step {
    /// The name in tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Event(RayEvent::Enter { .. }) => "enter",
            Self::Event(RayEvent::Miss { .. }) => "miss",
            Self::Event(RayEvent::Cull { .. }) => "cull",
            Self::Event(RayEvent::Push { .. }) => "push",
            Self::Event(RayEvent::Pop { .. }) => "pop",
            Self::Event(RayEvent::Visit { .. }) => "visit",
            Self::Event(RayEvent::Triangle { .. }) => "test",
            Self::Event(RayEvent::Nearer { .. }) => "nearer",
            Self::Again { .. } => "again",
        }
    }

    /// The distance that it is about.
    pub const fn t(self) -> Option<f32> {
        match self {
            Self::Event(RayEvent::Enter { t, .. } | RayEvent::Cull { t, .. } | RayEvent::Nearer { t })
            | Self::Again { t } => Some(t),
            Self::Event(RayEvent::Triangle { t, .. }) => t,
            Self::Event(
                RayEvent::Miss { .. } | RayEvent::Push { .. } | RayEvent::Pop { .. } | RayEvent::Visit { .. },
            ) => None,
        }
    }

    /// It is about a node rather than a triangle or a hit.
    pub const fn is_about_node(self) -> bool {
        !matches!(self, Self::Event(RayEvent::Triangle { .. } | RayEvent::Nearer { .. }) | Self::Again { .. })
    }

    /// The triangle that is tested.
    pub const fn triangle(self) -> Option<u32> {
        match self {
            Self::Event(RayEvent::Triangle { index, .. }) => Some(index),
            _ => None,
        }
    }
}
