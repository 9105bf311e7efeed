//! A build takes no more memory than its estimate, which the memory budget is checked with.

use std::process::Command;
use std::sync::Arc;

use bvhscope::accel::{Accel, peak_bytes_per_triangle};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

/// A field of the process's status, in bytes.
fn status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with(name)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

/// Makes the allocator return freed memory to the system at once: the peak would hide in memory that it reuses.
const RETURN_MEMORY: (&str, &str) = ("MALLOC_MMAP_THRESHOLD_", "65536");

#[test]
fn a_build_stays_within_its_memory_estimate() {
    let _alone = crate::alone();
    if std::env::var_os(RETURN_MEMORY.0).is_none() {
        let mut again = Command::new(std::env::current_exe().unwrap());
        again.args(["--exact", "peak::a_build_stays_within_its_memory_estimate", "--nocapture"]);
        assert!(again.env(RETURN_MEMORY.0, RETURN_MEMORY.1).status().unwrap().success());
        return;
    }
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(150_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let count = scene.triangles.len() as u64;
    let builders = [
        BuilderKind::Aac,
        BuilderKind::Swift,
        BuilderKind::Lbvh,
        BuilderKind::Ploc,
        BuilderKind::Hploc,
        BuilderKind::BinnedSah,
        BuilderKind::Sweep,
        BuilderKind::Sbvh,
    ];
    let plain = ContainerKind::ALL
        .into_iter()
        .flat_map(|container| builders.map(|builder| BuildSettings { builder, container, ..BuildSettings::default() }));
    let presets =
        Preset::ALL.map(|preset| BuildSettings { rounds: 1, ..BuildSettings::preset(preset, ContainerKind::Aabb) });
    let orient = Passes::NONE.with(Pass::Orient);
    let oriented = builders.map(|builder| BuildSettings { builder, optimize: orient, ..BuildSettings::default() });
    let all = plain.chain(presets).chain(oriented);
    for settings in all.filter(|settings| settings.refusal(scene.triangles.len()).is_none()) {
        let build = || Accel::build(&scene, &settings, &CancelToken::new()).unwrap();
        let Some(peak) = peak_of(build) else { return };
        println!("{settings:?}: {} bytes a triangle at the peak", peak / count);
        assert!(peak <= count * peak_bytes_per_triangle(&settings), "{settings:?}: {} bytes a triangle", peak / count);
    }
    // Spatial splits cut most of long triangles.
    let source = SceneSource::Builtin { name: "hair".to_owned(), size: Some(150_000) };
    let long = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let count_of_long = long.triangles.len() as u64;
    for optimize in [Passes::NONE, Passes::FINISHED] {
        let settings = BuildSettings { builder: BuilderKind::Sbvh, optimize, ..BuildSettings::default() };
        let mut references = 0;
        let build = || {
            let accel = Accel::build(&long, &settings, &CancelToken::new()).unwrap();
            references = accel.tree.primitive_indices().len() as u64;
            accel
        };
        let Some(peak) = peak_of(build) else { return };
        let per_triangle = peak / count_of_long;
        println!("{settings:?}, {references} references of {count_of_long}: {per_triangle} bytes a triangle");
        assert!(
            peak <= count_of_long * peak_bytes_per_triangle(&settings),
            "{settings:?}: {per_triangle} bytes a triangle"
        );
    }
    drop(long);
    // As of a tree that was read.
    let boxes = Accel::build_binary(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let Some(peak) = peak_of(|| boxes.oriented(&CancelToken::new()).unwrap()) else { return };
    println!("oriented afterwards: {} bytes a triangle at the peak", peak / count);
    let settings = BuildSettings { optimize: orient, ..BuildSettings::default() };
    assert!(peak <= count * peak_bytes_per_triangle(&settings), "{} bytes a triangle", peak / count);
}

/// Peak of the resident memory while a tree is made and what is derived from it, beyond that before; `None` where the system does not
/// report it.
fn peak_of(make: impl FnOnce() -> Accel) -> Option<u64> {
    // Resets VmHWM, the peak of the resident memory.
    if std::fs::write("/proc/self/clear_refs", "5").is_err() {
        crate::support::skip(crate::support::Lack::Memory, "this system does not report the peak");
        return None;
    }
    let before = status("VmRSS");
    let accel = make();
    accel.wide();
    accel.ancestry();
    Some(status("VmHWM") - before)
}
