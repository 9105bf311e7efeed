//! `bvhscope rays`: files of rays that are written and read.

use std::path::Path;

use assert_cmd::Command;
use bvhscope::ray_file::{FileRay, MISS, RayHeader, RaySet, write_rays};
use bvhscope_engine::{CancelToken, Ray};
use glam::{DVec3, Vec3};
use serde_json::Value;

/// Exit code, stdout and stderr.
fn run(args: &[&str], input: &str) -> (i32, String, String) {
    let mut command = Command::cargo_bin("bvhscope").unwrap();
    let output = command.arg("rays").args(args).write_stdin(input.to_owned()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn read(path: &Path) -> Vec<FileRay> {
    RaySet::read(path, DVec3::ZERO, &CancelToken::new()).unwrap().rays
}

#[test]
fn every_population_is_written_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, any) in [("primary", 0), ("shadow", 700), ("ao", 700), ("bounce", 0), ("random", 0)] {
        let path = folder.path().join(kind);
        let file = path.to_str().unwrap();
        let (code, _, error) = run(&["builtin:teapot:2", "--kind", kind, "--count", "700", "-o", file], "");
        assert!(code == 0 && error.contains("700 rays"), "{kind}: {error}");
        let rays = read(&path);
        assert_eq!(rays.len(), 700, "{kind}");
        assert!(rays.iter().all(|ray| ray.pixel.is_some() == (kind == "primary")), "{kind}");
        let (code, out, error) = run(&["builtin:teapot:2", "--rays", file, "--json"], "");
        assert_eq!(code, 0, "{kind}: {error}");
        let summary: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((&summary["rays"], &summary["any_rays"]), (&700.into(), &any.into()), "{kind}");
        assert_eq!(summary["header"]["kind"], kind);
    }
}

#[test]
fn lines_of_standard_input_become_a_ray_file_and_bad_rays_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.rays");
    let lines =
        "# two forms\n0 0 9 0 0 -1\n0,0,9,0.5,0,0,-2,7\n0 0 9 0 0 0\n0 0 9 nan 0 1\n0 0 9 3 0 0 -1 2\n0 0 9 0 0 0\n";
    let args = ["--rays", "-", "-o", path.to_str().unwrap(), "--json"];
    let (code, out, error) = run(&args, lines);
    assert_eq!(code, 0, "{error}");
    let summary: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&summary["rays"], &summary["skipped_rays"]), (&2.into(), &4.into()));
    assert!(
        error.contains("2 rays skipped, with a direction of length zero") && error.contains("first is ray 2"),
        "{error}"
    );
    assert!(error.contains("NaN") && error.contains("t_min above t_max"), "{error}");
    let rays = read(&path);
    let limits: Vec<_> =
        rays.iter().map(|ray| (ray.ray.origin.z, ray.ray.t_min, ray.ray.direction.z, ray.ray.t_max)).collect();
    assert_eq!(limits, [(9.0, 0.0, -1.0, f32::INFINITY), (9.0, 0.5, -2.0, 7.0)]);
    assert_eq!(run(&["--rays", "-", "--strict"], lines).0, 3, "rays were skipped");
}

#[test]
fn far_models_keep_the_origins_of_their_rays() {
    let folder = tempfile::tempdir().unwrap();
    let [model, file, again] = ["far.obj", "far.rays", "again.rays"].map(|name| folder.path().join(name));
    std::fs::write(&model, "v 408204.01 4080928 0\nv 408205.03 4080928 0\nv 408204.01 4080929.07 0\nf 1 2 3\n")
        .unwrap();
    let [model, file, again] = [&model, &file, &again].map(|path| path.to_str().unwrap());
    let (code, _, error) = run(&[model, "--kind", "primary", "--count", "50", "-o", file], "");
    assert_eq!(code, 0, "{error}");
    let (code, _, error) = run(&[model, "--rays", file, "-o", again], "");
    assert_eq!(code, 0, "{error}");
    let [written, rewritten] = [file, again].map(|path| read(path.as_ref()));
    assert_eq!(written, rewritten);
    let (_, out, _) = run(&[model, "--rays", file, "--json"], "");
    let summary: Value = serde_json::from_str(&out).unwrap();
    assert!(summary["entering_rays"].as_u64().unwrap() > 10, "{summary}");
}

#[test]
fn files_that_cannot_be_read_are_refused_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let npy =
        |header: &str| [&b"\x93NUMPY\x01\0"[..], &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
    let native = |header: &str| format!("bvhscope rays 1\n{header}\n").into_bytes();
    let cases: [(Vec<u8>, &str); 11] = [
        (b"".to_vec(), "is empty; write the rays again"),
        (b"bvhscope rays 2\n{}\n".to_vec(), "version '2', not 1"),
        (b"bvhscope rays 1\r\n{}\r\n".to_vec(), "text mode"),
        (native("{}"), "no object 'arrays'"),
        (native(r#"{"rays":1,"arrays":{}}"#), "has no 'rays'"),
        (
            native(r#"{"rays":1,"arrays":{"rays":0}}"#),
            "array 'rays' of 1 rays begins at byte 0 of the data, which has 0",
        ),
        (native(r#"{"rays":0,"arrays":{"rays":-1}}"#), "no whole number as 'rays'"),
        (npy("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 8), }"), "type '>f4'"),
        (npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 8), }"), "Fortran order"),
        (npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 7), }"), "shape (2, 7)"),
        (b"0 0 0 1 0\n".to_vec(), "line 1: 5 numbers where 6 or 8 are expected"),
    ];
    for (bytes, expected) in cases {
        std::fs::write(&path, bytes).unwrap();
        let (code, _, error) = run(&["--rays", path.to_str().unwrap()], "");
        assert!(code == 1 && error.contains(expected) && error.trim_end().lines().count() == 1, "{expected}: {error}");
        assert!(error.contains("; "), "a remedy: {error}");
    }
    let lie = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (100000000000000, 8), }");
    std::fs::write(&path, lie).unwrap();
    let output = folder.path().join("out");
    let (code, _, error) = run(&["--rays", path.to_str().unwrap(), "-o", output.to_str().unwrap()], "");
    assert!(code == 1 && error.contains("the rays would need"), "{error}");
    assert!(!output.exists());
}

/// The object that `--verify --json` prints, with exit code 3 where anything is wrong.
fn verify(args: &[&str]) -> (i32, Value) {
    let (code, out, error) = run(&[args, &["--verify", "--json", "--strict"]].concat(), "");
    (code, serde_json::from_str(&out).unwrap_or_else(|_| panic!("{args:?}: {error}")))
}

/// Numbers of rays by agreement, of the tree with this name.
fn rays_of(check: &Value, name: &str) -> std::collections::BTreeMap<String, u64> {
    let names = check["agreements"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned());
    let compared = check["compared"].as_array().unwrap().iter().find(|compared| compared["name"] == name).unwrap();
    names.zip(compared["rays"].as_array().unwrap().iter().map(|rays| rays.as_u64().unwrap())).collect()
}

/// The box of an interior node of a tree file shrinks to its centre: the rays that it loses are found, and the node is blamed.
#[test]
fn a_node_that_was_shrunk_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let [tree, file, worst] =
        ["t.bvh", "a.rays", "worst.rays"].map(|name| folder.path().join(name).display().to_string());
    let model = "builtin:teapot:2";
    let made = Command::cargo_bin("bvhscope").unwrap().args(["tree", model, "-o", &tree]).output().unwrap();
    assert!(made.status.success());
    assert_eq!(run(&[model, "--kind", "primary", "--count", "6000", "-o", &file], "").0, 0);
    let (code, sound) = verify(&[model, "--rays", &file, "--tree", &tree]);
    assert_eq!((code, &sound["worst"]), (0, &Value::Array(Vec::new())), "all containers and passes are right");
    assert!(sound["compared"].as_array().unwrap().len() > 10 && sound["hits"].as_u64().unwrap() > 200, "{sound}");

    let mut bytes = std::fs::read(&tree).unwrap();
    let lines: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at] == b'\n').take(2).collect();
    let header: Value = serde_json::from_slice(&bytes[lines[0] + 1..lines[1]]).unwrap();
    let node = 4;
    let begin = lines[1] + 1 + header["arrays"]["bounds"].as_u64().unwrap() as usize + 24 * node;
    let number = |bytes: &[u8], at: usize| f32::from_le_bytes(bytes[begin + 4 * at..][..4].try_into().unwrap());
    for axis in 0..3 {
        let middle = f32::midpoint(number(&bytes, axis), number(&bytes, axis + 3)).to_le_bytes();
        bytes[begin + 4 * axis..][..4].copy_from_slice(&middle);
        bytes[begin + 4 * (axis + 3)..][..4].copy_from_slice(&middle);
    }
    std::fs::write(&tree, bytes).unwrap();
    let (code, check) = verify(&[model, "--rays", &file, "--tree", &tree, "-o", &worst]);
    assert_eq!(code, 3);
    let (wrong, right) = (rays_of(&check, &tree), rays_of(&check, "box"));
    assert!(wrong["false_miss"] + wrong["other_distance"] > 5, "{wrong:?}");
    assert_eq!(right["false_miss"] + right["other_distance"] + right["leak"] + right["false_hit"], 0);
    for finding in check["worst"].as_array().unwrap() {
        assert_eq!(
            (&finding["tree"], &finding["blamed"]["node"]),
            (&tree.as_str().into(), &(node as u64).into()),
            "{finding}"
        );
        assert!(finding["pixel"].is_array(), "{finding}");
    }
    // The worst rays expect the exact hits, which our trees find.
    let (code, again) = verify(&[model, "--rays", &worst]);
    assert_eq!((code, &again["checked_rays"]), (0, &10.into()));
    assert_eq!(rays_of(&again, "the file")["same"], 10);
}

#[test]
fn what_another_program_found_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let [model, file] = ["two.obj", "a.rays"].map(|name| folder.path().join(name));
    // Two walls; the nearer one is a square of two triangles.
    std::fs::write(
        &model,
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 1 2 3\nf 1 3 4\nf 5 6 7\n",
    )
    .unwrap();
    let at = |x: f32, y: f32| Ray::new(Vec3::new(x, y, 2.0), Vec3::NEG_Z);
    let expecting = |ray, triangle, t| FileRay { expected_triangle: triangle, expected_t: t, ..FileRay::new(0, ray) };
    let cases = [
        ("same", expecting(at(0.7, 0.3), Some(0), Some(2.0))),
        ("same", expecting(at(0.7, 0.3), None, Some(2.0))),
        ("same", expecting(at(5.0, 0.3), Some(MISS), None)),
        ("other_triangle", expecting(at(0.5, 0.5), Some(1), Some(2.0))),
        ("other_distance", expecting(at(0.7, 0.3), Some(0), Some(2.01))),
        ("other_distance", expecting(at(0.3, 0.2), Some(2), Some(3.0))),
        ("other_distance", expecting(at(0.7, 0.3), None, Some(3.0))),
        ("leak", expecting(at(0.25, 0.25), Some(2), Some(3.0))),
        ("rounding", expecting(at(1.0, 0.5), Some(MISS), Some(f32::INFINITY))),
        ("false_miss", expecting(at(0.7, 0.3), None, Some(f32::INFINITY))),
        ("false_hit", expecting(at(5.0, 0.3), Some(0), Some(2.0))),
        ("false_miss", FileRay { any: true, ..expecting(at(0.7, 0.3), Some(MISS), None) }),
        ("false_hit", FileRay { any: true, ..expecting(at(5.0, 0.3), None, Some(1.0)) }),
    ];
    for (expected, ray) in cases {
        let mut bytes = Vec::new();
        write_rays(&RayHeader::default(), &[ray], &mut bytes, &CancelToken::new()).unwrap();
        std::fs::write(&file, bytes).unwrap();
        let (_, check) = verify(&[model.to_str().unwrap(), "--rays", file.to_str().unwrap()]);
        assert_eq!(rays_of(&check, "the file")[expected], 1, "{expected}: {check}");
    }
    let ray = expecting(at(0.5, 0.5), Some(3), None);
    let mut bytes = Vec::new();
    write_rays(&RayHeader::default(), &[ray], &mut bytes, &CancelToken::new()).unwrap();
    std::fs::write(&file, bytes).unwrap();
    let (code, _, error) = run(&[model.to_str().unwrap(), "--rays", file.to_str().unwrap(), "--verify"], "");
    assert!(code == 1 && error.contains("ray 0 expects triangle 3, and the model has 3"), "{error}");
}
