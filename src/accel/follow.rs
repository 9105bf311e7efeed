//! How trees follow a model that moves.

use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;
use serde::{Deserialize, Serialize};

use crate::scene::Scene;

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

    /// Why trees of these settings over a scene cannot follow by a policy; `None` if they can.
    pub fn refusal(policy: Policy, settings: &BuildSettings, scene: &Scene) -> Option<String> {
        let changes = scene.motion.as_ref().is_some_and(|motion| !motion.keeps_triangles());
        if changes && policy != Policy::Rebuild {
            return Some(format!(
                "the frames of the sequence have different triangles, so that no tree can follow them by '{}': only '{}' applies",
                policy.name(),
                Policy::Rebuild.name()
            ));
        }
        policy.refusal(settings, scene.built_triangles().len())
    }

    /// The same for trees that are built at each moment, whatever the frames.
    #[must_use]
    pub fn normal(self) -> Self {
        if self.policy == Policy::Rebuild { Self::default() } else { self }
    }
}
