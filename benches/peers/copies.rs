//! Scenes of copies of meshes in two levels: this engine's and Embree's, beside this engine's flat scene, whose hits they must have.

use bvhscope::scene::SceneCopies;
use bvhscope_engine::geometry::{Ray, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::traverse::{Probe, TestCounts};
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
use bvhscope_engine::{ContainerKind, Instances};

use crate::embree::{self, Device};
use crate::embree_rays;
use crate::engine::{self, Ready};
use crate::measure::{COUNTED, Outcome, Plan, RayCounts, TreeRow, build_rows, devices, trace_rows};
use crate::peer::{BuildTimes, Builder, Interface, OWN, timed};
use crate::rays::{Query, WORKS, Workload, in_parts, workloads};
use crate::scenes::Subject;
use crate::two_levels;

/// Measures a scene of `copies`.
pub fn measure(subject: &Subject, copies: &SceneCopies, plan: &Plan) -> Outcome {
    let mut outcome = Outcome::new(subject, plan);
    let placed = two_levels::placed(copies);
    let meshes: Vec<&[Triangle]> = (0..copies.mesh_count() as u32).map(|mesh| copies.mesh(mesh)).collect();
    let of_embree: Vec<embree::Mesh> = meshes.iter().map(|triangles| embree::Mesh::new(triangles)).collect();
    let commit = |device: &Device, mode| {
        let copies =
            (0..placed.len() as u32).map(|copy| (copies.copies().mesh(copy), copies.copies().place(copy).rows()));
        embree::commit_copies(device, &of_embree, copies, mode)
    };
    if plan.wants("build") {
        for &threads in &plan.threads {
            let devices = devices(threads);
            let mut builders = two_levels::builders(&meshes, &placed, threads);
            let modes =
                devices.iter().flat_map(|device| embree::modes(plan.slow).into_iter().map(move |mode| (device, mode)));
            builders.extend(modes.map(|(device, mode)| Builder {
                engine: device.library.name,
                name: format!("instances {}", mode.name()),
                threads,
                build: Box::new(move || BuildTimes { binary: None, ready: timed(|| commit(device, mode)) }),
            }));
            builders.retain(|builder| plan.names(builder.engine, &builder.name));
            outcome.builds.extend(build_rows(&builders, plan.repeat));
        }
    }
    let flat = [Preset::Fast, Preset::Best].map(|preset| {
        let settings = BuildSettings::preset(preset, ContainerKind::Aabb);
        engine::ready_with(&subject.triangles, format!("flat {}", preset.name()), &settings)
    });
    let boxes = flat[0].boxes().expect("the preset has boxes");
    let works = workloads(boxes, &subject.triangles, &subject.bounds, &subject.camera, plan.size);
    let levels: Vec<(String, Instances)> = two_levels::ready(&meshes, &placed);
    if plan.wants("tree") {
        outcome.trees.extend(flat.iter().map(|ready| flat_row(ready, &works)));
        outcome.trees.extend(levels.iter().map(|(name, instances)| row(name, instances, &works)));
    }
    if !WORKS.iter().any(|part| plan.wants(part)) {
        return outcome;
    }
    let devices = devices(0);
    let modes = embree::modes(plan.slow);
    let scenes: Vec<_> = devices
        .iter()
        .flat_map(|device| modes.iter().map(move |&mode| (device, mode)))
        .map(|(device, mode)| commit(device, mode))
        .collect();
    for &threads in &plan.threads {
        let parts = works.each_ref().map(|work| in_parts(work, threads));
        let mut interfaces: Vec<Interface> = flat.iter().flat_map(engine::interfaces).collect();
        interfaces.extend(levels.iter().flat_map(|(name, instances)| two_levels::interfaces(name, instances)));
        interfaces.extend(scenes.iter().flat_map(embree_rays::interfaces));
        for parts in parts.iter().filter(|parts| plan.wants(parts[0].name)) {
            let (rows, disagreements) = trace_rows(&interfaces, parts, plan);
            outcome.traces.extend(rows);
            outcome.disagreements.extend(disagreements);
        }
    }
    outcome
}

/// Tests of nodes and of blocks of triangles of the wide tree.
fn flat_row(ready: &Ready, works: &[Workload]) -> TreeRow {
    let wide = &ready.wide;
    let level = SimdLevel::of_builds().level();
    let (mut tests, mut lines) = (TestCounts::default(), LineProbe::new(wide));
    let counts = counts(works, |ray| {
        wide.closest_hit_with(level, ray, &mut tests);
        wide.closest_hit_with(level, ray, &mut lines);
        (std::mem::take(&mut tests), lines.take())
    });
    tree_row(&ready.name, wide.node_bytes() + wide.leaf_bytes(), counts)
}

/// The same of both levels.
fn row(name: &str, instances: &Instances, works: &[Workload]) -> TreeRow {
    let meshes = instances.copies().meshes();
    let mut tests = vec![TestCounts::default(); meshes.len() + 1];
    let mut lines: Vec<LineProbe> = meshes.iter().map(|mesh| LineProbe::new(&mesh.wide().tree)).collect();
    lines.push(LineProbe::new(&instances.top().tree));
    let counts = counts(works, |ray| {
        closest_hit(instances, ray, &mut tests);
        closest_hit(instances, ray, &mut lines);
        let sum = tests.iter_mut().map(std::mem::take).sum();
        let mut read = CacheLines::default();
        lines.iter_mut().for_each(|lines| read += lines.take());
        (sum, read)
    });
    tree_row(name, instances.bytes(), counts)
}

/// Traces a ray with a probe for each mesh, and the last one for the tree above.
fn closest_hit<P: Probe>(instances: &Instances, ray: &Ray, probes: &mut [P]) {
    if let Some((top, meshes)) = probes.split_last_mut() {
        instances.closest_hit_with(ray, top, meshes);
    }
}

/// Averages over every [`COUNTED`]th ray of the workloads that ask for the nearest hit.
fn counts(
    works: &[Workload],
    mut count: impl FnMut(&Ray) -> (TestCounts, CacheLines),
) -> Vec<(&'static str, RayCounts)> {
    let works = works.iter().filter(|work| work.query == Query::Closest);
    let of_work = |work: &Workload| {
        let (mut tests, mut lines) = (TestCounts::default(), CacheLines::default());
        let rays = work.rays.iter().step_by(COUNTED);
        let rays_count = rays.len().max(1) as f64;
        for ray in rays {
            let (of_ray, read) = count(ray);
            tests += of_ray;
            lines += read;
        }
        let [containers, triangles, bytes] =
            [tests.containers, tests.primitives, lines.bytes()].map(|sum| sum as f64 / rays_count);
        (work.name, RayCounts { containers, triangles, bytes })
    };
    works.map(of_work).collect()
}

fn tree_row(name: &str, bytes: usize, counts: Vec<(&'static str, RayCounts)>) -> TreeRow {
    let name = format!("{name}, wide tests");
    TreeRow { engine: OWN, name, sah_cost: None, ratio: None, overlap: None, counts, bytes: Some(bytes) }
}
