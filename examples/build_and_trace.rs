//! The builder and the tracer from another program: a scene, its tree, one ray, its tests.
//!
//! `cargo run --release --example build_and_trace`

use std::error::Error;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};

fn main() -> Result<(), Box<dyn Error>> {
    let token = CancelToken::new();
    let scene = Arc::new(load(&SceneSource::default_builtin(), &LoadOptions::default(), &token)?);
    let ray = Camera::framing(&scene.bounds, scene.up).for_size(640, 480).ray(320.5, 240.5);
    for container in ContainerKind::ALL {
        let accel = Accel::build(&scene, &BuildSettings::preset(Preset::Hq, container), &token)?;
        let mut tests = TestCounts::default();
        let hit = accel.closest_hit_with(&ray, Traversal::Ordered, &mut tests);
        println!(
            "{:6}  {} nodes, depth {}, SAH cost {:.2}; {} container and {} triangle tests; hit {:?}",
            container.name(),
            accel.report.stats.nodes,
            accel.report.stats.max_depth,
            accel.report.stats.sah_cost,
            tests.containers,
            tests.primitives,
            hit.map(|hit| (hit.primitive_index, hit.t)),
        );
    }
    Ok(())
}
