//! Interleaved rounds over all engines, so that a slow moment of the machine hits all of them alike.

use std::sync::Barrier;
use std::thread;
use std::time::{Duration, Instant};

use bvhscope_engine::Aabb;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::collapsed_cost_of;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::{AnyTree, Tree};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};

use crate::embree::{self, Device, Mode, Scene};
use crate::embree_library::libraries;
use crate::embree_motion;
use crate::embree_queries;
use crate::embree_rays;
use crate::embree_tree;
use crate::engine;
use crate::motion::{self, Twist};
use crate::obvhs_peer;
use crate::peer::{Builder, Interface, Judged, OWN, Run, Updater};
use crate::rays::{OCCLUSION_RAYS, Query, Tally, WORKS, Workload, in_parts, workloads};
use crate::scenes::Subject;
use crate::{tinybvh_library, tinybvh_peer};

/// Parts of a scene's measurement. "picture" is the sum of a build and of rays, where both are measured.
pub const PARTS: [&str; 9] =
    ["build", "tree", "primary", "ao", "diffuse", "all-hits", "closest-point", "picture", "update"];
/// Samples of ambient occlusion per pixel of the measured pictures.
const PICTURES: [u32; 3] = [1, 16, 256];
/// One ray in this many is counted through the trees.
pub const COUNTED: usize = 16;
/// Width and height of the picture by which updates are checked.
const CHECKED_SIZE: u32 = 256;

/// Parts to be measured, and repetitions.
pub struct Plan {
    /// Some of [`PARTS`].
    pub parts: Vec<String>,
    /// Engines and interfaces whose name contains one of these; all where it is empty.
    pub only: Vec<String>,
    /// Also the settings that take long to build.
    pub slow: bool,
    /// Measured rounds.
    pub repeat: usize,
    /// Numbers of threads of builds and rays.
    pub threads: Vec<usize>,
    /// Width and height of the picture in pixels.
    pub size: u32,
}

impl Plan {
    /// True if a part is to be measured.
    pub fn wants(&self, part: &str) -> bool {
        self.parts.iter().any(|wanted| wanted == part)
    }

    /// True if an engine's setting or interface is to be measured.
    pub fn names(&self, engine: &str, name: &str) -> bool {
        let full = format!("{engine} {name}");
        self.only.is_empty() || self.only.iter().any(|wanted| full.contains(wanted.as_str()))
    }
}

/// One line of the table of builds.
pub struct BuildRow {
    pub engine: &'static str,
    pub name: String,
    pub threads: usize,
    /// Median, shortest and longest time until everything is there that the fastest rays need.
    pub ready: [Duration; 3],
    /// The same of the binary tree, where there is one.
    pub binary: Option<[Duration; 3]>,
    /// Its rate until it is ready over that of the fastest peer with as many threads.
    pub ratio: Option<f64>,
}

/// One line of the table of trees.
pub struct TreeRow {
    pub engine: &'static str,
    pub name: String,
    pub sah_cost: Option<f64>,
    /// Its cost over that of the best peer.
    pub ratio: Option<f64>,
    /// End-point overlap.
    pub overlap: Option<f64>,
    /// Tests and reads of each kind of rays.
    pub counts: Vec<(&'static str, RayCounts)>,
    pub bytes: Option<usize>,
}

/// Averages of single rays.
#[derive(Debug, Clone, Copy)]
pub struct RayCounts {
    /// Container tests in the binary tree.
    pub containers: f64,
    /// Triangle tests in the binary tree.
    pub triangles: f64,
    /// Bytes of the cache lines that are read of this engine's wide tree, made from the binary one.
    pub bytes: f64,
}

/// One line of a table of rays.
pub struct TraceRow {
    pub work: &'static str,
    pub engine: &'static str,
    pub setting: String,
    pub name: &'static str,
    pub threads: usize,
    pub rays: usize,
    pub tally: Tally,
    /// Median, shortest and longest.
    pub time: [Duration; 3],
    /// Its rate over that of the fastest peer with as many threads.
    pub ratio: Option<f64>,
}

/// The time from triangles to a picture: the build, primary rays, and ambient occlusion from each of their hits, each through the
/// engine's fastest interface.
pub struct PictureRow {
    pub engine: &'static str,
    pub name: String,
    pub threads: usize,
    /// Ambient occlusion rays from each hit.
    pub samples: u32,
    pub time: Duration,
    /// How many times sooner it is there than that of the fastest peer with as many threads.
    pub ratio: Option<f64>,
}

/// Results of one scene.
pub struct Outcome {
    pub model: String,
    pub triangles: usize,
    pub repeat: usize,
    pub builds: Vec<BuildRow>,
    /// Updates of trees whose triangles have moved.
    pub updates: Vec<BuildRow>,
    pub trees: Vec<TreeRow>,
    pub traces: Vec<TraceRow>,
    pub pictures: Vec<PictureRow>,
    /// Where hits are not the same.
    pub disagreements: Vec<String>,
}

impl Outcome {
    /// Of a scene, without results.
    pub fn new(subject: &Subject, plan: &Plan) -> Self {
        Self {
            model: subject.name.clone(),
            triangles: subject.triangles.len(),
            repeat: plan.repeat,
            builds: Vec::new(),
            updates: Vec::new(),
            trees: Vec::new(),
            traces: Vec::new(),
            pictures: Vec::new(),
            disagreements: Vec::new(),
        }
    }
}

/// Measures one scene.
pub fn measure(subject: &Subject, plan: &Plan) -> Outcome {
    let triangles = &subject.triangles[..];
    let mut outcome = Outcome::new(subject, plan);
    let (mesh, converted) = (embree::Mesh::new(triangles), obvhs_peer::converted(triangles));
    let vertices = tinybvh_library::vertices(triangles);
    if plan.wants("build") {
        for &threads in &plan.threads {
            // Embree builds with the threads of that device which has the most: there must be no other.
            let devices = devices(threads);
            let mut builders = engine::builders(triangles, threads, plan.slow);
            builders.extend(devices.iter().flat_map(|device| embree::builders(device, &mesh, threads, plan.slow)));
            builders.extend(obvhs_peer::builders(&converted, threads, plan.slow));
            builders.extend(tinybvh_peer::builders(&vertices, threads));
            builders.retain(|builder| plan.names(builder.engine, &builder.name));
            outcome.builds.extend(build_rows(&builders, plan.repeat));
        }
    }
    if plan.wants("update") {
        for &threads in &plan.threads {
            let (rows, disagreements) = update_rows(subject, &mesh, &converted, threads, plan);
            outcome.updates.extend(rows);
            outcome.disagreements.extend(disagreements);
        }
    }
    let traced = WORKS.iter().any(|part| plan.wants(part));
    if !(plan.wants("tree") || traced) {
        return outcome;
    }
    let devices = devices(0);
    let ready = engine::ready(triangles, plan.slow);
    let obvhs_ready = obvhs_peer::ready(&converted, plan.slow);
    let tinybvh_ready = tinybvh_peer::ready(&vertices);
    let boxes = ready[0].boxes().expect("the first setting has boxes");
    let works = workloads(boxes, triangles, &subject.bounds, &subject.camera, plan.size);
    if plan.wants("tree") {
        let mut judged: Vec<Judged> = ready.iter().filter_map(engine::judged).collect();
        judged.extend(devices.iter().flat_map(|device| embree_tree::judged(device, triangles, &mesh, plan.slow)));
        judged.extend(obvhs_peer::judged(triangles, &converted, &obvhs_ready, plan.slow));
        judged.extend(tinybvh_peer::judged(triangles, &vertices, &tinybvh_ready));
        judged.retain(|judged| plan.names(judged.engine, &judged.name));
        outcome.trees = tree_rows(judged, triangles, &works);
    }
    if traced {
        let (mesh, modes) = (&mesh, &embree::modes(plan.slow));
        let scenes = |device| modes.iter().map(move |&mode| embree::commit(device, mesh, mode));
        let scenes: Vec<Scene> = devices.iter().flat_map(scenes).collect();
        // Only these queries bring a filter function: others are slower where the scene allows it.
        let filtered = modes.iter().map(|&mode| Mode { has_filter: true, ..mode }).filter(|_| plan.wants("all-hits"));
        let filtered = |device| filtered.clone().map(move |mode| embree::commit(device, mesh, mode));
        let filtered: Vec<Scene> = devices.iter().flat_map(filtered).collect();
        for &threads in &plan.threads {
            let parts = works.each_ref().map(|work| in_parts(work, threads));
            let mut interfaces: Vec<Interface> = ready.iter().flat_map(engine::interfaces).collect();
            interfaces.extend(scenes.iter().flat_map(embree_rays::interfaces));
            interfaces.extend(scenes.iter().map(|scene| embree_queries::closest_point(scene, mesh)));
            interfaces.extend(filtered.iter().map(embree_queries::all_hits));
            interfaces.extend(obvhs_ready.iter().map(obvhs_peer::interfaces));
            interfaces.extend(tinybvh_ready.iter().map(tinybvh_peer::interfaces));
            for parts in parts.iter().filter(|parts| plan.wants(parts[0].name)) {
                let (rows, disagreements) = trace_rows(&interfaces, parts, plan);
                outcome.traces.extend(rows);
                outcome.disagreements.extend(disagreements);
            }
        }
    }
    if plan.wants("picture") {
        outcome.pictures = picture_rows(&outcome.builds, &outcome.traces);
    }
    outcome
}

/// Each Embree that is there, with a number of threads.
pub fn devices(threads: usize) -> Vec<Device> {
    libraries().iter().map(|library| Device::new(library, threads)).collect()
}

/// Builds in turn.
pub fn build_rows(builders: &[Builder], repeat: usize) -> Vec<BuildRow> {
    let mut times: Vec<(Vec<Duration>, Vec<Duration>)> = builders.iter().map(|_| Default::default()).collect();
    for round in 0..=repeat {
        for (builder, (ready, binary)) in builders.iter().zip(&mut times) {
            let built = (builder.build)();
            // The first round warms up.
            if round > 0 {
                ready.push(built.ready);
                binary.extend(built.binary);
            }
        }
    }
    let row = |(builder, (ready, binary)): (&Builder, _)| {
        row_of(builder.engine, &builder.name, builder.threads, ready, binary)
    };
    with_ratios(builders.iter().zip(times).map(row).collect())
}

fn row_of(engine: &'static str, name: &str, threads: usize, ready: Vec<Duration>, binary: Vec<Duration>) -> BuildRow {
    let binary = (!binary.is_empty()).then(|| spread(binary));
    BuildRow { engine, name: name.to_owned(), threads, ready: spread(ready), binary, ratio: None }
}

fn with_ratios(mut rows: Vec<BuildRow>) -> Vec<BuildRow> {
    for at in 0..rows.len() {
        let same = rows.iter().filter(|row| row.engine != OWN && row.threads == rows[at].threads);
        let best = same.map(|row| row.ready[0]).min();
        rows[at].ratio = best.map(|best| best.as_secs_f64() / rows[at].ready[0].as_secs_f64());
    }
    rows
}

/// Updates of every engine in turn, from moment to moment, and where their hits after the last disagree.
fn update_rows(
    subject: &Subject,
    mesh: &embree::Mesh,
    converted: &[obvhs::triangle::Triangle],
    threads: usize,
    plan: &Plan,
) -> (Vec<BuildRow>, Vec<String>) {
    let (triangles, twist) = (&subject.triangles[..], Twist::of(&subject.bounds));
    let moments = twist.moments(triangles);
    let of_obvhs: Vec<_> = moments.iter().map(|triangles| obvhs_peer::converted(triangles)).collect();
    let moves: Vec<bool> = triangles.iter().map(|triangle| twist.moves(triangle)).collect();
    let devices = devices(threads);
    let mut updaters = motion::updaters(triangles, &moments, threads);
    updaters.extend(devices.iter().flat_map(|device| embree_motion::updaters(device, mesh, &twist, threads)));
    updaters.extend(obvhs_peer::updaters(converted, &of_obvhs, &moves, threads));
    updaters.retain(|updater| plan.names(updater.engine, &updater.name));
    let mut times: Vec<(Vec<Duration>, Vec<Duration>)> = updaters.iter().map(|_| Default::default()).collect();
    // The first round warms up; the last one ends at the last moment.
    let rounds = plan.repeat + 1;
    for round in 0..=rounds {
        for (updater, (ready, binary)) in updaters.iter_mut().zip(&mut times) {
            let updated = (updater.update)((round + rounds + 1) % moments.len());
            if round > 0 {
                ready.push(updated.ready);
                binary.extend(updated.binary);
            }
        }
    }
    let last = moments.last().map_or(triangles, |triangles| &triangles[..]);
    let AnyTree::Aabb(tree) = engine::tree(last, &engine::settings(false)[0].1) else { unreachable!("of boxes") };
    let [primary, ..] = workloads(&tree, last, &subject.bounds, &subject.camera, CHECKED_SIZE);
    let mut tallies = updaters.iter().map(|updater| (updater, (updater.trace)(&primary)));
    let mut disagreements = Vec::new();
    if let Some((_, reference)) = tallies.next() {
        let few = (primary.rays.len() as f64 * HIT_TOLERANCE).ceil() as u64;
        for (updater, tally) in tallies {
            let differs = (tally.distance - reference.distance).abs() > DISTANCE_TOLERANCE * reference.distance;
            if tally.hits.abs_diff(reference.hits) > few || differs {
                let name = format!("{} {}", updater.engine, updater.name);
                disagreements.push(format!("{name} finds {tally:?} of the moved triangles, the first {reference:?}"));
            }
        }
    }
    let row = |(updater, (ready, binary)): (&Updater, _)| {
        row_of(updater.engine, &updater.name, updater.threads, ready, binary)
    };
    (with_ratios(updaters.iter().zip(times).map(row).collect()), disagreements)
}

fn tree_rows(judged: Vec<Judged>, triangles: &[Triangle], works: &[Workload]) -> Vec<TreeRow> {
    let row = |judged: Judged| {
        let counts = judged.tree.as_ref().map_or_else(Vec::new, |tree| {
            let wide = engine::wide(&AnyTree::Aabb(tree.clone()), triangles);
            let works = works.iter().filter(|work| matches!(work.query, Query::Closest | Query::Any));
            works.map(|work| (work.name, counts_of(tree, &judged.leaf_triangles, &wide, work))).collect()
        });
        TreeRow {
            engine: judged.engine,
            name: judged.name,
            sah_cost: judged.tree.as_ref().map(collapsed_cost_of),
            ratio: None,
            counts,
            bytes: judged.bytes,
            overlap: judged.tree.map(|tree| {
                let tree = AnyTree::Aabb(tree);
                let overlap = end_point_overlap(&tree, triangles, usize::MAX, &CancelToken::new());
                overlap.expect("the token is never cancelled").value.into()
            }),
        }
    };
    let mut rows: Vec<TreeRow> = judged.into_iter().map(row).collect();
    let best = rows.iter().filter(|row| row.engine != OWN).filter_map(|row| row.sah_cost).min_by(f64::total_cmp);
    for row in &mut rows {
        row.ratio = row.sah_cost.zip(best).map(|(cost, best)| cost / best);
    }
    rows
}

/// Averages over every [`COUNTED`]th ray.
fn counts_of(tree: &Tree<Aabb>, leaf_triangles: &[Triangle], wide: &AnyWideTree, work: &Workload) -> RayCounts {
    let (mut tests, mut lines) = (TestCounts::default(), CacheLines::default());
    let mut probe = LineProbe::new(wide);
    let level = SimdLevel::of_builds().level();
    let rays = work.rays.iter().step_by(COUNTED);
    let count = rays.len().max(1) as f64;
    for ray in rays {
        match work.query {
            Query::Closest => {
                closest_hit(tree, leaf_triangles, ray, Traversal::Ordered, &mut tests);
                wide.closest_hit_with(level, ray, &mut probe);
            }
            Query::Any => {
                any_hit_with(tree, leaf_triangles, ray, &mut tests);
                wide.any_hit_with(level, ray, &mut probe);
            }
            Query::All | Query::Point => {}
        }
        lines += probe.take();
    }
    let [containers, triangles, bytes] =
        [tests.containers, tests.primitives, lines.bytes()].map(|sum| sum as f64 / count);
    RayCounts { containers, triangles, bytes }
}

/// Distances may differ by this share, and hits by this share of the rays: engines round differently at edges.
const DISTANCE_TOLERANCE: f64 = 1e-3;
const HIT_TOLERANCE: f64 = 1e-5;
/// This share where all hits count: that of a ray through an edge that two triangles share is one or two.
const ALL_HITS_TOLERANCE: f64 = 1e-4;

/// Traces a workload that is divided among as many threads as it has parts.
pub fn trace_rows<'a>(
    interfaces: &[Interface<'a>],
    parts: &'a [Workload],
    plan: &Plan,
) -> (Vec<TraceRow>, Vec<String>) {
    let mut disagreements = Vec::new();
    let prepare = |interface: &Interface<'a>| parts.iter().map(|part| (interface.prepare)(part)).collect();
    // This engine's first interface for such rays, whether it is shown or not.
    let reference = interfaces.iter().find_map(prepare).map(|mut runs: Vec<_>| run(&mut runs).0).unwrap_or_default();
    let wanted =
        |interface: &&Interface| plan.names(interface.engine, &format!("{} {}", interface.setting, interface.name));
    let wanted = interfaces.iter().filter(wanted);
    let mut runs: Vec<(&Interface, Vec<Run>, Vec<Duration>)> =
        wanted.filter_map(|interface| Some((interface, prepare(interface)?, Vec::new()))).collect();
    let (work, rays) = (parts[0].name, parts.iter().map(|part| part.rays.len()).sum::<usize>());
    let mut tallies = Vec::new();
    for round in 0..=plan.repeat {
        for (interface, runs, times) in &mut runs {
            let (tally, time) = run(runs);
            if round > 0 {
                times.push(time);
                continue;
            }
            // The first round warms up, and is checked.
            tallies.push(tally);
            let few = match parts[0].query {
                Query::All => reference.hits as f64 * ALL_HITS_TOLERANCE,
                _ => rays as f64 * HIT_TOLERANCE,
            };
            let few = few.ceil() as u64;
            if tally.hits.abs_diff(reference.hits) > few
                || (tally.distance - reference.distance).abs() > DISTANCE_TOLERANCE * reference.distance
            {
                disagreements.push(format!(
                    "{} {} {} finds {tally:?} with {work} rays, {OWN} {reference:?}",
                    interface.engine, interface.setting, interface.name
                ));
            }
        }
    }
    let rows = runs.into_iter().zip(tallies).map(|((interface, _, times), tally)| TraceRow {
        work,
        engine: interface.engine,
        setting: interface.setting.clone(),
        name: interface.name,
        threads: parts.len(),
        rays,
        tally,
        time: spread(times),
        ratio: None,
    });
    let mut rows: Vec<TraceRow> = rows.collect();
    let best = rows.iter().filter(|row| row.engine != OWN).map(|row| row.time[0]).min();
    for row in &mut rows {
        row.ratio = best.map(|best| best.as_secs_f64() / row.time[0].as_secs_f64());
    }
    (rows, disagreements)
}

/// Runs all parts at once, each on a thread of its own, or the only one on this thread; the time from the first start to the last
/// end.
fn run(parts: &mut [Run]) -> (Tally, Duration) {
    if let [only] = parts {
        let start = Instant::now();
        return (only(), start.elapsed());
    }
    let barrier = Barrier::new(parts.len());
    let barrier = &barrier;
    thread::scope(|scope| {
        let start_part = |part| {
            scope.spawn(move || {
                barrier.wait();
                let start = Instant::now();
                (Run::as_mut(part)(), start, Instant::now())
            })
        };
        let threads: Vec<_> = parts.iter_mut().map(start_part).collect();
        let results = threads.into_iter().map(|thread| thread.join().expect("tracing does not panic"));
        let together = results.reduce(|(a, first, last), (b, start, end)| (a.plus(b), first.min(start), last.max(end)));
        together.map_or_else(Default::default, |(tally, first, last)| (tally, last - first))
    })
}

fn picture_rows(builds: &[BuildRow], traces: &[TraceRow]) -> Vec<PictureRow> {
    let mut rows = Vec::new();
    for build in builds {
        let fastest = |work| {
            let own = |row: &&TraceRow| {
                (row.engine, &row.setting, row.threads, row.work) == (build.engine, &build.name, build.threads, work)
            };
            traces.iter().filter(own).map(|row| row.time[0]).min()
        };
        let (Some(primary), Some(occlusion)) = (fastest("primary"), fastest("ao")) else { continue };
        rows.extend(PICTURES.map(|samples| PictureRow {
            engine: build.engine,
            name: build.name.clone(),
            threads: build.threads,
            samples,
            time: build.ready[0] + primary + occlusion * samples / OCCLUSION_RAYS as u32,
            ratio: None,
        }));
    }
    for at in 0..rows.len() {
        let same =
            |row: &&PictureRow| row.engine != OWN && (row.threads, row.samples) == (rows[at].threads, rows[at].samples);
        let best = rows.iter().filter(same).map(|row| row.time).min();
        rows[at].ratio = best.map(|best| best.as_secs_f64() / rows[at].time.as_secs_f64());
    }
    rows
}

/// Median, shortest and longest.
fn spread(mut times: Vec<Duration>) -> [Duration; 3] {
    times.sort();
    [times[times.len() / 2], times[0], times[times.len() - 1]]
}
