//! Hits of rays in trees of every arity against a plain test of every triangle, in the trees themselves and in the wide trees
//! made from them.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, Ray, Sphere};
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::traverse::{NoProbe, RayEvent, RayLog, Traversal, closest_hit, closest_hit_with, new_stack};
use bvhscope_engine::tree::{AnyTree, Container as _, Node, Tree};
use glam::Vec3;

use super::{ARITIES, irregular, widened};
use crate::brute_force::check;
use crate::trees::{self, scan};

#[test]
fn trees_of_every_arity_find_what_a_scan_finds() {
    for (seed, (name, triangles)) in (0..).zip(trees::nasty_scenes()) {
        let rays = trees::rays(&triangles, 40, seed);
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        for binary in [
            trees::halved::<Aabb>(&triangles, 1),
            trees::halved::<Sphere>(&triangles, 5),
            trees::halved::<Dop14>(&triangles, 5),
        ] {
            for arity in ARITIES {
                let kind = binary.container_kind();
                check(&format!("{name}, {kind:?}, {arity}"), &triangles, &widened(&binary, arity), &rays, &expected);
                let mixed = irregular(&binary, arity, seed);
                check(&format!("{name}, {kind:?}, 1 to {arity}"), &triangles, &mixed, &rays, &expected);
            }
        }
    }
}

#[test]
fn built_trees_with_split_triangles_or_large_leaves_stay_right_when_widened() {
    let triangles = trees::soup(500, 0.8, 8);
    let rays = trees::rays(&triangles, 120, 9);
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    let split = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let (split, _) = build_binary(&triangles, &split, &CancelToken::new()).unwrap();
    assert!(split.primitive_indices().len() > triangles.len(), "some triangles are in several leaves");
    for (name, tree) in [("split", split), ("large leaves", trees::halved::<Aabb>(&triangles, 140))] {
        for arity in ARITIES {
            check(&format!("{name}, {arity}"), &triangles, &widened(&tree, arity), &rays, &expected);
            check(&format!("{name}, 1 to {arity}"), &triangles, &irregular(&tree, arity, 4), &rays, &expected);
        }
    }
}

/// Spheres around the parts of split triangles, which no builder of ours makes.
#[test]
fn split_triangles_in_spheres_are_traced_and_validated() {
    let triangles = trees::soup(300, 0.8, 18);
    let split = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let (split, _) = build_binary(&triangles, &split, &CancelToken::new()).unwrap();
    let AnyTree::Aabb(boxes) = &split else { unreachable!("boxes are the default") };
    let around = |bounds: &Aabb| Sphere { center: bounds.center(), radius: bounds.extent().length() * 0.5 };
    let mut nodes: Vec<_> =
        boxes.nodes.iter().map(|n| Node { container: around(&n.container), first: n.first, count: n.count }).collect();
    for index in (0..nodes.len()).rev() {
        let below = nodes[index].children().map(|child| nodes[child as usize].container);
        nodes[index].container = below.fold(nodes[index].container, |all, child| all.union(&child));
    }
    let spheres = Tree { nodes, primitive_indices: boxes.primitive_indices.clone(), max_depth: boxes.max_depth };
    let rays = trees::rays(&triangles, 120, 19);
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    for arity in [2, 8] {
        check(&format!("{arity}"), &triangles, &widened(&spheres.clone().into(), arity), &rays, &expected);
    }
}

/// A node in which the first child has all the rest and 31 leaves wait: more siblings than levels, and than any stack has at
/// first.
fn waiting(levels: u32) -> (Tree<Aabb>, Vec<bvhscope_engine::Triangle>) {
    let triangles = trees::soup(31 * levels as usize + 1, 0.3, 4);
    let everything = triangles.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()));
    let mut nodes = vec![Node { container: everything, first: 31 * levels, count: 1 }];
    for level in 0..levels {
        let at = (32 * level).saturating_sub(31) as usize;
        nodes[at] = Node::interior(everything, nodes.len() as u32, 32);
        nodes.push(Node { container: everything, first: 31 * levels, count: 1 });
        nodes.extend((0..31).map(|leaf| Node { container: everything, first: 31 * level + leaf, count: 1 }));
    }
    (Tree { nodes, primitive_indices: (0..triangles.len() as u32).collect(), max_depth: levels }, triangles)
}

#[test]
fn stacks_hold_all_siblings_that_wait() {
    for levels in [1, 9, 40, 300] {
        let (tree, triangles) = waiting(levels);
        for ray in trees::rays(&triangles, 40, 5) {
            let expected = scan(&triangles, &ray);
            let mut stack = new_stack(tree.max_depth);
            for traversal in Traversal::ALL {
                let hit = closest_hit(&tree, &triangles, &ray, traversal, &mut NoProbe);
                assert_eq!(hit, expected, "{levels} levels, {traversal:?}");
                let level = bvhscope_engine::kernel::SimdLevel::best().level();
                let again = fearless_simd::dispatch!(level, simd => {
                    closest_hit_with(simd, &tree, &triangles, &ray, traversal, &mut stack, &mut NoProbe)
                });
                assert_eq!(again, expected, "{levels} levels, {traversal:?}, with a stack");
            }
        }
    }
    let (tree, triangles) = waiting(40);
    let mut log = RayLog::default();
    closest_hit(&tree, &triangles, &Ray::new(Vec3::splat(0.01), Vec3::X), Traversal::Paper, &mut log);
    let (mut waiting, mut most) = (0, 0);
    for event in log.events() {
        waiting += i32::from(matches!(event, RayEvent::Push { .. })) - i32::from(matches!(event, RayEvent::Pop { .. }));
        most = most.max(waiting);
    }
    assert_eq!(most, 31 * 40, "all leaves wait before the first of them is visited");
}
