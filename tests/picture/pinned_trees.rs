//! The trees of every preset, and of the builders that are compared with, are those of `pinned_trees.txt`, bit for bit, on whichever
//! machine this runs: what was measured elsewhere was measured on the same trees.
//!
//! The trees of the preset Finest are those of small scenes after a few rounds. Of the largest scenes only the presets are compared
//! that the documents have tables of.
//!
//! `UPDATE_TREES=1 cargo test --test picture pinned_trees` writes the file anew after a change of the builders. Tables that were
//! measured before are then out of date.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use bvhscope::accel::Accel;
use bvhscope::scene::{BUILTIN_SCENES, LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::fingerprint::{of_tree, of_triangles, of_wide_tree};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;

use crate::support::models;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/picture/pinned_trees.txt");
const HEADER: &str =
    "# scene, hash of its triangles, preset or builder, container, hash of the binary tree, hash of the wide tree\n";
/// Models below the folder of models. The largest is left out: its trees alone would take as long as all other tests here.
const MODELS: [&str; 8] = [
    "bunny/bun_zipper.ply",
    "buddha/buddha.obj",
    "car/pontiac-gto67.glb",
    "conference/conference.obj",
    "dragon/dragon.ply",
    "sponza-crytek/sponza.obj",
    "sponza-dabrovic/sponza.obj",
    "teapot/teapot.obj",
];
/// Maximum number of triangles of a scene whose tree is annealed too.
const MAX_ANNEALED: usize = 100_000;
/// Maximum number of triangles of a scene whose trees of all other presets and containers are compared.
const MAX_IN_FULL: usize = 200_000;
/// The builders without a preset but those that are too slow for scenes of this size.
const REFERENCES: [BuilderKind; 6] = [
    BuilderKind::Lbvh,
    BuilderKind::Ploc,
    BuilderKind::Hploc,
    BuilderKind::BinnedSah,
    BuilderKind::Sweep,
    BuilderKind::Sbvh,
];
/// Rounds of annealing: one hot, the others cold.
const ROUNDS: u32 = 5;
/// Both tests may write the file.
static WRITING: Mutex<()> = Mutex::new(());

/// The lines of a scene.
fn lines(name: &str, source: &SceneSource) -> Vec<String> {
    let token = CancelToken::new();
    let scene = std::sync::Arc::new(load(source, &LoadOptions::default(), &token).unwrap());
    let triangles = of_triangles(&scene.triangles, &token).unwrap();
    let count = scene.triangles.len();
    let is_compared = |preset: Preset, container| match preset {
        Preset::Fast => true,
        Preset::Best if container == ContainerKind::Aabb => true,
        _ => count <= if preset.is_slow() { MAX_ANNEALED } else { MAX_IN_FULL },
    };
    let line = |of: &str, settings: &BuildSettings| {
        let accel = Accel::build(&scene, settings, &token).unwrap();
        let tree = of_tree(&accel.tree, &token).unwrap();
        let wide = of_wide_tree(&accel.wide().tree, &token).unwrap();
        let container = settings.container.name();
        format!("{name} {triangles:016x} {of} {container} {tree:016x} {wide:016x}")
    };
    let mut lines = Vec::new();
    for container in ContainerKind::ALL {
        for preset in Preset::ALL.into_iter().filter(|&preset| is_compared(preset, container)) {
            let settings = BuildSettings { rounds: ROUNDS, ..BuildSettings::preset(preset, container) };
            lines.push(line(preset.name(), &settings));
        }
        for builder in REFERENCES.into_iter().filter(|_| count <= MAX_IN_FULL) {
            let settings = BuildSettings { builder, container, ..BuildSettings::default() };
            if settings.refusal(count).is_none() {
                lines.push(line(builder.name(), &settings));
            }
        }
    }
    lines
}

/// The pinned lines by scene.
fn pinned() -> BTreeMap<String, Vec<String>> {
    let text = std::fs::read_to_string(FILE).unwrap();
    let mut scenes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let name = line.split(' ').next().unwrap();
        scenes.entry(name.to_owned()).or_default().push(line.to_owned());
    }
    scenes
}

fn compare_or_update(found: Vec<(String, Vec<String>)>) {
    if std::env::var_os("UPDATE_TREES").is_some() {
        let _lock = WRITING.lock().unwrap();
        let mut scenes = pinned();
        scenes.extend(found);
        let mut text = HEADER.to_owned();
        scenes.values().flatten().for_each(|line| writeln!(text, "{line}").unwrap());
        std::fs::write(FILE, text).unwrap();
        return;
    }
    let pinned = pinned();
    for (name, lines) in found {
        let expected = pinned.get(&name).map_or(&[][..], |lines| lines);
        let triangles = |lines: &[String]| lines.first().and_then(|line| line.split(' ').nth(1)).map(str::to_owned);
        assert_eq!(triangles(&lines), triangles(expected), "{name}: these are other triangles than those of the file");
        let others: Vec<_> = lines.iter().filter(|line| !expected.contains(line)).collect();
        assert!(others.is_empty(), "{name}: trees differ from those of {FILE}: {others:#?}");
        assert_eq!(
            lines.len(),
            expected.len(),
            "{name}: the file has trees of presets or builders that there are no more"
        );
    }
}

#[test]
fn trees_of_the_built_in_scenes_are_the_pinned_ones() {
    // Copies are turned by sines, whose last places differ between machines.
    let of_copies = ["forest", "village", "stack", "traffic"];
    let found = BUILTIN_SCENES.iter().filter(|scene| !of_copies.contains(&scene.name)).map(|scene| {
        let name = format!("builtin:{}", scene.name);
        let lines = lines(&name, &SceneSource::parse(OsStr::new(&name)).unwrap());
        (name, lines)
    });
    compare_or_update(found.collect());
}

#[test]
fn trees_of_the_real_models_are_the_pinned_ones() {
    let Some(folder) = models() else { return };
    let found = MODELS.map(|name| (name.to_owned(), lines(name, &SceneSource::File(folder.join(Path::new(name))))));
    compare_or_update(found.into());
}
