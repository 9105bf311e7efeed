//! The curve through the primitives' centres, as it is drawn over the picture.

use crate::app::state::study::Study;
use crate::lab::scaffold::Scaffold;

/// What is drawn of the curve, by level of the recursion.
#[derive(Debug)]
pub struct CurveView {
    /// Whether it is drawn.
    pub shown: bool,
    /// The level of the recursion whose cells are drawn; 0 is the whole model.
    pub level: u32,
    /// Curve and cells of the presented tree, or why it has none.
    pub scaffold: Study<u32, Result<Scaffold, String>>,
}

impl CurveView {
    /// The deepest level that can be chosen: cells of deeper ones are too small and too many to be told apart.
    pub const MAX_LEVEL: u32 = 10;
}

impl Default for CurveView {
    fn default() -> Self {
        Self { shown: false, level: 4, scaffold: Study::default() }
    }
}
