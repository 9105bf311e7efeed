//! Node tables of trees with a known shape, shared by the tests of the overlay.

#![allow(dead_code, reason = "each test file uses its part")]

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::overlay::{NodeTable, OverlaySettings};
use bvhscope::scene::{Scene, SceneSource};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use glam::Vec3;

/// A tree that halves the list of triangles down to single ones.
pub fn halving_tree<C: Container>(triangles: &[Triangle]) -> Tree<C> {
    let around = |part: &[Triangle]| part.iter().fold(C::EMPTY, |all, one| all.union(&C::of_triangle(one)));
    let mut nodes = vec![Node { container: around(triangles), first: 0, count: triangles.len() as u32 }];
    let mut max_depth = 0;
    let mut open = vec![(0_usize, 0)];
    while let Some((index, depth)) = open.pop() {
        max_depth = max_depth.max(depth);
        let (start, count) = (nodes[index].first as usize, nodes[index].count as usize);
        if count < 2 {
            continue;
        }
        let half = count / 2;
        let children = nodes.len();
        for (start, count) in [(start, half), (start + half, count - half)] {
            let container = around(&triangles[start..start + count]);
            nodes.push(Node { container, first: start as u32, count: count as u32 });
            open.push((nodes.len() - 1, depth + 1));
        }
        (nodes[index].first, nodes[index].count) = (children as u32, 0);
    }
    Tree { nodes, primitive_indices: (0..triangles.len() as u32).collect(), max_depth }
}

pub fn accel<C: Container>(triangles: Vec<Triangle>) -> Arc<Accel>
where
    AnyTree: From<Tree<C>>,
{
    let tree = halving_tree::<C>(&triangles).into();
    let scene = Scene::from_triangles(SceneSource::default_builtin(), triangles);
    let settings = BuildSettings::default().for_container(C::KIND);
    let mut accel = Accel::build(&Arc::new(scene), &settings, &CancelToken::new()).unwrap();
    // Replaces the builder's tree by one of known shape.
    accel.tree = tree;
    accel.report.stats = tree_stats(&accel.tree, &CancelToken::new()).unwrap();
    Arc::new(accel)
}

/// `count` triangles in a row along x, each larger than the one before.
pub fn row(count: usize) -> Vec<Triangle> {
    (0..count)
        .map(|index| {
            let (x, size) = (index as f32 * 2.0, 0.2 + index as f32 * 0.05);
            let at = |dx: f32, dy: f32, dz: f32| Vec3::new(x + dx * size, dy * size, dz * size);
            Triangle { a: at(0.0, 0.0, 0.0), b: at(1.0, 0.0, 1.0), c: at(0.0, 1.0, 0.5) }
        })
        .collect()
}

/// `count` triangles of one size in a row along x, two units apart.
pub fn even_row(count: usize) -> Vec<Triangle> {
    let at = |index: usize, dx: f32, dy: f32| Vec3::new(index as f32 * 2.0 + dx, dy, dx * 0.5);
    (0..count)
        .map(|index| Triangle { a: at(index, 0.0, 0.0), b: at(index, 1.0, 0.0), c: at(index, 0.0, 1.0) })
        .collect()
}

/// One triangle whose box is the cube from -1 to 1.
pub fn cube_triangle() -> Vec<Triangle> {
    vec![Triangle { a: Vec3::splat(-1.0), b: Vec3::splat(1.0), c: Vec3::new(1.0, -1.0, 0.0) }]
}

pub fn table<C: Container>(triangles: Vec<Triangle>) -> Arc<NodeTable>
where
    AnyTree: From<Tree<C>>,
{
    Arc::new(NodeTable::new(&accel::<C>(triangles)))
}

pub fn settings(first: u32, last: u32) -> OverlaySettings {
    OverlaySettings { depth: Some([first, last]), ..OverlaySettings::default() }
}
