//! What a build takes is what the budget is asked for.

use std::process::Command;
use std::sync::Arc;

use bvhscope::accel::{Accel, BUILD_BYTES_PER_TRIANGLE};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;

/// A line of the process's status in bytes.
fn status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with(name)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

/// Tells the allocator to give back at once what is freed: otherwise the peak hides in what earlier work has left.
const GIVES_BACK: (&str, &str) = ("MALLOC_MMAP_THRESHOLD_", "65536");

#[test]
fn a_build_takes_no_more_than_the_budget_is_asked_for() {
    let _alone = crate::alone();
    if std::env::var_os(GIVES_BACK.0).is_none() {
        let mut again = Command::new(std::env::current_exe().unwrap());
        again.args(["--exact", "peak::a_build_takes_no_more_than_the_budget_is_asked_for", "--nocapture"]);
        assert!(again.env(GIVES_BACK.0, GIVES_BACK.1).status().unwrap().success());
        return;
    }
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(300_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let count = scene.triangles.len() as u64;
    let builders = [BuilderKind::Aac, BuilderKind::Lbvh, BuilderKind::BinnedSah];
    let plain = ContainerKind::ALL
        .into_iter()
        .flat_map(|container| builders.map(|builder| BuildSettings { builder, container, ..BuildSettings::default() }));
    let presets = Preset::ALL.map(|preset| BuildSettings::preset(preset, ContainerKind::Aabb));
    for settings in plain.chain(presets).filter(|settings| settings.refusal(scene.triangles.len()).is_none()) {
        // The highest mark so far counts from here on.
        if std::fs::write("/proc/self/clear_refs", "5").is_err() {
            return crate::support::skip("this system does not report the peak");
        }
        let before = status("VmRSS");
        let accel = Accel::build(&scene, &settings, &CancelToken::new()).unwrap();
        accel.ancestry();
        let peak = status("VmHWM") - before;
        println!("{settings:?}: {} bytes a triangle at the peak", peak / count);
        assert!(peak <= count * BUILD_BYTES_PER_TRIANGLE, "{settings:?}: {} bytes a triangle", peak / count);
    }
}
