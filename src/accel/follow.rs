//! How trees follow a model that moves.

use bvhscope_engine::follow::Policy;
use serde::{Deserialize, Serialize};

/// How the tree of a moment is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Follow {
    /// The policy, which changes the tree of the frame before or builds another.
    pub policy: Policy,
    /// Number of frames of the clip, at equal distances from the first key to the last, by which the tree gets to the moment.
    pub frames: u32,
}

impl Default for Follow {
    fn default() -> Self {
        Self { policy: Policy::Rebuild, frames: 25 }
    }
}

impl Follow {
    /// The numbers of frames that are offered.
    pub const FRAMES: [u32; 4] = [10, 25, 50, 100];

    /// The same for trees that are built at each moment, whatever the frames.
    #[must_use]
    pub fn normal(self) -> Self {
        if self.policy == Policy::Rebuild { Self::default() } else { self }
    }
}
