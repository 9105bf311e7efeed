//! This engine's trees of two levels, over copies of meshes, and every way to trace them.

use std::sync::Arc;

use bvhscope::scene::SceneCopies;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::{ContainerKind, InstanceHit, Instances, Placed, build};

use crate::peer::{BuildTimes, Builder, Interface, OWN, Run, timed};
use crate::rays::{Query, Tally, Workload};

/// Presets of the trees, and times as many parts in the tree above as there are copies.
const SETTINGS: [(Preset, f32); 5] =
    [(Preset::Swift, 1.0), (Preset::Fast, 1.0), (Preset::Fast, 2.0), (Preset::Fast, 4.0), (Preset::Best, 2.0)];
/// Rays handed over at a time, as through flat trees.
const AT_ONCE: usize = 4096;

fn name((preset, open): (Preset, f32)) -> String {
    format!("two levels {}, open {open}", preset.name())
}

/// The copies as the engine takes them.
pub fn placed(copies: &SceneCopies) -> Vec<Placed> {
    let copies = copies.copies();
    let placed = |copy: u32| Placed { mesh: copies.mesh(copy), transform: copies.place(copy).transform() };
    (0..copies.len() as u32).map(placed).collect()
}

/// The trees of the meshes and the one over the copies.
fn two_levels(meshes: &[&[Triangle]], placed: &[Placed], (preset, open): (Preset, f32)) -> Instances {
    let (settings, token) = (BuildSettings::preset(preset, ContainerKind::Aabb), CancelToken::new());
    let mesh =
        |triangles: &&[Triangle]| Arc::new(build(triangles, &settings, &token).expect("a preset is not refused"));
    let meshes = meshes.iter().map(mesh).collect();
    Instances::build(meshes, placed, &settings, open, &token).expect("the scene was made of these copies")
}

/// Every build.
pub fn builders<'a>(meshes: &'a [&[Triangle]], placed: &'a [Placed], threads: usize) -> Vec<Builder<'a>> {
    let builder = |setting| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let ready = move || pool.install(|| timed(|| two_levels(meshes, placed, setting)));
        let build = move || BuildTimes { binary: None, ready: ready() };
        Builder { engine: OWN, name: name(setting), threads, build: Box::new(build) }
    };
    SETTINGS.into_iter().map(builder).collect()
}

/// The trees of all settings.
pub fn ready(meshes: &[&[Triangle]], placed: &[Placed]) -> Vec<(String, Instances)> {
    SETTINGS.into_iter().map(|setting| (name(setting), two_levels(meshes, placed, setting))).collect()
}

/// Every way to trace two levels.
pub fn interfaces<'a>(setting: &str, instances: &'a Instances) -> [Interface<'a>; 2] {
    let distance = |hit: Option<InstanceHit>| hit.map_or(f32::INFINITY, |hit| hit.t);
    let interface = |name, prepare| Interface { engine: OWN, setting: setting.to_owned(), name, prepare };
    let single = move |work: &'a Workload| -> Option<Run<'a>> {
        let rays = &work.rays;
        match work.query {
            Query::Closest => Some(Box::new(move || {
                let mut tally = Tally::default();
                rays.iter().for_each(|ray| tally.add(distance(instances.closest_hit(ray))));
                tally
            })),
            Query::Any => Some(Box::new(move || {
                let hits = rays.iter().filter(|ray| instances.any_hit(ray)).count();
                Tally { hits: hits as u64, distance: 0.0 }
            })),
            Query::All => Some(Box::new(move || {
                let (mut tally, mut hits) = (Tally::default(), Vec::new());
                for ray in rays {
                    instances.all_hits(ray, usize::MAX, &mut hits);
                    hits.iter().for_each(|hit| tally.add(hit.t));
                }
                tally
            })),
            Query::Point => None,
        }
    };
    let many = move |work: &'a Workload| -> Option<Run<'a>> {
        let rays = &work.rays;
        match work.query {
            Query::Closest => Some(Box::new(move || {
                let (mut tally, mut hits) = (Tally::default(), vec![None; AT_ONCE]);
                for rays in rays.chunks(AT_ONCE) {
                    instances.closest_hits(rays, &mut hits);
                    hits[..rays.len()].iter().for_each(|hit| tally.add(distance(*hit)));
                }
                tally
            })),
            Query::Any => Some(Box::new(move || {
                let (mut hits, mut blocked) = (0, vec![false; AT_ONCE]);
                for rays in rays.chunks(AT_ONCE) {
                    instances.any_hits(rays, &mut blocked);
                    hits += blocked[..rays.len()].iter().filter(|&&blocked| blocked).count() as u64;
                }
                Tally { hits, distance: 0.0 }
            })),
            Query::All | Query::Point => None,
        }
    };
    [interface("single", Box::new(single)), interface("many", Box::new(many))]
}
