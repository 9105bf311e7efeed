//! The scene of a small OBJ file, to the number: coordinates, order, colours, texture coordinates, normals.

use std::path::Path;

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::{Vec2, Vec3};

use super::generator::{LIBRARY, valid_obj};
use super::obj_oracle::{compare, corners};
use crate::formats::{load_bytes as load_named, load_path};
use crate::random::Random;

fn load(text: &str) -> Scene {
    load_bytes(Path::new("a.obj"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap()
}

/// A square turning to the left, with different coordinates along each axis.
const SQUARE: &str = "v 1 2 3\nv 4 2 3\nv 4 6 3\nv 1 6 3\nvt 0.25 0.75\nvt 0.5 0.125\nvn 0 0 2\nvn 3 0 0\n";

#[test]
fn each_form_of_a_face_gives_its_corners_in_order() {
    let [a, b, c, d] = [[1.0, 2.0, 3.0], [4.0, 2.0, 3.0], [4.0, 6.0, 3.0], [1.0, 6.0, 3.0]].map(Vec3::from_array);
    let [uv, uw] = [Vec2::new(0.25, 0.25), Vec2::new(0.5, 0.875)];
    let (none, flat) = (Vec2::ZERO, Vec3::ZERO);
    for (face, uvs, normals) in [
        ("1 2 3 4", [none; 4], [flat; 4]),
        ("-4 -3 -2 -1", [none; 4], [flat; 4]),
        ("+1 2/ 3// 4", [none; 4], [flat; 4]),
        ("1/1 2/2 3/1 4/2", [uv, uw, uv, uw], [flat; 4]),
        ("1/-2 2/-1 3/-2/ 4/-1", [uv, uw, uv, uw], [flat; 4]),
        ("1//1 2//1 3//2 4//2", [none; 4], [Vec3::Z, Vec3::Z, Vec3::X, Vec3::X]),
        ("1/2/-1 2/2/-1 3/1/-2 \\\n 4/1/1 # all", [uw, uw, uv, uv], [Vec3::X, Vec3::X, Vec3::Z, Vec3::Z]),
    ] {
        let scene = load(&format!("{SQUARE}f {face}\n"));
        assert!(scene.warnings.is_empty(), "{face}: {:?}", scene.warnings);
        let corner = |k: usize| ([a, b, c, d][k], Vec3::ONE, uvs[k], normals[k]);
        assert_eq!(scene.triangles.len(), 2, "{face}");
        assert_eq!(corners(&scene, 0), [0, 1, 2].map(corner), "{face}");
        assert_eq!(corners(&scene, 1), [0, 2, 3].map(corner), "{face}");
    }
}

#[test]
fn colours_are_decoded_from_srgb() {
    let scene = load("v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 0.04 0.2 1 1\nf 1 2 3\n");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let [a, b, c] = corners(&scene, 0).map(|corner| corner.1);
    // IEC 61966-2-1 at 0.5, 0.04 and 0.2.
    assert!((a - Vec3::new(1.0, 0.0, 0.214_041)).length() < 1e-5, "{a}");
    assert_eq!(b, Vec3::ONE, "a vertex without a colour is white");
    assert!((c - Vec3::new(0.003_095_975, 0.033_104_77, 1.0)).length() < 1e-5, "{c}");
}

#[test]
fn valid_files_are_read_as_tobj_reads_them() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), LIBRARY).unwrap();
    let mut random = Random(0x0B7);
    for _ in 0..300 {
        compare(folder.path(), &valid_obj(&mut |count| random.below(count)));
    }
}

/// Every statement is looked at once, and the token at least once in each 64 KB and once before the end.
#[test]
fn polls_grow_with_the_size_of_the_file_alone() {
    let polls = |text: &str| {
        let count = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(0));
        let counted = std::sync::Arc::clone(&count);
        let token = CancelToken::watched(move |_| {
            counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            false
        });
        let triangle = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{text}f 1 2 3\n");
        load_bytes(Path::new("/nonexistent/a.obj"), triangle.as_bytes(), &LoadOptions::default(), &token).unwrap();
        count.load(std::sync::atomic::Ordering::Relaxed)
    };
    for unit in [
        "g a\nf 1 2 3\n",
        "o a\n",
        "usemtl a\n",
        "f 1 2 3\n",
        "v 1 2 3 1 0 0\n",
        "f 1 2\\\n 3\n",
        "mtllib none\n",
        "x y\n",
    ] {
        let [few, many] = [1 << 18, 1 << 20].map(|bytes| polls(&unit.repeat(bytes / unit.len())));
        assert!((4..24).contains(&few) && many >= few + 10 && many <= 5 * few, "{unit:?}: {few}, {many}");
    }
}

#[test]
fn traps_do_not_stop_loading() {
    let text = b"\xEF\xBB\xBFmtllib /dev/zero\nmtllib missing.mtl\n# caf\xE9\r\nv 0 0 0\rv 1 0 0 0.5\nv 1 1 0 1 0 0\nv 0 1 0\n\
        v nan 0 0\nusemtl\tred\nl 1 2 3\np 1\nf 1 2 \\\n 3 4\nf 1 2 9\nf 0 1 2\nf 1 2\nf -4 -3 -5\nf 1 2 5\nf 1 2 3";
    let scene = load_named("traps.obj", text).unwrap();
    assert_eq!(scene.triangles.len(), 4, "{:?}", scene.warnings);
    let colors = &scene.attributes.as_ref().unwrap().colors;
    assert!(colors.contains(&glam::Vec3::X) && colors.contains(&glam::Vec3::ONE));
    let warned = |what: &str| scene.warnings.entries.iter().find(|entry| entry.what.contains(what)).unwrap().count;
    assert_eq!(warned("does not exist"), 2);
    assert_eq!((warned("lines not"), warned("points not")), (1, 1));
    assert_eq!(warned("not numbers"), 1);
    assert_eq!(warned("fewer than 3"), 1);
    assert_eq!(warned("missing.mtl"), 1);
    assert_eq!(warned("/dev/zero"), 1);
}

#[test]
fn faults_name_their_line() {
    let message = load_named("a.obj", b"v 0 0 0\nv 0 x1 0\n").unwrap_err().to_string();
    assert!(message.contains("a.obj:2:5: 'x1' is not a number; "), "{message}");
    for word in ["0x10", "1,5", "--1"] {
        let message = load_named("a.obj", format!("v 0 0 0\n  v\t0 {word} 0\n").as_bytes()).unwrap_err().to_string();
        assert!(message.contains(&format!("a.obj:2:7: '{word}' is not a number; ")), "{message}");
    }
    let message = load_named("a.obj", b"v 0 0 0\nv 0 1 0\n").unwrap_err().to_string();
    assert!(message.contains("contains 2 points but no triangles"), "{message}");
    let message = load_named("a.obj", b"\xFF\xFEv\0").unwrap_err().to_string();
    assert!(message.contains("UTF-16"), "{message}");
}

#[test]
fn every_kind_of_file_loads() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let load = |rest: &str| load_named("a.obj", format!("{square}{rest}").as_bytes()).unwrap();
    // Old line ends, and bytes that are not UTF-8.
    let text = format!("# a\0b\n{square}f 1 2 3\n").replace('\n', "\r");
    assert_eq!(load_named("a.obj", text.as_bytes()).unwrap().triangles.len(), 1);
    // Indices at and beyond both ends.
    for index in ["0", "5", "-5", "9223372036854775808", "-9223372036854775808", "18446744073709551616", "x", "1.0"] {
        let scene = load(&format!("f 1 2 3\nf 1 2 {index}\n"));
        assert_eq!((scene.triangles.len(), scene.warnings.entries.len()), (1, 1), "{index}");
    }
    // Faces with any number of corners, and with equal corners.
    let corners: String = (0..100_000).map(|k| format!(" {}", 1 + k % 4)).collect();
    let scene = load(&format!("f 1\nf 1 2\nf{corners}\nf 1 1 2\n"));
    assert_eq!(scene.triangles.len(), 99_999, "{:?}", scene.warnings);
    assert_eq!(scene.warnings.entries[0].count, 2);
    // Attributes on some corners.
    let scene = load("vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1 2 3\nf 1/1 2 3//1\nf 1//1 2//1 3//1\n");
    let attributes = scene.attributes.as_ref().unwrap();
    assert_eq!((scene.triangles.len(), attributes.corners.len()), (4, 4));
    // A name with spaces is one library if it exists, else several; files outside the folder are not read.
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    std::fs::create_dir(&inside).unwrap();
    for place in ["inside/my colours.mtl", "inside/b.mtl", "outside.mtl"] {
        std::fs::write(folder.path().join(place), format!("newmtl {}\nKd 1 0 0\n", place.len())).unwrap();
    }
    for (libraries, material, warnings) in
        [("my colours.mtl", 21, 0), ("missing.mtl b.mtl", 12, 1), ("../outside.mtl", 11, 2)]
    {
        let text = format!("mtllib {libraries}\n{square}usemtl {material}\nf 1 2 3\n");
        std::fs::write(inside.join("a.obj"), text).unwrap();
        let scene = load_path(&inside.join("a.obj")).unwrap();
        let found = scene.material(0).base_color == glam::Vec3::X;
        assert_eq!(found, !libraries.starts_with(".."), "{libraries}");
        assert_eq!(scene.warnings.entries.len(), warnings, "{libraries}: {:?}", scene.warnings);
    }
}
