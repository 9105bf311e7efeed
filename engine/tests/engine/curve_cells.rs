//! The order along the curve and the cells of the recursion.

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{CellLimits, CellSplitKind, CurveOrder, curve_order};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;

use crate::construction::construct;
use crate::trees;

const ALL: CellLimits = CellLimits { level: u32::MAX, count: usize::MAX };

fn ordered(triangles: &[Triangle], settings: &BuildSettings, limits: CellLimits) -> CurveOrder {
    curve_order(triangles, settings, limits, &CancelToken::new()).unwrap()
}

fn scenes() -> Vec<(&'static str, Vec<Triangle>)> {
    let mut scenes = trees::nasty_scenes();
    scenes.push(("several tasks", trees::soup(20_000, 0.1, 111)));
    // More than 32 in one cell of the packed codes.
    let crowd = trees::soup(20_000, 0.1, 112);
    let shrunk = |t: &Triangle| Triangle { a: t.a * 1e-5, b: t.b * 1e-5, c: t.c * 1e-5 };
    scenes.push(("a crowd", crowd.iter().enumerate().map(|(i, t)| if i < 100 { *t } else { shrunk(t) }).collect()));
    scenes
}

fn check_cells(order: &CurveOrder, curve: Curve, name: &str) {
    let whole = order.centers.iter().fold(Aabb::EMPTY, |all, &c| all.union(&Aabb { min: c, max: c }));
    // A cell of the finest grid, and rounding.
    let slack =
        whole.extent().max_element() / (1 << 20) as f32 + whole.min.abs().max(whole.max.abs()).max_element() * 1e-6;
    assert_eq!(order.cells[0].positions, 0..order.centers.len() as u32, "{name}");
    let mut listed = 1;
    for cell in &order.cells {
        for position in cell.positions.clone() {
            let center = order.centers[position as usize];
            let point = Aabb { min: center, max: center };
            assert!(cell.bounds.contains(&point, slack), "{name}: {center} outside {cell:?}");
        }
        let Some(first) = cell.first_child else { continue };
        assert_eq!(first, listed, "{name}: siblings are side by side, level by level");
        listed += 2;
        let split = cell.split.unwrap();
        let [left, right] = [0, 1].map(|side| &order.cells[(first + side) as usize]);
        assert_eq!(left.positions, cell.positions.start..split.position, "{name}");
        assert_eq!(right.positions, split.position..cell.positions.end, "{name}");
        assert!([left, right].iter().all(|child| child.level == cell.level + 1 && !child.positions.is_empty()));
        assert!([left, right].iter().all(|child| cell.bounds.contains(&child.bounds, slack)), "{name}: {cell:?}");
        match split.kind {
            CellSplitKind::Plane { axis, at } => {
                let axis = axis as usize;
                let sides = if curve == Curve::Hilbert && left.bounds.min[axis] > right.bounds.min[axis] {
                    [right, left]
                } else {
                    [left, right]
                };
                let [below, above] = sides.map(|child| [child.bounds.min[axis], child.bounds.max[axis]]);
                assert!(
                    below[1] <= at + slack && above[0] >= at - slack,
                    "{name}: {at} between {below:?} and {above:?}"
                );
            }
            CellSplitKind::Size => assert_eq!(curve, Curve::Extended, "{name}"),
            CellSplitKind::HalfWay => assert_eq!(left.positions.len(), cell.positions.len() / 2, "{name}"),
        }
    }
    assert_eq!(listed as usize, order.cells.len(), "{name}");
}

#[test]
fn cells_hold_the_centres_of_their_primitives() {
    for (name, triangles) in scenes() {
        for container in ContainerKind::ALL {
            for curve in Curve::ALL {
                let settings = BuildSettings { container, curve, ..BuildSettings::default() };
                let order = ordered(&triangles, &settings, ALL);
                check_cells(&order, curve, &format!("{name}, {settings:?}"));
            }
        }
    }
}

#[test]
fn cells_are_the_ranges_of_the_recursion() {
    for (name, triangles) in scenes() {
        for curve in Curve::ALL {
            let settings = BuildSettings { curve, threshold: 9, ..BuildSettings::default() };
            let order = ordered(&triangles, &settings, ALL);
            let construction = construct(&triangles, &settings);
            let mut cells: Vec<_> =
                order.cells.iter().map(|cell| (cell.positions.start, cell.positions.end, cell.level)).collect();
            let steps = construction.record.steps();
            let mut ranges: Vec<_> = steps[..steps.len() - 1]
                .iter()
                .map(|step| (step.positions().start, step.positions().end, step.level))
                .collect();
            cells.sort_unstable();
            ranges.sort_unstable();
            assert!(cells == ranges, "{name}, {curve:?}: {} cells, {} ranges", cells.len(), ranges.len());
            let slots = construction.tree.primitive_indices().iter().zip(construction.record.positions());
            assert!(slots.into_iter().all(|(&primitive, &at)| order.primitives[at as usize] == primitive), "{name}");
            // LBVH partitions down to single primitives.
            let lbvh = BuildSettings { builder: BuilderKind::Lbvh, ..settings };
            let (tree, _) = build_binary(&triangles, &lbvh, &CancelToken::new()).unwrap();
            assert_eq!(ordered(&triangles, &lbvh, ALL).cells.len(), tree.node_count(), "{name}");
        }
    }
}

#[test]
fn limits_cut_the_list_short() {
    let triangles = trees::soup(5_000, 0.1, 113);
    let settings = BuildSettings::default();
    let all = ordered(&triangles, &settings, ALL);
    for limits in [CellLimits { level: 4, ..ALL }, CellLimits { count: 100, ..ALL }, CellLimits { count: 1, ..ALL }] {
        let some = ordered(&triangles, &settings, limits);
        assert!(some.cells.len() <= limits.count && some.cells.iter().all(|cell| cell.level <= limits.level));
        check_cells(&some, Curve::Morton, "limited");
        let same =
            some.cells.iter().zip(&all.cells).all(|(some, all)| some.bounds == all.bounds && some.split == all.split);
        assert!(same, "the first of all cells");
        assert_eq!(some.centers, all.centers);
    }
    let at_four = ordered(&triangles, &settings, CellLimits { level: 4, ..ALL });
    assert_eq!(at_four.cells.len(), all.cells.iter().filter(|cell| cell.level <= 4).count());
    assert!(ordered(&triangles, &settings, CellLimits { count: 0, ..ALL }).cells.is_empty());
}

#[test]
fn proxies_of_split_triangles_are_ordered() {
    let triangles = trees::soup(2_000, 0.9, 114);
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let order = ordered(&triangles, &settings, ALL);
    assert!(order.centers.len() > 2_000 && order.primitives.len() == order.centers.len());
    assert!(order.primitives.iter().all(|&triangle| triangle < 2_000));
    check_cells(&order, Curve::Morton, "proxies");
}

#[test]
fn builders_without_a_curve_are_refused() {
    let triangles = trees::soup(50, 0.1, 115);
    let exact = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    let refused = curve_order(&triangles, &exact, ALL, &CancelToken::new());
    assert!(matches!(refused, Err(BuildError::Refused(text)) if text.contains("follows no curve")));
    assert_eq!(ordered(&[], &BuildSettings::default(), ALL), CurveOrder::default());
    let token = CancelToken::new();
    token.cancel();
    let cancelled = curve_order(&triangles, &BuildSettings::default(), ALL, &token);
    assert_eq!(cancelled, Err(BuildError::Cancelled(Cancelled)));
}
