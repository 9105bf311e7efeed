//! tinybvh: binned SAH or spatial splits, traced as eight-wide nodes with AVX2, one ray at a time.

use std::time::Instant;

use bvhscope_engine::Aabb;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::Tree;

use crate::foreign::{Below, tree_below};
use crate::peer::{BuildTimes, Builder, Interface, Judged};
use crate::rays::{Query, Tally};
use crate::tinybvh_library::{BinaryTree, FAR, Node, Quality, Ray, Vertex, WideTree};

/// Its name.
pub const NAME: &str = "tinybvh";

/// Settings that are measured, by name: the default builder, and the one with spatial splits.
/// Its nodes are traced with AVX2, so there are none below that level.
pub fn settings() -> &'static [(&'static str, Quality)] {
    let is_there = matches!(SimdLevel::of_builds(), SimdLevel::Avx2 | SimdLevel::Avx512);
    if is_there { &[("default", Quality::Default), ("hq", Quality::High)] } else { &[] }
}

/// Every build: the binary tree, and the eight-wide one made from it.
pub fn builders(vertices: &[Vertex], threads: usize) -> Vec<Builder<'_>> {
    let builder = |&(name, quality): &(&'static str, Quality)| {
        // The library starts as many threads as there are processors, which run where the thread may that starts them.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).start_handler(move |_| run_on(threads)).build();
        let pool = pool.expect("threads can be started");
        let build = move || {
            pool.install(|| {
                let start = Instant::now();
                let tree = BinaryTree::build(vertices, quality);
                let binary = start.elapsed();
                let wide = tree.into_wide();
                let times = BuildTimes { binary: Some(binary), ready: start.elapsed() };
                drop(std::hint::black_box(wide));
                times
            })
        };
        Builder { engine: NAME, name: name.to_owned(), threads, build: Box::new(build) }
    };
    settings().iter().map(builder).collect()
}

/// Restricts this thread, and those that it starts, to `threads` processors.
#[cfg(target_os = "linux")]
fn run_on(threads: usize) {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
    let Ok(all) = sched_getaffinity(None) else { return };
    let mut few = CpuSet::new();
    let allowed = (0..CpuSet::MAX_CPU).filter(|&processor| all.is_set(processor));
    allowed.take(threads).for_each(|processor| few.set(processor));
    if let Err(error) = sched_setaffinity(None, &few) {
        eprintln!("{NAME} builds with all threads: {error}");
    }
}

#[cfg(not(target_os = "linux"))]
fn run_on(_: usize) {}

/// A tree, ready to be traced.
pub struct Ready {
    name: &'static str,
    wide: WideTree,
}

/// The trees of all settings.
pub fn ready(vertices: &[Vertex]) -> Vec<Ready> {
    let build = |&(name, quality): &(&'static str, Quality)| {
        let mut wide = BinaryTree::build(vertices, quality).into_wide();
        wide.trim();
        Ready { name, wide }
    };
    settings().iter().map(build).collect()
}

/// A binary tree in this crate's form.
pub fn binary(vertices: &[Vertex], quality: Quality) -> Tree<Aabb> {
    if vertices.is_empty() {
        return Tree::EMPTY;
    }
    let tree = BinaryTree::build(vertices, quality);
    let (nodes, indices) = tree.parts();
    tree_below(0_u32, |&index| {
        let node: &Node = &nodes[index as usize];
        let below = if node.count > 0 {
            Below::Primitives(&indices[node.first as usize..(node.first + node.count) as usize])
        } else {
            Below::Children(vec![node.first, node.first + 1])
        };
        (node.bounds(), below)
    })
}

/// The trees before they become wide.
pub fn judged(triangles: &[Triangle], vertices: &[Vertex], ready: &[Ready]) -> Vec<Judged> {
    let judge = |&(name, quality): &(&'static str, Quality)| {
        let tree = binary(vertices, quality);
        Judged {
            engine: NAME,
            name: name.to_owned(),
            leaf_triangles: tree.primitive_indices.iter().map(|&index| triangles[index as usize]).collect(),
            tree: Some(tree),
            bytes: ready.iter().find(|ready| ready.name == name).map(|ready| ready.wide.bytes),
        }
    };
    settings().iter().map(judge).collect()
}

/// The one way to trace.
pub fn interfaces(ready: &Ready) -> Interface<'_> {
    let Ready { name, wide } = ready;
    Interface {
        engine: NAME,
        setting: (*name).to_owned(),
        name: "single",
        prepare: Box::new(move |work| {
            let mut rays: Vec<Ray> = work.rays.iter().map(Ray::new).collect();
            match work.query {
                Query::Closest => {
                    let ends: Vec<f32> = rays.iter().map(|ray| ray.t).collect();
                    Some(Box::new(move || {
                        let mut tally = Tally::default();
                        for (ray, &end) in rays.iter_mut().zip(&ends) {
                            ray.t = end;
                            wide.intersect(ray);
                            tally.add(if ray.t < FAR { ray.t } else { f32::INFINITY });
                        }
                        tally
                    }))
                }
                Query::Any => Some(Box::new(move || {
                    let hits = rays.iter().filter(|ray| wide.is_occluded(ray)).count();
                    Tally { hits: hits as u64, distance: 0.0 }
                })),
                Query::All | Query::Point => None,
            }
        }),
    }
}
