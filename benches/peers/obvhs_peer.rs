//! obvhs, a Rust crate: agglomerative trees (PLOC) with reinsertion, traced as compressed 8-wide nodes.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use bvhscope_engine::geometry::{Ray, Triangle};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::rebuild::compute_rebuild_path_flags;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use rayon::prelude::*;

use crate::obvhs_tree;
use crate::peer::{BuildTimes, Builder, Interface, Judged, Updater, timed};
use crate::rays::{Query, Tally};

/// Its name.
pub const NAME: &str = "obvhs";

/// Settings that are measured, by name.
pub fn settings(slow: bool) -> Vec<(&'static str, BvhBuildParams)> {
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

/// The binary tree.
pub fn binary(triangles: &[obvhs::triangle::Triangle], parameters: BvhBuildParams) -> Bvh2 {
    build_bvh2_from_tris(triangles, parameters, &mut Duration::default())
}

/// The 8-wide tree.
pub fn wide(triangles: &[obvhs::triangle::Triangle], parameters: BvhBuildParams) -> CwBvh {
    build_cwbvh_from_tris(triangles, parameters, &mut Duration::default())
}

/// Every build: the binary tree, and again from the triangles the compressed 8-wide one with the triangles of its leaves.
pub fn builders(triangles: &[obvhs::triangle::Triangle], threads: usize, slow: bool) -> Vec<Builder<'_>> {
    let builder = |(name, parameters): (&str, BvhBuildParams)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let build = move || {
            pool.install(|| {
                let binary = timed(|| binary(triangles, parameters));
                let ready = timed(|| {
                    let wide = wide(triangles, parameters);
                    let leaf_triangles = in_leaf_order(&wide.primitive_indices, triangles);
                    (wide, leaf_triangles)
                });
                BuildTimes { binary: Some(binary), ready }
            })
        };
        Builder { engine: NAME, name: name.to_owned(), threads, build: Box::new(build) }
    };
    settings(slow).into_iter().map(builder).collect()
}

/// Every update of a binary tree: fitted; and those leaves that move, with all above them, built again. The compressed tree is made again,
/// as there is no other way.
pub fn updaters<'a>(
    at_rest: &[obvhs::triangle::Triangle],
    moments: &'a [Vec<obvhs::triangle::Triangle>],
    moves: &'a [bool],
    threads: usize,
) -> Vec<Updater<'a>> {
    let updater = |name: &'static str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let mut tree = binary(at_rest, BvhBuildParams::fastest_build());
        let (mut builder, mut flags) = (PlocBuilder::with_capacity(at_rest.len()), Vec::new());
        let traced = Rc::new(RefCell::new(None));
        let shown = Rc::clone(&traced);
        Updater {
            engine: NAME,
            name: format!("fastest, {name}"),
            threads,
            update: Box::new(move |moment| {
                let triangles = &moments[moment][..];
                let (times, result) = pool.install(|| {
                    let mut result = None;
                    let mut until_binary = Duration::ZERO;
                    let ready = timed(|| {
                        until_binary = timed(|| {
                            tree.init_primitives_to_nodes_if_uninit();
                            for (primitive, triangle) in triangles.iter().enumerate() {
                                tree.nodes[tree.primitives_to_nodes[primitive] as usize].set_aabb(triangle.aabb());
                            }
                            if name == "refit" {
                                tree.refit_all();
                                return;
                            }
                            tree.init_parents_if_uninit();
                            let moved = (0..triangles.len()).filter(|&primitive| moves[primitive]);
                            let leaves: Vec<u32> = moved.map(|primitive| tree.primitives_to_nodes[primitive]).collect();
                            compute_rebuild_path_flags(&tree, leaves, &mut flags);
                            let settings = (PlocSearchDistance::Minimum, SortPrecision::U64, 0);
                            builder.partial_rebuild(&mut tree, |node| flags[node], settings.0, settings.1, settings.2);
                        });
                        let wide = bvh2_to_cwbvh(&tree, 3, true, false);
                        let leaf_triangles = in_leaf_order(&wide.primitive_indices, triangles);
                        result = Some(Ready { name, wide, leaf_triangles });
                    });
                    (BuildTimes { binary: Some(until_binary), ready }, result)
                });
                *traced.borrow_mut() = result;
                times
            }),
            trace: Box::new(move |work| {
                let ready = shown.borrow();
                let run = ready.as_ref().and_then(|ready| (interfaces(ready).prepare)(work).map(|mut run| run()));
                run.unwrap_or_default()
            }),
        }
    };
    ["refit", "partial rebuild"].map(updater).into()
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
        let wide = wide(triangles, parameters);
        let leaf_triangles = in_leaf_order(&wide.primitive_indices, triangles);
        Ready { name, wide, leaf_triangles }
    };
    // The fastest to build; the middle one, which its author compares with Embree; the best.
    let traced = |name: &str| ["fastest", "medium", "very slow"].contains(&name);
    settings(slow).into_iter().filter(|(name, _)| traced(name)).map(build).collect()
}

fn in_leaf_order(indices: &[u32], triangles: &[obvhs::triangle::Triangle]) -> Vec<RtTriangle> {
    indices.par_iter().map(|&index| (&triangles[index as usize]).into()).collect()
}

/// The trees before they become wide.
pub fn judged(
    triangles: &[Triangle],
    converted: &[obvhs::triangle::Triangle],
    ready: &[Ready],
    slow: bool,
) -> Vec<Judged> {
    let judge = |(name, parameters): (&'static str, BvhBuildParams)| {
        let bytes = ready.iter().find(|ready| ready.name == name).map(|ready| {
            size_of_val(&ready.wide.nodes[..])
                + size_of_val(&ready.wide.primitive_indices[..])
                + size_of_val(&ready.leaf_triangles[..])
        });
        let tree = obvhs_tree::binary(&binary(converted, parameters));
        let leaf_triangles = tree.primitive_indices.iter().map(|&index| triangles[index as usize]).collect();
        Judged { engine: NAME, name: name.to_owned(), tree: Some(tree), leaf_triangles, bytes }
    };
    settings(slow).into_iter().map(judge).collect()
}

/// The one way to trace.
pub fn interfaces(ready: &Ready) -> Interface<'_> {
    let Ready { name, wide, leaf_triangles } = ready;
    let native = |ray: &Ray| obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max);
    Interface {
        engine: NAME,
        setting: (*name).to_owned(),
        name: "single",
        prepare: Box::new(move |work| match work.query {
            Query::Closest => Some(Box::new(move || {
                let mut tally = Tally::default();
                for ray in &work.rays {
                    let mut hit = RayHit::none();
                    wide.ray_traverse(native(ray), &mut hit, |ray, id| leaf_triangles[id].intersect(ray));
                    tally.add(hit.t);
                }
                tally
            })),
            Query::Any => Some(Box::new(move || {
                let hit =
                    |ray: &&Ray| !wide.ray_traverse_miss(native(ray), |ray, id| leaf_triangles[id].intersect(ray));
                Tally { hits: work.rays.iter().filter(hit).count() as u64, distance: 0.0 }
            })),
            Query::All | Query::Point => None,
        }),
    }
}
