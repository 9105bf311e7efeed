//! Cache lines that rays read of the wide tree, against those of each byte on their recorded path.

use std::collections::HashSet;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{RayEvent, RayLog};
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
use bvhscope_engine::wide::{AnyWideTree, Child, NodeForm, WideContainer, WideNode, WideTree};
use bvhscope_engine::with_wide_tree;
use glam::Vec3;

use crate::trees;

/// Bytes of a triangle: nine coordinates and an index.
const TRIANGLE_BYTES: usize = 40;

/// The lines in which the bytes on the path of `events` lie. Triangles of a leaf follow one another, and are tested in order.
fn lines_of_path<C: WideContainer>(_: &WideTree<C>, events: &[RayEvent]) -> CacheLines {
    let (mut nodes, mut triangles, mut slot) = (HashSet::new(), HashSet::new(), 0);
    for event in events {
        match *event {
            RayEvent::Visit { node } => {
                let child = Child::from_bits(node);
                if child.is_leaf() {
                    slot = child.index();
                    continue;
                }
                let sizes = [size_of::<WideNode<C::Bounds>>(), size_of::<WideNode<C::Compact>>()];
                let size = sizes[usize::from(child.is_compact())];
                let bytes = child.index() * size..(child.index() + 1) * size;
                nodes.extend(bytes.map(|byte| (child.is_compact(), byte / 64)));
            }
            RayEvent::Triangle { .. } => {
                triangles.extend((slot * TRIANGLE_BYTES..(slot + 1) * TRIANGLE_BYTES).map(|byte| byte / 64));
                slot += 1;
            }
            _ => {}
        }
    }
    CacheLines { nodes: nodes.len() as u64, triangles: triangles.len() as u64 }
}

/// Trees with small and large leaves, in both forms of nodes, and one that is a single leaf.
fn wide_trees(triangles: &[Triangle]) -> Vec<AnyWideTree> {
    let token = CancelToken::new();
    let boxes = BuildSettings::default();
    let mut settings: Vec<BuildSettings> =
        ContainerKind::ALL.into_iter().map(|container| BuildSettings { container, ..boxes }).collect();
    settings.extend([
        BuildSettings::preset(Preset::Swift, ContainerKind::Aabb),
        BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..boxes },
        BuildSettings { optimize: Passes::NONE.with(Pass::Orient), ..boxes },
        BuildSettings { builder: BuilderKind::None, ..boxes },
    ]);
    let widened = |settings: BuildSettings| {
        let (tree, _) = build_binary(triangles, &settings, &token).expect("nothing to refuse");
        [NodeForm::Full, NodeForm::Compact].map(|form| AnyWideTree::new(&tree, triangles, form, &token).unwrap())
    };
    settings.into_iter().flat_map(widened).collect()
}

#[test]
fn rays_read_the_lines_of_the_nodes_and_triangles_on_their_path() {
    let level = SimdLevel::best().level();
    let triangles = [trees::soup(700, 0.3, 3), trees::ball(Vec3::ZERO, 1.0, 12)].concat();
    let rays = trees::rays(&triangles, 200, 17);
    let (mut compact, mut shared) = (0, 0);
    for wide in wide_trees(&triangles) {
        let mut probe = LineProbe::new(&wide);
        for (ray, any) in rays.iter().flat_map(|ray| [(ray, false), (ray, true)]) {
            let mut log = RayLog::default();
            if any {
                assert_eq!(wide.any_hit_with(level, ray, &mut log), wide.any_hit_with(level, ray, &mut probe));
            } else {
                assert_eq!(wide.closest_hit_with(level, ray, &mut log), wide.closest_hit_with(level, ray, &mut probe));
            }
            let expected = with_wide_tree!(&wide, tree => lines_of_path(tree, log.events()));
            let found = probe.take();
            assert_eq!(found, expected, "any hit {any}, {ray:?}");
            assert_eq!(found.bytes(), 64 * (expected.nodes + expected.triangles));
            let visits: Vec<Child> = log.events().iter().filter_map(visited).collect();
            compact += visits.iter().filter(|child| child.is_compact()).count();
            // Full nodes of boxes lie in four lines each.
            let full = visits.iter().filter(|child| !child.is_leaf() && !child.is_compact()).count() as u64;
            shared += usize::from(found.nodes < 4 * full);
        }
    }
    assert!(compact > 1_000 && shared > 1_000, "{compact} visits of compact nodes, {shared} rays with shared lines");
}

fn visited(event: &RayEvent) -> Option<Child> {
    match event {
        RayEvent::Visit { node } => Some(Child::from_bits(*node)),
        _ => None,
    }
}

/// A ray that is traced in two parts reads what both read, once.
#[test]
fn lines_that_are_read_again_count_once() {
    let level = SimdLevel::best().level();
    let triangles = trees::ball(Vec3::ZERO, 1.0, 24);
    for wide in wide_trees(&triangles) {
        for ray in trees::rays(&triangles, 50, 5) {
            let mut probe = LineProbe::new(&wide);
            wide.closest_hit_with(level, &ray, &mut probe);
            let once = probe.take();
            for _ in 0..2 {
                wide.closest_hit_with(level, &ray, &mut probe);
            }
            assert_eq!((probe.take(), probe.take()), (once, CacheLines::default()));
        }
    }
}
