//! obvhs, a Rust crate: agglomerative trees (PLOC) with reinsertion, traced as compressed 8-wide nodes.

use std::time::Duration;

use bvhscope_engine::geometry::{Aabb, Ray, Triangle};
use bvhscope_engine::tree::{Node, Tree};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;

use crate::peer::{Builder, Interface, Judged, timed};
use crate::rays::{Query, Tally};

const NAME: &str = "obvhs";

fn settings(slow: bool) -> Vec<(&'static str, BvhBuildParams)> {
    let mut settings = vec![
        ("fastest", BvhBuildParams::fastest_build()),
        ("fast", BvhBuildParams::fast_build()),
        ("medium", BvhBuildParams::medium_build()),
    ];
    if slow {
        settings.push(("very slow", BvhBuildParams::very_slow_build()));
    }
    settings
}

/// The crate's own form of the triangles.
pub fn converted(triangles: &[Triangle]) -> Vec<obvhs::triangle::Triangle> {
    let corner = |t: &Triangle| obvhs::triangle::Triangle { v0: t.a.into(), v1: t.b.into(), v2: t.c.into() };
    triangles.iter().map(corner).collect()
}

/// Every build, to the 8-wide tree.
pub fn builders(triangles: &[obvhs::triangle::Triangle], threads: usize, slow: bool) -> Vec<Builder<'_>> {
    let builder = |(name, parameters): (&str, BvhBuildParams)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let build =
            move || pool.install(|| timed(|| build_cwbvh_from_tris(triangles, parameters, &mut Duration::default())));
        Builder { engine: NAME, name: name.to_owned(), threads, build: Box::new(build) }
    };
    settings(slow).into_iter().map(builder).collect()
}

/// A tree, ready to be traced.
pub struct Ready {
    name: &'static str,
    wide: CwBvh,
    leaf_triangles: Vec<RtTriangle>,
}

/// The trees of all settings.
pub fn ready(triangles: &[obvhs::triangle::Triangle], slow: bool) -> Vec<Ready> {
    let build = |(name, parameters)| {
        let wide = build_cwbvh_from_tris(triangles, parameters, &mut Duration::default());
        let leaf_triangles = wide.primitive_indices.iter().map(|&i| (&triangles[i as usize]).into()).collect();
        Ready { name, wide, leaf_triangles }
    };
    // The middle one is what its author compares with Embree.
    settings(slow).into_iter().filter(|(name, _)| ["medium", "very slow"].contains(name)).map(build).collect()
}

/// The trees before they become wide.
pub fn judged(triangles: &[obvhs::triangle::Triangle], ready: &[Ready], slow: bool) -> Vec<Judged> {
    let judge = |(name, parameters): (&'static str, BvhBuildParams)| {
        let binary = build_bvh2_from_tris(triangles, parameters, &mut Duration::default());
        let nodes = binary.nodes.iter().map(|node| Node {
            container: Aabb { min: node.aabb().min.into(), max: node.aabb().max.into() },
            first: node.first_index,
            count: node.prim_count,
        });
        let bytes = ready.iter().find(|ready| ready.name == name).map(|ready| {
            size_of_val(&ready.wide.nodes[..])
                + size_of_val(&ready.wide.primitive_indices[..])
                + size_of_val(&ready.leaf_triangles[..])
        });
        Judged { engine: NAME, name: name.to_owned(), tree: Some(parents_first(nodes.collect())), bytes }
    };
    settings(slow).into_iter().map(judge).collect()
}

/// A tree of the same nodes in which parents stand before their children, which reinsertion does not keep.
fn parents_first(nodes: Vec<Node<Aabb>>) -> Tree<Aabb> {
    let mut sorted: Vec<Node<Aabb>> = nodes.first().copied().into_iter().collect();
    let mut at = 0;
    while at < sorted.len() {
        if !sorted[at].is_leaf() {
            let first = sorted[at].first as usize;
            sorted[at].first = sorted.len() as u32;
            sorted.extend_from_slice(&nodes[first..first + 2]);
        }
        at += 1;
    }
    Tree { nodes: sorted, primitive_indices: Vec::new(), max_depth: 0 }
}

/// The one way to trace.
pub fn interfaces(ready: &Ready) -> Interface<'_> {
    let Ready { name, wide, leaf_triangles } = ready;
    let native = |ray: &Ray| obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max);
    Interface {
        engine: NAME,
        name: format!("{name} single"),
        prepare: Box::new(move |work| {
            Some(match work.query {
                Query::Closest => Box::new(move || {
                    let mut tally = Tally::default();
                    for ray in &work.rays {
                        let mut hit = RayHit::none();
                        wide.ray_traverse(native(ray), &mut hit, |ray, id| leaf_triangles[id].intersect(ray));
                        tally.add(hit.t);
                    }
                    tally
                }),
                Query::Any => Box::new(move || {
                    let hit =
                        |ray: &&Ray| !wide.ray_traverse_miss(native(ray), |ray, id| leaf_triangles[id].intersect(ray));
                    Tally { hits: work.rays.iter().filter(hit).count() as u64, distance: 0.0 }
                }),
            })
        }),
    }
}
