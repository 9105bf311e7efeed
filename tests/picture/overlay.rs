//! The overlay: the choice of nodes and the data of their instances.

use std::sync::Arc;

use crate::overlays::{accel, even_row, row, settings, table};
use bvhscope::accel::Accel;
use bvhscope::accel::node_values::{KnownVisits, NodeValues};
use bvhscope::camera::{Camera, Projection};
use bvhscope::catalog::metrics::{AREA, METRICS, PRIMITIVES, Source};
use bvhscope::lab::population::{Population, ViewRays};
use bvhscope::overlay::{
    ColorBy, ColorScale, NodeTable, OverlaySettings, Role, Selection, Shown, Viewpoint, highlighted, legend,
};
use bvhscope::render::RenderSettings;
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::section::SectionPlane;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Sphere};
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, Container as _, ContainerKind, Tree};
use glam::Vec3;

#[test]
fn families_are_found_from_any_member() {
    let table = table::<Aabb>(row(13));
    assert_eq!((table.parent(0), table.sibling(0, 1), table.depth(0)), (None, None, 0));
    assert_eq!((table.parent(25), table.sibling(25, 1)), (None, None), "there are 25 nodes");
    for node in 1..25 {
        let parent = table.parent(node).unwrap();
        let children = table.children(parent);
        assert!(children.len() == 2 && children.contains(&node));
        let other = children.clone().find(|&child| child != node);
        assert_eq!([table.sibling(node, 1), table.sibling(node, -1)], [other; 2]);
        assert_eq!(table.sibling(node, 2), Some(node));
        assert_eq!(table.depth(node), table.depth(parent) + 1);
    }
}

#[test]
fn depths_beyond_the_tree_are_clamped() {
    let table = table::<Aabb>(row(8));
    let nothing = Selection::default();
    assert_eq!(table.shown(&settings(1, 2), &nothing, None).nodes, table.by_depth(7)[1..7]);
    assert_eq!(table.shown(&settings(2, 1), &nothing, None), table.shown(&settings(1, 2), &nothing, None));
    assert_eq!(table.shown(&settings(90, 99), &nothing, None).wanted, 8, "the deepest level");
    let parents = OverlaySettings { parents: true, ..settings(2, 2) };
    assert_eq!(table.shown(&parents, &nothing, None).nodes, table.by_depth(7)[0..7]);
}

#[test]
fn the_budget_takes_the_largest() {
    let table = table::<Aabb>(row(64));
    let nothing = Selection::default();
    let Shown { nodes: all, depths, .. } = table.shown(&settings(2, 5), &nothing, None);
    assert!(all.iter().zip(&depths).all(|(&node, &depth)| table.depth(node) == depth));
    let cut = table.shown(&OverlaySettings { budget: Some(10), ..settings(2, 5) }, &nothing, None);
    assert_eq!((cut.nodes.len(), cut.wanted), (10, all.len()));
    assert!(cut.nodes.iter().zip(&cut.depths).all(|(&node, &depth)| table.depth(node) == depth));
    assert!(cut.nodes.is_sorted_by(|&a, &b| table.area_share(a) >= table.area_share(b)));
    let smallest = table.area_share(*cut.nodes.last().unwrap());
    for node in all.into_iter().filter(|node| !cut.nodes.contains(node)) {
        assert!(table.area_share(node) <= smallest);
    }
    let none = table.shown(&OverlaySettings { budget: Some(0), ..settings(2, 5) }, &nothing, None);
    assert_eq!((none.nodes.len(), none.wanted), (0, 60));
}

/// For every range of depths, every filter and budgets of all sizes, the nodes are those of a sorted list of all nodes.
#[test]
fn shown_nodes_match_a_sorted_list() {
    let source = SceneSource::parse("builtin:terrain:700".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let accel = Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let table = NodeTable::new(&Arc::new(accel));
    let area = |node: u32| table.node_box(node).relative_area();
    let deepest = table.max_depth();
    assert!(deepest > 8 && table.len() > 1_000);
    let some_hidden = Selection { hidden: (40..table.len() as u32).step_by(97).collect(), ..Selection::default() };
    let mut cuts = 0;
    for [first, last] in [[0, deepest], [0, 3], [5, 7], [deepest - 2, deepest], [6, 6]] {
        for [leaves_only, parents] in [[false, false], [true, false], [false, true], [true, true]] {
            for selection in [&Selection::default(), &some_hidden] {
                let visibility = table.visibility(selection);
                let from = if parents { 0 } else { first };
                let kept = |&node: &u32| {
                    let depth = table.depth(node);
                    (from..=last).contains(&depth)
                        && (!leaves_only || depth < first || table.is_leaf(node))
                        && visibility.as_ref().is_none_or(|visibility| !visibility.hides(node))
                };
                let mut sorted: Vec<u32> = (0..table.len() as u32).filter(kept).collect();
                sorted.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
                for budget in [0, 1, 10, 60, 4_000] {
                    let settings =
                        OverlaySettings { leaves_only, parents, budget: Some(budget), ..settings(first, last) };
                    let shown = table.shown(&settings, selection, None);
                    let drawn = sorted.len().min(budget as usize);
                    assert_eq!(shown.wanted, sorted.len(), "{settings:?}");
                    assert!(shown.nodes.iter().zip(&shown.depths).all(|(&node, &depth)| table.depth(node) == depth));
                    if sorted.len() > drawn {
                        // Of nodes with the same area any may be dropped.
                        let areas = |nodes: &[u32]| nodes.iter().map(|&node| area(node)).collect::<Vec<_>>();
                        assert_eq!(areas(&shown.nodes), areas(&sorted[..drawn]), "{settings:?}");
                        assert!(shown.nodes.iter().all(kept), "{settings:?}");
                        cuts += 1;
                    }
                    let mut nodes = shown.nodes;
                    nodes.sort_unstable();
                    nodes.dedup();
                    assert_eq!(nodes.len(), drawn, "{settings:?}");
                }
            }
        }
    }
    assert!(cuts > 50, "the budget cut only {cuts} times");
}

#[test]
fn leaves_and_hidden_nodes_are_distinguished() {
    let table = table::<Aabb>(row(13));
    let leaves = OverlaySettings { leaves_only: true, ..settings(0, 99) };
    let shown = table.shown(&leaves, &Selection::default(), None);
    assert_eq!(shown.wanted, 13);
    assert!(shown.nodes.iter().all(|&node| table.is_leaf(node)));

    let below =
        |node| table.shown(&settings(0, 99), &Selection { isolated: Some(node), ..Selection::default() }, None).nodes;
    let hidden = Selection { hidden: [2].into(), ..Selection::default() };
    let shown = table.shown(&settings(0, 99), &hidden, None);
    assert_eq!(shown.wanted, 25 - below(2).len(), "the subtree is missing");
    assert!(below(2).contains(&2) && below(2).iter().all(|node| !shown.nodes.contains(node)));
    assert_eq!(below(0).len(), 25);
}

#[test]
fn an_empty_tree_shows_nothing() {
    let mut empty = Arc::into_inner(accel::<Aabb>(row(1))).unwrap();
    empty.tree = AnyTree::Aabb(Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 });
    empty.report.stats = tree_stats(&empty.tree, &CancelToken::new()).unwrap();
    let table = NodeTable::new(&Arc::new(empty));
    assert!(table.is_empty());
    assert_eq!(table.max_depth(), 0);
    assert_eq!(table.shown(&settings(0, 9), &Selection::default(), None).wanted, 0);
    for color_by in ColorBy::ALL {
        let shown = table.shown(&OverlaySettings { color_by, ..settings(0, 9) }, &Selection::default(), None);
        assert_eq!((shown.wanted, legend(&shown).drawn), (0, [0.0, 1.0]));
    }
}

#[test]
fn the_other_container_holds_the_same_triangles() {
    let triangles = row(9);
    let of_boxes = table::<Aabb>(triangles.clone());
    let of_spheres = table::<Sphere>(triangles.clone());
    assert_eq!(of_boxes.container_kind(), ContainerKind::Aabb);
    assert_eq!(of_spheres.container_kind(), ContainerKind::Sphere);
    // Both trees have the same shape, so a node's exact box is the same in both.
    for node in 0..of_boxes.len() as u32 {
        assert_eq!(of_boxes.node_box(node), of_spheres.node_box(node));
        let own = of_spheres.node_sphere(node);
        let other = of_boxes.node_sphere(node);
        for triangle in &triangles {
            for corner in [triangle.a, triangle.b, triangle.c] {
                let below = of_boxes.node_box(node).contains_point(corner, 0.0);
                assert!(!below || other.contains_point(corner, 1e-4) && own.contains_point(corner, 1e-4));
            }
        }
    }
}

#[test]
fn an_instance_describes_its_node() {
    let table = table::<Aabb>(row(8));
    let by_primitives = OverlaySettings { color_by: ColorBy::Metric(PRIMITIVES), ..settings(0, 9) }
        .with_kinds(ContainerKind::OF_PAPER.into_iter().collect());
    table.prepare(&by_primitives, &CancelToken::new()).unwrap();
    let shown = table.shown(&by_primitives, &Selection::default(), None);
    let instances = table.instances(&shown, &by_primitives);
    let root = instances.iter().find(|instance| instance.node == 0).unwrap();
    assert_eq!((root.depth, root.flags, root.place), (0, 0, 1.0), "it has most triangles");
    assert!(root.sphere_radius > 7.0);
    let last = *table.by_depth(table.len() as u32).last().unwrap();
    let leaf = instances.iter().find(|instance| instance.node == last).unwrap();
    assert_eq!((leaf.depth, leaf.flags, leaf.place), (3, 1, 0.0), "it has fewest");
    assert_eq!((table.primitives(0), table.primitives(last)), (8, 1));
    assert!(table.area_share(last) > 0.0 && table.area_share(last) < 0.1);
    let by_depth = settings(0, 9);
    for node in table.instances(&table.shown(&by_depth, &Selection::default(), None), &by_depth) {
        assert!((node.place - (node.depth as f32 / 3.0).sqrt()).abs() < 1e-6, "{node:?}");
    }
    let left = table.children(0).start;
    let right = left + 1;
    assert_eq!(table.overlap(0), Some(0.0), "a row along x overlaps nowhere");
    assert_eq!(table.overlap(last), None, "a leaf has no children");
    assert_eq!(table.primitives(left) + table.primitives(right), 8);
}

#[test]
fn the_family_and_the_hovered_node_are_highlighted() {
    let table = table::<Aabb>(row(4));
    let first = table.children(0).start;
    let second = first + 1;
    let marked = |selected, hovered| highlighted(&table, &Selection { selected, hovered, ..Selection::default() });
    let family = vec![(first, Role::FirstChild), (second, Role::SecondChild), (0, Role::Selected)];
    assert_eq!(marked(Some(0), Some(0)), family);
    assert_eq!(marked(Some(999), Some(second)), [(second, Role::Hovered)]);
    assert!(marked(None, None).is_empty());
}

#[test]
fn legends_ascend_within_the_ramp() {
    let table = table::<Aabb>(row(200));
    table.study(&CancelToken::new()).unwrap();
    for color_by in ColorBy::ALL {
        for depth in [None, Some([0, 0]), Some([4, 6]), Some([0, 99])] {
            let settings = OverlaySettings { color_by, depth, ..OverlaySettings::default() };
            let shown = table.shown(&settings, &Selection::default(), None);
            let legend = legend(&shown);
            assert!((1..=8).contains(&legend.stops.len()) && !legend.title.is_empty());
            assert!(legend.stops.is_sorted_by(|a, b| a.0 < b.0), "{:?}", legend.stops);
            assert!(legend.stops.iter().all(|(place, _)| (0.0..=1.0).contains(place)));
            assert!(legend.drawn[0] <= legend.drawn[1] && legend.drawn[0] >= 0.0 && legend.drawn[1] <= 1.0);
        }
    }
}

#[test]
fn a_depth_keeps_its_color_and_sizes_are_fitted() {
    let table = table::<Aabb>(row(200));
    table.study(&CancelToken::new()).unwrap();
    let shown = |color_by, depth| {
        let settings = OverlaySettings { color_by, depth: Some(depth), ..OverlaySettings::default() };
        table.shown(&settings, &Selection::default(), None)
    };
    let [upper, lower] = [[0, 3], [5, 7]].map(|depth| legend(&shown(ColorBy::DEPTH, depth)));
    assert_eq!(upper.stops, lower.stops, "the scale is the whole tree's");
    let ([_, upper_end], [lower_start, lower_end]) = (upper.drawn, lower.drawn);
    assert!(upper_end < lower_start && lower_start < lower_end);
    for metric in [AREA, PRIMITIVES] {
        let ends = |depth| match shown(ColorBy::Metric(metric), depth).colors {
            ColorScale::Metric(scale) => scale.ends,
            other => panic!("{other:?}"),
        };
        assert!(ends([0, 1])[0] > ends([5, 7])[1], "{} is fitted to what is shown", metric.key);
    }
}

#[test]
fn every_metric_colours_containers_once_its_data_are_known() {
    let token = CancelToken::new();
    let source = SceneSource::parse("builtin:terrain:700".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
    // Growth is that of a tree that follows a model.
    for metric in METRICS.into_iter().filter(|metric| metric.source != Source::BuiltAreas) {
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
        let table = NodeTable::new(&accel);
        let color_by = ColorBy::Metric(metric);
        let settings = OverlaySettings { color_by, ..settings(0, 99) };
        let known_at_once = table.drawable(&settings).color_by == color_by;
        assert_eq!(known_at_once, metric.source == Source::Tree, "{}", metric.key);
        let camera = Camera::framing(&scene.bounds, scene.up);
        let rays = ViewRays::new(Population::Primary, camera, [64, 64], &RenderSettings::default());
        let visits = rays.measure(&accel, &token).unwrap().visits;
        table.set_visits(Some(KnownVisits(Arc::clone(&visits))));
        table.prepare(&settings, &token).unwrap();
        assert_eq!(table.drawable(&settings).color_by, color_by, "{}", metric.key);
        assert_eq!(accel.known_ancestry().is_some(), metric.source == Source::Counts, "{}", metric.key);
        let shown = table.shown(&settings, &Selection::default(), None);
        assert!(shown.span[1] > shown.span[0] + 0.3, "{}: {:?}", metric.key, shown.span);
        accel.compute_ancestry(&token).unwrap();
        let values = NodeValues { accel: &accel, visits: Some(&visits) };
        let ColorScale::Metric(scale) = shown.colors else { panic!("{:?}", shown.colors) };
        for instance in table.instances(&shown, &settings) {
            let value = values.get(metric, instance.node).unwrap_or(metric.form.neutral());
            assert_eq!(instance.place, scale.position(value), "{} of node {}", metric.key, instance.node);
        }
    }
}

#[test]
fn the_automatic_range_shows_up_to_two_hundred_nodes() {
    let drawn = |table: &NodeTable, leaves_only: bool| {
        let settings = OverlaySettings { leaves_only, ..OverlaySettings::default() };
        table.shown(&settings, &Selection::default(), None).nodes.len()
    };
    let count = |table: &NodeTable| drawn(table, false);
    for triangles in [1, 2, 60, 100] {
        let table = table::<Aabb>(row(triangles));
        assert_eq!(table.automatic_depths(false), [0, table.max_depth()], "a small tree is shown whole");
    }
    let halving = table::<Aabb>(row(4_096));
    assert_eq!((halving.automatic_depths(false), count(&halving)), ([6, 7], 192));
    let source = SceneSource::parse("builtin:terrain:20000".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    for container in ContainerKind::ALL {
        let settings = BuildSettings { container, ..BuildSettings::default() };
        let accel = Accel::build(&scene, &settings, &CancelToken::new()).unwrap();
        let table = NodeTable::new(&Arc::new(accel));
        // Spheres overlap more: fewer of them can be told apart. Polytopes have more edges.
        let fitting = match container {
            ContainerKind::Aabb => 100..=200,
            ContainerKind::Sphere => 20..=60,
            ContainerKind::Dop14 => 40..=100,
            ContainerKind::Oriented => unreachable!("no builder makes them"),
        };
        assert!(fitting.contains(&count(&table)), "{container:?}: {} containers", count(&table));
        let leaves = drawn(&table, true);
        assert_eq!(leaves, *fitting.end(), "{container:?}: the largest leaves, at whatever depths");
    }
}

/// A camera that looks at the far end of the row from nearby.
fn far_end(projection: Projection) -> Viewpoint {
    let target = Vec3::new(120.0, 0.0, 0.0);
    let camera = Camera { eye: target + Vec3::Z * 20.0, target, up: Vec3::Y, fov_y: 0.8, projection };
    Viewpoint { camera, size_px: [400, 400], section: None }
}

#[test]
fn containers_that_the_section_plane_cuts_away_are_not_chosen() {
    let nothing = Selection::default();
    for tree in [table::<Aabb>(row(64)), table::<Sphere>(row(64))] {
        for flipped in [false, true] {
            let plane = SectionPlane { normal: Vec3::X, offset: 50.0, flipped };
            let view = Viewpoint { section: Some(plane), ..far_end(Projection::Orthographic) };
            let reaches = |node: u32| {
                let bounds = tree.bounds(node).unwrap();
                if flipped { bounds.max.x >= 50.0 } else { bounds.min.x <= 50.0 }
            };
            let kept: Vec<u32> = (0..tree.len() as u32).filter(|&node| reaches(node)).collect();
            assert!(kept.len() < tree.len() && kept.len() > 10);
            let mut all = tree.shown(&settings(0, 99), &nothing, Some(&view));
            all.nodes.sort_unstable();
            assert_eq!((all.nodes, all.wanted), (kept.clone(), kept.len()));
            // The budget is spent on what is left, also where few of many are drawn.
            let few = OverlaySettings { budget: Some(5), ..settings(0, 99) };
            let few = tree.shown(&few, &nothing, Some(&view));
            assert_eq!((few.nodes.len(), few.wanted), (5, kept.len()));
            assert!(few.nodes.iter().all(|node| kept.contains(node)));
        }
    }
}

#[test]
fn the_budget_takes_what_looks_largest() {
    let table = table::<Aabb>(row(64));
    let nothing = Selection::default();
    let leaves = OverlaySettings { leaves_only: true, budget: Some(2), ..settings(0, 99) };
    let center = |&node: &u32| table.node_box(node).center().x;
    let near = Viewpoint {
        camera: Camera { target: Vec3::ZERO, eye: Vec3::Z * 5.0, ..far_end(Projection::Perspective).camera },
        ..far_end(Projection::Perspective)
    };
    let shown = table.shown(&leaves, &nothing, Some(&near));
    assert!(shown.nodes.iter().all(|node| center(node) < 4.0), "the smallest triangles are the nearest");
    let shown = table.shown(&leaves, &nothing, Some(&far_end(Projection::Perspective)));
    assert!(shown.nodes.iter().all(|node| center(node) > 100.0));
    assert_eq!((shown.nodes.len(), shown.wanted, shown.outlined), (2, 64, 2));
}

/// The walk from the top finds the same as sorting all where sizes do not depend on the distance.
#[test]
fn a_best_first_walk_finds_what_looks_largest() {
    let table = table::<Aabb>(row(512));
    let nothing = Selection::default();
    let viewpoint = far_end(Projection::Orthographic);
    let [walked, sorted] = [20, 1_000].map(|budget| {
        let settings = OverlaySettings { budget: Some(budget), ..settings(0, 99) };
        table.shown(&settings, &nothing, Some(&viewpoint))
    });
    assert_eq!((walked.nodes.len(), walked.wanted, sorted.nodes.len()), (20, 1_023, 1_000));
    assert_eq!(walked.nodes, sorted.nodes[..20]);
}

#[test]
fn many_small_containers_are_dots() {
    let table = table::<Aabb>(even_row(4_096));
    let mut viewpoint = far_end(Projection::Perspective);
    viewpoint.camera.eye.z = 2_000.0;
    let shown = table.shown(&settings(0, 99), &Selection::default(), Some(&viewpoint));
    assert!(shown.depends_on_view && shown.outlined > 0 && shown.outlined < shown.nodes.len());
    let side = |node: &u32| table.node_box(*node).extent().length();
    assert!(side(&shown.nodes[0]) > side(shown.nodes.last().unwrap()));
    let mut all = shown.nodes.clone();
    all.sort_unstable();
    assert!(all.into_iter().eq(0..table.len() as u32));
    assert!(shown.nodes.iter().zip(&shown.depths).all(|(&node, &depth)| table.depth(node) == depth));
    let few = table.shown(&settings(0, 8), &Selection::default(), Some(&viewpoint));
    assert!(!few.depends_on_view && few.outlined == few.nodes.len());
}

#[test]
fn lines_are_kept_for_the_largest() {
    let table = table::<Aabb>(row(8_192));
    let viewpoint = far_end(Projection::Orthographic);
    let shown = table.shown(&settings(0, 99), &Selection::default(), Some(&viewpoint));
    assert_eq!((shown.outlined, shown.nodes.len()), (10_000, 16_383));
    let side = |node: &u32| table.node_box(*node).extent().length();
    let smallest_with_lines = shown.nodes[..10_000].iter().map(side).fold(f32::INFINITY, f32::min);
    assert!(shown.nodes[10_000..].iter().all(|node| side(node) <= smallest_with_lines));
}
