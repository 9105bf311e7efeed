//! The scaffold of a build: the order of the primitives along the curve, and the cells at which the recursion splits them.

use std::ops::Range;

use glam::Vec3;

use crate::aac::ClusterContainer;
use crate::builders::prepared::PreparedInput;
use crate::builders::{BuildError, StageTimes, check_size};
use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS, LIGHT_STEPS};
use crate::geometry::{Aabb, Sphere, Triangle};
use crate::kernel::parallel::par_collect;
use crate::order::{CODE_BITS, CellBox, CurveGrid, SortedPrimitives, input_bounds, sort_primitives};
use crate::settings::{BuildSettings, BuilderKind};
use crate::tree::ContainerKind;

/// Coordinate of the last cell along an axis.
const LAST_CELL: u32 = (1 << (CODE_BITS / 3)) - 1;
/// The primitives in sorted order, and the cells of the recursion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurveOrder {
    /// Centre of each primitive's container in sorted order: the points of a polyline along the curve.
    pub centers: Vec<Vec3>,
    /// Index of each primitive's triangle, in sorted order.
    pub primitives: Vec<u32>,
    /// The cells, the root first, then level by level, siblings side by side.
    pub cells: Vec<CurveCell>,
}

/// A range of primitives, and the box that holds their centres.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveCell {
    /// Box of the cells of the curve's grid that agree in the leading bits of their codes. It holds the centres of the primitives
    /// to within a cell of the finest grid, 2⁻²¹ of the longest side of all centres' box; containers can stick out. Cells at the
    /// grid's border hold all that is beyond it: centres of spheres can be. Boxes of siblings
    /// are the same where the split is [`CellSplitKind::Size`] or [`CellSplitKind::HalfWay`].
    pub bounds: Aabb,
    /// Depth of the recursion; 0 for all primitives.
    pub level: u32,
    /// Positions of its primitives in sorted order.
    pub positions: Range<u32>,
    /// Where the range is partitioned; `None` where its primitives are clustered.
    pub split: Option<CellSplit>,
    /// Index of the first of its two parts in [`CurveOrder::cells`]; `None` where there are none or they are beyond the limits.
    pub first_child: Option<u32>,
}

/// Where a cell is partitioned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellSplit {
    /// Position of the second part's first primitive in sorted order.
    pub position: u32,
    /// The difference between the parts.
    pub kind: CellSplitKind,
}

/// Difference between the two parts of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CellSplitKind {
    /// A plane across an axis (0 for x, 1 for y, 2 for z) at this coordinate. The first part can be on either side along a Hilbert curve.
    Plane {
        /// The axis.
        axis: u8,
        /// The coordinate.
        at: f32,
    },
    /// The size of the primitives, in extended Morton codes: both parts are in the same box.
    Size,
    /// Their number alone: all have the same code, as far as it is sorted by.
    HalfWay,
}

/// Limits of the list of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellLimits {
    /// Maximum level.
    pub level: u32,
    /// Maximum number of cells.
    pub count: usize,
}

/// The order of `triangles` along the curve of `settings`, and the cells of their recursion within `limits`. Refused for builders that
/// follow no curve. With the pass Split the primitives are the proxies of triangles. LBVH partitions down to single primitives, AAC to
/// fewer than the threshold.
pub fn curve_order(
    triangles: &[Triangle],
    settings: &BuildSettings,
    limits: CellLimits,
    token: &CancelToken,
) -> Result<CurveOrder, BuildError> {
    if !matches!(settings.builder, BuilderKind::Aac | BuilderKind::Lbvh) {
        let label = settings.builder.label();
        let reason = if settings.builder.is_aac() { "partitions blocks of triangles" } else { "follows no curve" };
        return Err(BuildError::Refused(format!("{label} {reason}: choose AAC or LBVH")));
    }
    check_size(triangles.len(), settings)?;
    if triangles.is_empty() {
        return Ok(CurveOrder::default());
    }
    match settings.container {
        // Polytopes follow the curve by their boxes.
        ContainerKind::Aabb | ContainerKind::Dop14 => Ok(order_of::<Aabb>(triangles, settings, limits, token)?),
        ContainerKind::Oriented => unreachable!("refused above"),
        ContainerKind::Sphere => Ok(order_of::<Sphere>(triangles, settings, limits, token)?),
    }
}

/// [`curve_order`] by the centres of one kind of container.
fn order_of<C: ClusterContainer>(
    triangles: &[Triangle],
    settings: &BuildSettings,
    limits: CellLimits,
    token: &CancelToken,
) -> Result<CurveOrder, Cancelled> {
    let mut times = StageTimes::default();
    let bounds = input_bounds(triangles, token)?;
    let input = PreparedInput::new(triangles, bounds, settings, token, &mut times)?;
    let sorted: SortedPrimitives<C> =
        sort_primitives(&input.triangles, &input.bounds, settings.curve, token, &mut times)?;
    let world = 1.0 / input.scale();
    let center = |position| sorted.container(&input.triangles, sorted.primitive(position)).centroid() * world;
    let centers = par_collect(sorted.len(), token, center)?;
    let cells = Cells {
        sorted: &sorted,
        triangles: &input.triangles,
        grid: CurveGrid::new(&input.bounds.centroids, settings.curve),
        min_split: if settings.builder == BuilderKind::Lbvh { 2 } else { settings.threshold.max(2) as usize },
        world,
        all_centers: bounds_of(&centers, token)?,
    };
    Ok(CurveOrder {
        primitives: par_collect(sorted.len(), token, |position| input.source_index(sorted.primitive(position)))?,
        cells: cells.list(limits, token)?,
        centers,
    })
}

/// The box around `points`.
fn bounds_of(points: &[Vec3], token: &CancelToken) -> Result<Aabb, Cancelled> {
    let mut bounds = Aabb::EMPTY;
    for points in points.chunks(LIGHT_STEPS) {
        token.check()?;
        bounds = points.iter().fold(bounds, |all, &point| all.union(&Aabb { min: point, max: point }));
    }
    Ok(bounds)
}

/// Source of the cells.
struct Cells<'a, C: ClusterContainer> {
    sorted: &'a SortedPrimitives<C>,
    /// The triangles that were sorted.
    triangles: &'a [Triangle],
    grid: CurveGrid,
    /// Minimum number of primitives that are partitioned.
    min_split: usize,
    /// Factor from the coordinates of these triangles to world space.
    world: f32,
    /// Box around all centres, in world space.
    all_centers: Aabb,
}

impl<C: ClusterContainer> Cells<'_, C> {
    /// The cells within `limits`.
    fn list(&self, limits: CellLimits, token: &CancelToken) -> Result<Vec<CurveCell>, Cancelled> {
        let mut cells = Vec::new();
        if limits.count > 0 {
            let whole = self.bounds(&self.grid.cells_of_prefix(0, CODE_BITS));
            cells.push(self.cell(0..self.sorted.len(), 0, whole));
        }
        let mut at = 0;
        while at < cells.len() && cells.len() + 2 <= limits.count {
            token.check_every(HEAVY_STEPS, at)?;
            let cell: &CurveCell = &cells[at];
            if let Some(split) = cell.split
                && cell.level < limits.level
            {
                let (range, middle) =
                    (cell.positions.start as usize..cell.positions.end as usize, split.position as usize);
                let [left, right] =
                    self.halves(&range).map_or([cell.bounds; 2], |halves| halves.map(|half| self.bounds(&half)));
                let level = cell.level + 1;
                let children =
                    [self.cell(range.start..middle, level, left), self.cell(middle..range.end, level, right)];
                cells[at].first_child = Some(cells.len() as u32);
                cells.extend(children);
            }
            at += 1;
        }
        Ok(cells)
    }

    /// The cell of the primitives at the positions `range`, which are in the box `bounds`.
    fn cell(&self, range: Range<usize>, level: u32, bounds: Aabb) -> CurveCell {
        let positions = range.start as u32..range.end as u32;
        if range.len() < self.min_split {
            return CurveCell { bounds, level, positions, split: None, first_child: None };
        }
        let position = self.sorted.make_partition(&range) as u32;
        let Some([left, right]) = self.halves(&range) else {
            let split = Some(CellSplit { position, kind: CellSplitKind::HalfWay });
            return CurveCell { bounds, level, positions, split, first_child: None };
        };
        let axis = (0..3).find(|&axis| left.min[axis] != right.min[axis]);
        let kind = axis.map_or(CellSplitKind::Size, |axis| {
            let [left, right] = [left, right].map(|half| self.bounds(&half).min[axis]);
            CellSplitKind::Plane { axis: axis as u8, at: left.max(right) }
        });
        // The halves fill the smallest cell of the curve that holds them.
        let bounds = self.bounds(&left.union(right));
        CurveCell { bounds, level, positions, split: Some(CellSplit { position, kind }), first_child: None }
    }

    /// The boxes of cells of both parts of `range`; `None` where it is partitioned half way.
    fn halves(&self, range: &Range<usize>) -> Option<[CellBox; 2]> {
        let bit = self.sorted.split_bit(range)?;
        let triangle = &self.triangles[self.sorted.primitive(range.start) as usize];
        // The first primitive's code has a 0 there.
        let code = self.grid.code(self.center(range.start), triangle);
        Some([code, code | 1 << bit].map(|code| self.grid.cells_of_prefix(code, bit)))
    }

    /// Centre of the primitive at `position` in sorted order, in the coordinates of these triangles.
    fn center(&self, position: usize) -> Vec3 {
        self.sorted.container(self.triangles, self.sorted.primitive(position)).centroid()
    }

    /// The box of `cells` in world space. The grid covers the centres of the triangles' boxes; centres of spheres beyond it are in the
    /// cells at its border.
    fn bounds(&self, cells: &CellBox) -> Aabb {
        let Aabb { min, max } = self.grid.bounds_of(cells);
        let (mut min, mut max) = (min * self.world, max * self.world);
        for axis in 0..3 {
            if cells.min[axis] == 0 {
                min[axis] = min[axis].min(self.all_centers.min[axis]);
            }
            if cells.max[axis] == LAST_CELL {
                max[axis] = max[axis].max(self.all_centers.max[axis]);
            }
        }
        Aabb { min, max }
    }
}
