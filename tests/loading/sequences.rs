//! Rows of numbered files as frames of a clip: one topology or several, missing, broken and changed files.

use std::path::Path;

use bvhscope::accel::Follow;
use bvhscope::scene::{LoadError, LoadOptions, Moment, Scene, SceneSource, load as load_source};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;
use glam::Vec3;

/// A triangle at `x`, or several of them.
fn obj(x: f32, count: usize) -> String {
    let mut text = String::new();
    for index in 0..count {
        let y = index as f32;
        text += &format!("v {x} {y} 0\nv {} {y} 0\nv {x} {} 0\nf -3 -2 -1\n", x + 1.0, y + 1.0);
    }
    text
}

fn write(folder: &Path, frames: &[(&str, String)]) {
    for (name, text) in frames {
        std::fs::write(folder.join(name), text).unwrap();
    }
}

fn load(folder: &Path, pattern: &str, fps: Option<f32>) -> Result<Scene, LoadError> {
    let options = LoadOptions { fps, ..LoadOptions::default() };
    load_source(&SceneSource::File(folder.join(pattern)), &options, &CancelToken::new())
}

fn at(scene: &Scene, seconds: f32) -> Result<Scene, LoadError> {
    scene.at(Moment { clip: 0, seconds }, &CancelToken::new())
}

fn warnings(scene: &Scene) -> Vec<String> {
    scene.warnings.entries.iter().map(ToString::to_string).collect()
}

#[test]
fn each_file_is_a_frame_that_stays_until_the_next() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("w_1.obj", obj(0.0, 1)), ("w_2.obj", obj(2.0, 1)), ("w_3.obj", obj(5.0, 1))]);
    let scene = load(folder.path(), "w_#.obj", Some(10.0)).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let motion = scene.motion.as_ref().unwrap();
    let clip = &motion.clips[0];
    assert_eq!((&clip.name[..], clip.start, motion.clips.len()), ("sequence", 0.0, 1));
    assert!((clip.end - 0.2).abs() < 1e-6 && motion.keeps_triangles() && (motion.frame_seconds() - 0.1).abs() < 1e-6);
    let x = [-1.0, 0.0, 0.09, 0.1, 0.19, 0.2, 9.0].map(|seconds| at(&scene, seconds).unwrap().triangles[0].a.x);
    assert_eq!(x, [0.0, 0.0, 0.0, 2.0, 2.0, 5.0, 5.0]);
    assert_eq!(scene.triangles[0].a, Vec3::ZERO, "without a clip the first");
    // Cameras frame all of them, and every file was read.
    let subject = at(&scene, 0.0).unwrap().subject;
    assert_eq!((subject.min.x, subject.max.x, scene.files_read.len()), (0.0, 6.0, 3));
    let films = load(folder.path(), "w_*.obj", None).unwrap().motion.unwrap();
    assert!((films.clips[0].end - 2.0 / 24.0).abs() < 1e-6);
    // A single file of the row is itself.
    assert!(load(folder.path(), "w_2.obj", None).unwrap().motion.is_none());
    let mixed = load(folder.path(), "w_#.ply", None).unwrap_err().to_string();
    assert!(mixed.contains("w_#.ply: no file has such a name"), "{mixed}");
}

#[test]
fn frames_of_ply_files_have_their_own_colours() {
    let folder = tempfile::tempdir().unwrap();
    let ply = |x: f32, red: u8| {
        let corner = |x: f32, y: f32| format!("{x} {y} 0 {red} 0 0\n");
        let properties = ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"];
        let properties: String = properties.iter().map(|property| format!("property {property}\n")).collect();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\n{properties}element face 1\nproperty list uchar int \
             vertex_indices\nend_header\n{}{}{}3 0 1 2\n",
            corner(x, 0.0),
            corner(x + 1.0, 0.0),
            corner(x, 1.0)
        )
    };
    write(folder.path(), &[("s007.ply", ply(0.0, 255)), ("s008.ply", ply(1.0, 255)), ("s009.ply", ply(2.0, 0))]);
    let scene = load(folder.path(), "s###.ply", None).unwrap();
    let red = |scene: &Scene| {
        let attributes = scene.attributes.as_ref().unwrap();
        attributes.colors[attributes.corners[0][0] as usize].x
    };
    let frames = [0.0, 1.0, 2.0].map(|frame| at(&scene, frame / 24.0).unwrap());
    assert_eq!(
        [0, 1, 2].map(|frame| (frames[frame].triangles[0].a.x, red(&frames[frame]))),
        [(0.0, 1.0), (1.0, 1.0), (2.0, 0.0)]
    );
    // Equal lists are in memory once.
    let colors = |frame: usize| std::sync::Arc::as_ptr(&frames[frame].attributes.as_ref().unwrap().colors);
    assert!(colors(0) == colors(1) && colors(0) != colors(2));
}

#[test]
fn missing_broken_and_changed_frames_are_counted_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let frames = [
        ("w_0.obj", obj(0.0, 1)),
        ("w_10.obj", obj(1.0, 1)),
        ("w_40.obj", obj(4.0, 1)),
        ("w_50.obj", "f 1 2 9".into()),
    ];
    write(folder.path(), &frames);
    let scene = load(folder.path(), "w_#.obj", Some(1.0)).unwrap();
    let found = warnings(&scene);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("1 frame left out: 'w_50.obj': "), "{found:?}");
    // Every tenth number has a file.
    assert_eq!(found[1], "2 frames missing, each shown as the one before it: the first after 'w_10.obj'");
    assert_eq!([1.0, 2.0, 3.0, 4.0].map(|second| at(&scene, second).unwrap().triangles[0].a.x), [1.0, 1.0, 1.0, 4.0]);
    // Those in memory are shown whatever becomes of their files.
    std::fs::write(folder.path().join("w_10.obj"), obj(7.0, 5)).unwrap();
    std::fs::remove_file(folder.path().join("w_40.obj")).unwrap();
    assert_eq!([1.0, 4.0].map(|second| at(&scene, second).unwrap().triangles[0].a.x), [1.0, 4.0]);
    // The first one is the model.
    std::fs::write(folder.path().join("w_0.obj"), "").unwrap();
    let refused = load(folder.path(), "w_#.obj", None).unwrap_err().to_string();
    assert!(refused.contains("w_0.obj: the file is empty"), "{refused}");
}

#[test]
fn frames_of_other_triangles_have_trees_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("w_1.obj", obj(0.0, 4)), ("w_2.obj", obj(0.0, 9)), ("w_3.obj", obj(0.0, 2))]);
    let scene = load(folder.path(), "w_#.obj", Some(1.0)).unwrap();
    let found = warnings(&scene);
    assert_eq!(found, ["2 frames of another number of triangles than the 4 of the first: trees are built for each"]);
    assert_eq!([0.0, 1.0, 2.0].map(|second| at(&scene, second).unwrap().triangles.len()), [4, 9, 2]);
    assert!(!scene.motion.as_ref().unwrap().keeps_triangles());
    let settings = BuildSettings::default();
    for policy in Policy::ALL {
        let refusal = Follow::refusal(policy, &settings, &scene);
        assert_eq!(refusal.is_none(), policy == Policy::Rebuild, "{refusal:?}");
        assert!(refusal.is_none_or(|text| text.contains(policy.name()) && text.contains("'rebuild'")));
    }
    let (still, none) = (Scene::from_triangles(scene.source.clone(), scene.triangles.clone()), None);
    assert_eq!(Follow::refusal(Policy::Refit, &settings, &still), none);
}

#[test]
fn a_single_file_of_a_row_stands_still_and_coordinates_far_away_share_an_offset() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("a1.obj", obj(0.0, 1))]);
    assert!(load(folder.path(), "a#.obj", None).unwrap().motion.is_none());
    // Each file alone would get an offset of its own.
    write(folder.path(), &[("b1.obj", obj(8_000_000.0, 1)), ("b2.obj", obj(8_000_064.0, 1))]);
    let scene = load(folder.path(), "b#.obj", Some(1.0)).unwrap();
    assert!(scene.offset.x > 1e6);
    let moved = at(&scene, 1.0).unwrap();
    assert_eq!((moved.triangles[0].a.x - scene.triangles[0].a.x, moved.offset), (64.0, scene.offset));
}

#[cfg(unix)]
#[test]
fn frames_that_are_links_out_of_the_folder_are_read_only_when_allowed() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("in");
    std::fs::create_dir(&folder).unwrap();
    write(&folder, &[("w_1.obj", obj(0.0, 1)), ("w_3.obj", obj(2.0, 1))]);
    write(outside.path(), &[("secret.txt", "TOPSECRET".to_owned()), ("other.obj", obj(7.0, 1))]);
    std::os::unix::fs::symlink("../secret.txt", folder.join("w_2.obj")).unwrap();
    std::os::unix::fs::symlink("../other.obj", folder.join("w_4.obj")).unwrap();
    std::os::unix::fs::symlink("w_1.obj", folder.join("w_5.obj")).unwrap();
    let scene = load(&folder, "w_#.obj", None).unwrap();
    let found = warnings(&scene);
    assert_eq!(found[0], "2 frames left out: 'w_2.obj' …: is a link out of the folder");
    assert!(!found.iter().any(|warning| warning.contains("TOPSECRET")), "{found:?}");
    let pattern = SceneSource::File(folder.join("w_#.obj"));
    let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    let scene = load_source(&pattern, &options, &CancelToken::new()).unwrap();
    assert_eq!(at(&scene, 9.0).unwrap().triangles[0].a, Vec3::ZERO, "a link within the folder");
    assert_eq!(warnings(&scene).len(), 1, "but for the text: {:?}", scene.warnings);
    // The first frame decides about all.
    std::fs::rename(folder.join("w_4.obj"), folder.join("w_0.obj")).unwrap();
    let refused = load(&folder, "w_#.obj", None).unwrap_err().to_string();
    assert!(refused.ends_with("w_0.obj: is a link out of the folder; --allow-outside lets it be read"), "{refused}");
}
