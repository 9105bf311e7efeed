//! The curve through the primitives' centres, over the picture.

use serde::{Deserialize, Serialize};

use crate::app::state::study::Study;
use crate::lab::scaffold::Scaffold;

/// The drawn part of the curve, by level of the recursion.
#[derive(Debug)]
pub struct CurveState {
    /// Whether it is drawn.
    pub shown: bool,
    /// The level of the recursion whose cells are drawn; 0 is the whole model.
    pub level: u32,
    /// Curve and cells of the presented tree, or why it has none.
    pub scaffold: Study<u32, Result<Scaffold, String>>,
}

impl CurveState {
    /// The deepest level that can be chosen: cells of deeper ones are too small and too many to be told apart.
    pub const MAX_LEVEL: u32 = 10;

    /// Its part of a shared state.
    pub fn shared(&self) -> SharedCurve {
        let Self { shown, level, scaffold: _ } = self;
        SharedCurve { shown: *shown, level: *level }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, SharedCurve { shown, level }: SharedCurve) {
        (self.shown, self.level) = (shown, level.min(Self::MAX_LEVEL));
    }
}

/// The curve's part of a shared state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SharedCurve {
    shown: bool,
    level: u32,
}

impl Default for SharedCurve {
    fn default() -> Self {
        CurveState::default().shared()
    }
}

impl Default for CurveState {
    fn default() -> Self {
        Self { shown: false, level: 4, scaffold: Study::default() }
    }
}
