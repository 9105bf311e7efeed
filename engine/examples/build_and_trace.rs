//! Builds trees of boxes and of spheres over a mesh, prints their statistics and traces one ray with its tests counted.
//!
//! `cargo run --release -p bvhscope-engine --example build_and_trace`

mod meshes;

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::{BuildError, BuildSettings, CancelToken, ContainerKind, Preset, Ray, Traversal, build};

fn main() -> Result<(), BuildError> {
    let token = CancelToken::new();
    let triangles = meshes::bumpy_ball(70_000);
    let ray = Ray::new(Vec3::new(0.3, 0.2, 3.0), Vec3::NEG_Z);
    for container in ContainerKind::ALL {
        for preset in Preset::ALL.into_iter().filter(|preset| !preset.is_slow()) {
            let bvh = build(&triangles, &BuildSettings::preset(preset, container), &token)?;
            let (report, statistics) = (bvh.report(), bvh.statistics());
            let (hit, tests) = bvh.closest_hit_counted(&ray, &triangles, Traversal::Ordered);
            assert_eq!(hit, bvh.closest_hit(&ray), "both trees find the same hit");
            println!(
                "{:6} {:8} {:5.1} ms, {} nodes, depth {}, SAH cost {:.2}, EPO {:.2}; {} container and {} triangle tests; hit {:?}",
                container.name(),
                preset.name(),
                report.build_time.as_secs_f64() * 1e3,
                statistics.nodes,
                statistics.max_depth,
                statistics.sah_cost,
                bvh.end_point_overlap(&triangles, usize::MAX, &token)?.value,
                tests.containers,
                tests.primitives,
                hit.map(|hit| (hit.primitive_index, hit.t)),
            );
        }
    }
    Ok(())
}
