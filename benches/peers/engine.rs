//! This engine: its settings and every way to trace with it.

use std::time::Instant;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Hit, Ray, Triangle};
use bvhscope_engine::glam::Vec3;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::query::HitLists;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes, Preset};
use bvhscope_engine::tree::traverse::{NoProbe, Traversal, any_hit, closest_hit};
use bvhscope_engine::tree::{AnyTree, ContainerKind, Tree};
use bvhscope_engine::wide::NodeForm;
use bvhscope_engine::wide::tree::AnyWideTree;
use rayon::prelude::*;

use crate::peer::{BuildTimes, Builder, Interface, Judged, OWN, Run};
use crate::rays::{Query, Tally, Workload};

/// Settings that are measured, by name; if `slow`, also those that take minutes.
pub fn settings(slow: bool) -> Vec<(String, BuildSettings)> {
    let setting = |preset: Preset, container: ContainerKind| {
        (format!("{} {}", container.name(), preset.name()), BuildSettings::preset(preset, container))
    };
    let mut settings = vec![
        setting(Preset::Fast, ContainerKind::Aabb),
        setting(Preset::Swift, ContainerKind::Aabb),
        setting(Preset::Hq, ContainerKind::Aabb),
        setting(Preset::Best, ContainerKind::Aabb),
        setting(Preset::Fast, ContainerKind::Sphere),
        setting(Preset::Fast, ContainerKind::Dop14),
    ];
    let oriented = Passes::NONE.with(Pass::Orient);
    let fast = BuildSettings::preset(Preset::Fast, ContainerKind::Aabb);
    settings.push(("oriented fast".to_owned(), BuildSettings { optimize: oriented, ..fast }));
    settings.extend(slow.then(|| setting(Preset::Finest, ContainerKind::Aabb)));
    settings
}

/// Every build: the binary tree, then the wide one with its triangles.
pub fn builders(triangles: &[Triangle], threads: usize, slow: bool) -> Vec<Builder<'_>> {
    let builder = |(name, settings): (String, BuildSettings)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let build = move || {
            pool.install(|| {
                let start = Instant::now();
                let tree = tree(triangles, &settings);
                let binary = start.elapsed();
                let wide = wide(&tree, triangles);
                let times = BuildTimes { binary: Some(binary), ready: start.elapsed() };
                drop(std::hint::black_box((tree, wide)));
                times
            })
        };
        Builder { engine: OWN, name, threads, build: Box::new(build) }
    };
    settings(slow).into_iter().map(builder).collect()
}

/// A tree, ready to be traced.
pub struct Ready {
    /// Name of its settings.
    pub name: String,
    /// The tree.
    pub tree: AnyTree,
    /// Its triangles in leaf order.
    pub leaf_triangles: Vec<Triangle>,
    /// The eight-wide tree.
    pub wide: AnyWideTree,
}

impl Ready {
    /// The tree, if it has boxes.
    pub fn boxes(&self) -> Option<&Tree<Aabb>> {
        if let AnyTree::Aabb(tree) = &self.tree { Some(tree) } else { None }
    }
}

/// The trees of all settings, of which the first has boxes.
pub fn ready(triangles: &[Triangle], slow: bool) -> Vec<Ready> {
    settings(slow).into_iter().map(|(name, settings)| ready_with(triangles, name, &settings)).collect()
}

/// The trees of some settings.
pub fn ready_with(triangles: &[Triangle], name: String, settings: &BuildSettings) -> Ready {
    let tree = tree(triangles, settings);
    let leaf_triangles = in_leaf_order(&tree, triangles);
    let wide = wide(&tree, triangles);
    Ready { name, tree, leaf_triangles, wide }
}

/// The tree to be measured, if it has boxes: costs of different containers do not compare.
pub fn judged(ready: &Ready) -> Option<Judged> {
    let bytes = ready.wide.node_bytes() + ready.wide.leaf_bytes();
    Some(Judged {
        engine: OWN,
        name: ready.name.clone(),
        tree: Some(ready.boxes()?.clone()),
        leaf_triangles: ready.leaf_triangles.clone(),
        bytes: Some(bytes),
    })
}

/// Every way to trace a tree; through the binary one only boxes.
pub fn interfaces(ready: &Ready) -> Vec<Interface<'_>> {
    let Ready { name, leaf_triangles, wide, .. } = ready;
    let leaf_triangles = &leaf_triangles[..];
    let level = SimdLevel::of_builds().level();
    let binary = ready.boxes().map(|tree| Interface {
        engine: OWN,
        setting: name.clone(),
        name: "binary",
        prepare: Box::new(move |work| {
            single(
                work,
                move |ray| closest_hit(tree, leaf_triangles, ray, Traversal::Ordered, &mut NoProbe),
                move |ray| any_hit(tree, leaf_triangles, ray),
            )
        }),
    });
    let of_wide = [
        Interface {
            engine: OWN,
            setting: name.clone(),
            name: "single",
            prepare: Box::new(move |work| match work.query {
                Query::All => Some(Box::new(move || {
                    let (mut tally, mut hits) = (Tally::default(), Vec::new());
                    for ray in &work.rays {
                        wide.all_hits(level, ray, usize::MAX, &mut hits);
                        hits.iter().for_each(|hit| tally.add(hit.t));
                    }
                    tally
                })),
                Query::Point => Some(Box::new(move || {
                    let nearest = |ray: &Ray| wide.closest_point(level, ray.origin, f32::INFINITY);
                    let mut tally = Tally::default();
                    work.rays.iter().filter_map(nearest).for_each(|nearest| tally.add(nearest.distance as f32));
                    tally
                })),
                Query::Closest | Query::Any => {
                    single(work, move |ray| wide.closest_hit(level, ray), move |ray| wide.any_hit(level, ray))
                }
            }),
        },
        Interface {
            engine: OWN,
            setting: name.clone(),
            name: "many",
            prepare: Box::new(move |work| match work.query {
                Query::Closest => Some(Box::new(move || {
                    let mut tally = Tally::default();
                    let mut hits = vec![None; AT_ONCE];
                    for rays in work.rays.chunks(AT_ONCE) {
                        wide.closest_hits(level, rays, &mut hits);
                        hits[..rays.len()].iter().for_each(|hit| tally.add(distance(*hit)));
                    }
                    tally
                })),
                Query::Any => Some(Box::new(move || {
                    let mut hits = 0;
                    let mut blocked = vec![false; AT_ONCE];
                    for rays in work.rays.chunks(AT_ONCE) {
                        wide.any_hits(level, rays, &mut blocked);
                        hits += blocked[..rays.len()].iter().filter(|&&blocked| blocked).count() as u64;
                    }
                    Tally { hits, distance: 0.0 }
                })),
                Query::All => Some(Box::new(move || {
                    let (mut tally, mut lists) = (Tally::default(), HitLists::default());
                    for rays in work.rays.chunks(AT_ONCE) {
                        wide.hit_lists(level, rays, usize::MAX, &mut lists);
                        lists.hits.iter().for_each(|hit| tally.add(hit.t));
                    }
                    tally
                })),
                Query::Point => {
                    let points: Vec<Vec3> = work.rays.iter().map(|ray| ray.origin).collect();
                    Some(Box::new(move || {
                        let mut tally = Tally::default();
                        let mut found = vec![None; AT_ONCE];
                        for points in points.chunks(AT_ONCE) {
                            wide.closest_points(level, points, f32::INFINITY, &mut found);
                            found[..points.len()]
                                .iter()
                                .flatten()
                                .for_each(|nearest| tally.add(nearest.distance as f32));
                        }
                        tally
                    }))
                }
            }),
        },
    ];
    binary.into_iter().chain(of_wide).collect()
}

/// Rays handed over at a time: 64 × 64 pixels of primary rays.
const AT_ONCE: usize = 4096;

/// One hit of one ray after the other; `None` for other queries.
fn single<'a>(
    work: &'a Workload,
    closest: impl Fn(&Ray) -> Option<Hit> + Send + 'a,
    any: impl Fn(&Ray) -> bool + Send + 'a,
) -> Option<Run<'a>> {
    match work.query {
        Query::Closest => Some(Box::new(move || {
            let mut tally = Tally::default();
            work.rays.iter().for_each(|ray| tally.add(distance(closest(ray))));
            tally
        })),
        Query::Any => Some(Box::new(move || {
            let hits = work.rays.iter().filter(|ray| any(ray)).count();
            Tally { hits: hits as u64, distance: 0.0 }
        })),
        Query::All | Query::Point => None,
    }
}

fn distance(hit: Option<Hit>) -> f32 {
    hit.map_or(f32::INFINITY, |hit| hit.t)
}

/// The binary tree.
pub fn tree(triangles: &[Triangle], settings: &BuildSettings) -> AnyTree {
    build_binary(triangles, settings, &CancelToken::new()).expect("nothing to refuse, the token is never cancelled").0
}

fn in_leaf_order(tree: &AnyTree, triangles: &[Triangle]) -> Vec<Triangle> {
    tree.primitive_indices().par_iter().map(|&index| triangles[index as usize]).collect()
}

/// The eight-wide tree.
pub fn wide(tree: &AnyTree, triangles: &[Triangle]) -> AnyWideTree {
    let form = NodeForm::for_triangles(triangles.len());
    AnyWideTree::new(tree, triangles, form, &CancelToken::new()).expect("the token is never cancelled")
}
