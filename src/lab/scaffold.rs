//! The scaffold of a build: the curve through the primitives' centres, and the cells at which the recursion splits them.

use glam::Vec3;

use crate::accel::Accel;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{CellLimits, CurveCell, curve_order};

/// Most points of the curve that are kept: more cannot be told apart on a screen.
const MAX_POINTS: usize = 4_096;
/// Most cells that are listed.
const MAX_CELLS: usize = 2_048;

/// The curve and the cells of one level.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scaffold {
    /// Centres along the curve, from its beginning to its end; every [`Scaffold::step`]th and the last.
    pub points: Vec<Vec3>,
    /// Number of centres from one point to the next.
    pub step: usize,
    /// Number of primitives.
    pub primitives: usize,
    /// The cells at the chosen level of the recursion, and those above it that are split no further.
    pub cells: Vec<CurveCell>,
}

/// The scaffold of the tree's build at `level` of its recursion, 0 for the whole model. The inner `Err` is the reason why this builder has
/// none.
pub fn scaffold(accel: &Accel, level: u32, token: &CancelToken) -> Result<Result<Scaffold, String>, Cancelled> {
    let limits = CellLimits { level, count: 2 * MAX_CELLS };
    let order = match curve_order(accel.scene.built_triangles(), &accel.settings, limits, token) {
        Ok(order) => order,
        Err(BuildError::Refused(reason)) => return Ok(Err(reason)),
        Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
    };
    let primitives = order.centers.len();
    let step = primitives.div_ceil(MAX_POINTS).max(1);
    let mut points: Vec<Vec3> = order.centers.iter().step_by(step).copied().collect();
    if primitives > 0 && !(primitives - 1).is_multiple_of(step) {
        points.extend(order.centers.last());
    }
    let shown = |cell: &CurveCell| cell.level == level || cell.split.is_none();
    let mut cells = order.cells;
    cells.retain(shown);
    cells.truncate(MAX_CELLS);
    Ok(Ok(Scaffold { points, step, primitives, cells }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};

    #[test]
    fn cells_of_a_level_hold_every_primitive_once() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(12) };
        let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
        let accel = Accel::build(&scene, &BuildSettings::default(), &token).unwrap();
        for level in [0, 3, 6] {
            let found = scaffold(&accel, level, &token).unwrap().unwrap();
            assert_eq!(found.primitives, scene.triangles.len());
            let mut next = 0;
            let mut cells = found.cells.clone();
            cells.sort_by_key(|cell| cell.positions.start);
            for cell in &cells {
                assert_eq!(cell.positions.start, next, "level {level}");
                next = cell.positions.end;
            }
            assert_eq!(next as usize, found.primitives, "level {level}");
            assert!(
                found.points.len() <= MAX_POINTS + 1
                    && (found.points.len() - 1) * found.step < found.primitives + found.step
            );
        }
        let settings = BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() };
        let other = Accel::build(&scene, &settings, &token).unwrap();
        assert!(scaffold(&other, 3, &token).unwrap().unwrap_err().contains("no curve"));
    }
}
