//! Steps of a ray's traversal, as a probe receives them.

/// One step of a traversal; see [`Probe`](super::Probe) for the meaning and order of the steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RayEvent {
    /// The container of `node` was tested: the ray enters it at distance `t`.
    Enter {
        /// Index of the node.
        node: u32,
        /// Distance of entry.
        t: f32,
    },
    /// The container of `node` was tested: the ray misses it.
    Miss {
        /// Index of the node.
        node: u32,
    },
    /// `node`, entered at `t`, was skipped, because it begins behind the nearest hit.
    Cull {
        /// Index of the node.
        node: u32,
        /// Distance of entry.
        t: f32,
    },
    /// `node` was put on the stack.
    Push {
        /// Index of the node.
        node: u32,
    },
    /// `node` was taken from the stack.
    Pop {
        /// Index of the node.
        node: u32,
    },
    /// The traversal went into `node`: what follows up to the next visit are tests of its children or of its primitives.
    Visit {
        /// Index of the node.
        node: u32,
    },
    /// A triangle was tested.
    Triangle {
        /// Index of the triangle in the list that the tree was built from.
        index: u32,
        /// Distance of its hit; `None` where it was missed or lies behind the nearest hit.
        t: Option<f32>,
    },
    /// A hit became the nearest.
    Nearer {
        /// Distance of the hit.
        t: f32,
    },
}
