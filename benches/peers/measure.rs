//! Interleaved rounds over all engines, so that a slow moment of the machine hits all of them alike.

use std::time::{Duration, Instant};

use bvhscope_engine::tree::statistics::collapsed_cost_of;

use crate::embree::{self, Quality};
use crate::engine;
use crate::obvhs_peer;
use crate::peer::{Builder, Interface, Judged, OWN};
use crate::rays::{Tally, Workload, workloads};
use crate::scenes::Subject;

/// What can be measured.
pub const PARTS: [&str; 5] = ["build", "tree", "primary", "ao", "diffuse"];

/// What is measured, and how often.
pub struct Plan {
    /// Some of [`PARTS`].
    pub parts: Vec<String>,
    /// Engines and interfaces whose name contains one of these; all where it is empty.
    pub only: Vec<String>,
    /// Also the settings that take long to build.
    pub slow: bool,
    /// Measured rounds.
    pub repeat: usize,
    /// Numbers of threads of the builds.
    pub threads: Vec<usize>,
    /// Width and height of the picture in pixels.
    pub size: u32,
}

impl Plan {
    fn wants(&self, part: &str) -> bool {
        self.parts.iter().any(|wanted| wanted == part)
    }

    fn names(&self, engine: &str, name: &str) -> bool {
        let full = format!("{engine} {name}");
        self.only.is_empty() || self.only.iter().any(|wanted| full.contains(wanted.as_str()))
    }
}

/// One line of the table of builds.
pub struct BuildRow {
    pub engine: &'static str,
    pub name: String,
    pub threads: usize,
    /// Median, shortest and longest.
    pub time: [Duration; 3],
    /// Its rate over that of the fastest peer with as many threads.
    pub ratio: Option<f64>,
}

/// One line of the table of trees.
pub struct TreeRow {
    pub engine: &'static str,
    pub name: String,
    pub sah_cost: Option<f64>,
    /// Its cost over that of the best peer.
    pub ratio: Option<f64>,
    pub bytes: Option<usize>,
}

/// One line of a table of rays.
pub struct TraceRow {
    pub work: &'static str,
    pub engine: &'static str,
    pub name: String,
    pub rays: usize,
    pub tally: Tally,
    /// Median, shortest and longest.
    pub time: [Duration; 3],
    /// Its rate over that of the fastest peer.
    pub ratio: Option<f64>,
}

/// What came out on one scene.
pub struct Outcome {
    pub model: String,
    pub triangles: usize,
    pub repeat: usize,
    pub builds: Vec<BuildRow>,
    pub trees: Vec<TreeRow>,
    pub traces: Vec<TraceRow>,
    /// Where hits are not the same.
    pub disagreements: Vec<String>,
}

/// Measures one scene.
pub fn measure(subject: &Subject, plan: &Plan) -> Outcome {
    let triangles = &subject.triangles[..];
    let mut outcome = Outcome {
        model: subject.name.clone(),
        triangles: triangles.len(),
        repeat: plan.repeat,
        builds: Vec::new(),
        trees: Vec::new(),
        traces: Vec::new(),
        disagreements: Vec::new(),
    };
    let (mesh, converted) = (embree::Mesh::new(triangles), obvhs_peer::converted(triangles));
    if plan.wants("build") {
        let devices: Vec<_> = plan.threads.iter().map(|&threads| (threads, embree::Device::new(threads))).collect();
        let mut builders = Vec::new();
        for (threads, device) in &devices {
            builders.extend(engine::builders(triangles, *threads));
            builders.extend(embree::builders(device, &mesh, *threads, plan.slow));
            builders.extend(obvhs_peer::builders(&converted, *threads, plan.slow));
        }
        builders.retain(|builder| plan.names(builder.engine, &builder.name));
        outcome.builds = build_rows(&builders, plan.repeat);
    }
    let traced = PARTS[2..].iter().any(|part| plan.wants(part));
    if !(plan.wants("tree") || traced) {
        return outcome;
    }
    let device = embree::Device::new(0);
    let ready = engine::ready(triangles);
    let obvhs_ready = obvhs_peer::ready(&converted, plan.slow);
    if plan.wants("tree") {
        let mut judged: Vec<Judged> = ready.iter().map(engine::judged).collect();
        judged.extend(embree::judged(&device, triangles, &mesh, plan.slow));
        judged.extend(obvhs_peer::judged(&converted, &obvhs_ready, plan.slow));
        judged.retain(|judged| plan.names(judged.engine, &judged.name));
        outcome.trees = tree_rows(judged);
    }
    if traced {
        // Embree's low quality is not meant to be traced.
        let qualities = embree::qualities(plan.slow).iter().filter(|&&quality| quality != Quality::Low);
        let scenes: Vec<_> = qualities.map(|&quality| (quality, embree::commit(&device, &mesh, quality))).collect();
        let works = workloads(&ready[0].tree, triangles, &subject.bounds, &subject.camera, plan.size);
        let mut interfaces: Vec<Interface> = ready.iter().flat_map(engine::interfaces).collect();
        interfaces.extend(scenes.iter().flat_map(|(quality, scene)| embree::interfaces(scene, *quality)));
        interfaces.extend(obvhs_ready.iter().map(obvhs_peer::interfaces));
        for work in works.iter().filter(|work| plan.wants(work.name)) {
            let (rows, disagreements) = trace_rows(&interfaces, work, plan);
            outcome.traces.extend(rows);
            outcome.disagreements.extend(disagreements);
        }
    }
    outcome
}

fn build_rows(builders: &[Builder], repeat: usize) -> Vec<BuildRow> {
    let mut times: Vec<Vec<Duration>> = builders.iter().map(|_| Vec::new()).collect();
    for round in 0..=repeat {
        for (builder, times) in builders.iter().zip(&mut times) {
            let time = (builder.build)();
            // The first round warms up.
            if round > 0 {
                times.push(time);
            }
        }
    }
    let mut rows: Vec<BuildRow> = builders
        .iter()
        .zip(times)
        .map(|(builder, times)| BuildRow {
            engine: builder.engine,
            name: builder.name.clone(),
            threads: builder.threads,
            time: spread(times),
            ratio: None,
        })
        .collect();
    for at in 0..rows.len() {
        let same = rows.iter().filter(|row| row.engine != OWN && row.threads == rows[at].threads);
        let best = same.map(|row| row.time[0]).min();
        rows[at].ratio = best.map(|best| best.as_secs_f64() / rows[at].time[0].as_secs_f64());
    }
    rows
}

fn tree_rows(judged: Vec<Judged>) -> Vec<TreeRow> {
    let mut rows: Vec<TreeRow> = judged
        .into_iter()
        .map(|judged| TreeRow {
            engine: judged.engine,
            name: judged.name,
            sah_cost: judged.tree.as_ref().map(collapsed_cost_of),
            ratio: None,
            bytes: judged.bytes,
        })
        .collect();
    let best = rows.iter().filter(|row| row.engine != OWN).filter_map(|row| row.sah_cost).min_by(f64::total_cmp);
    for row in &mut rows {
        row.ratio = row.sah_cost.zip(best).map(|(cost, best)| cost / best);
    }
    rows
}

/// Distances may differ by this share, and hits by this share of the rays: engines round differently at edges.
const DISTANCE_TOLERANCE: f64 = 1e-3;
const HIT_TOLERANCE: f64 = 1e-5;

fn trace_rows<'a>(interfaces: &[Interface<'a>], work: &'a Workload, plan: &Plan) -> (Vec<TraceRow>, Vec<String>) {
    let mut disagreements = Vec::new();
    // This engine's first interface, whether it is shown or not.
    let reference = interfaces.first().and_then(|first| (first.prepare)(work)).map(|mut run| run()).unwrap_or_default();
    let wanted = interfaces.iter().filter(|interface| plan.names(interface.engine, &interface.name));
    let mut runs: Vec<_> =
        wanted.filter_map(|interface| Some((interface, (interface.prepare)(work)?, Vec::new()))).collect();
    let mut tallies = Vec::new();
    for round in 0..=plan.repeat {
        for (interface, run, times) in &mut runs {
            let start = Instant::now();
            let tally = run();
            let time = start.elapsed();
            if round > 0 {
                times.push(time);
                continue;
            }
            // The first round warms up, and is checked.
            tallies.push(tally);
            let few = (work.rays.len() as f64 * HIT_TOLERANCE).ceil() as u64;
            if tally.hits.abs_diff(reference.hits) > few
                || (tally.distance - reference.distance).abs() > DISTANCE_TOLERANCE * reference.distance
            {
                disagreements.push(format!(
                    "{} {} finds {tally:?} with {} rays, {OWN} {reference:?}",
                    interface.engine, interface.name, work.name
                ));
            }
        }
    }
    let rows = runs.into_iter().zip(tallies).map(|((interface, _, times), tally)| TraceRow {
        work: work.name,
        engine: interface.engine,
        name: interface.name.clone(),
        rays: work.rays.len(),
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

/// Median, shortest and longest.
fn spread(mut times: Vec<Duration>) -> [Duration; 3] {
    times.sort();
    [times[times.len() / 2], times[0], times[times.len() - 1]]
}
