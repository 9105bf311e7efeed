//! `bvhscope ray`: the steps of a ray through a tree that is known, and the counters of the same ray.

use std::path::Path;

use assert_cmd::Command;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal, closest_hit};
use bvhscope_engine::{BuildSettings, CancelToken, Ray, build, with_tree};
use glam::Vec3;
use serde_json::Value;

/// Exit code, stdout and stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().arg("ray").args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Four triangles across the x axis: two near to another at 1 and 2, two at 11 and 12.
fn row() -> Vec<Triangle> {
    let at = |x: f32| Triangle { a: Vec3::new(x, 0.0, 0.0), b: Vec3::new(x, 1.0, 0.0), c: Vec3::new(x, 0.0, 1.0) };
    [1.0, 2.0, 11.0, 12.0].map(at).to_vec()
}

fn write_row(folder: &Path) -> String {
    let mut text = String::new();
    for Triangle { a, b, c } in row() {
        for corner in [a, b, c] {
            text += &format!("v {} {} {}\n", corner.x, corner.y, corner.z);
        }
    }
    text += "f 1 2 3\nf 4 5 6\nf 7 8 9\nf 10 11 12\n";
    let path = folder.join("row.obj");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Each event as "enter 3 11", with node or triangle and distance.
fn events(row: &Value) -> Vec<String> {
    let text = |event: &Value, name: &str| event[name].as_f64().map(|number| format!(" {number}")).unwrap_or_default();
    let events = row["events"].as_array().unwrap().iter();
    let line = |event: &Value| {
        let name = event["event"].as_str().unwrap();
        format!("{name}{}{}{}", text(event, "node"), text(event, "triangle"), text(event, "t"))
    };
    events.map(line).collect()
}

fn json(args: &[&str]) -> Value {
    let (code, out, error) = run(&[args, &["--json"]].concat());
    assert_eq!(code, 0, "{error}");
    assert_eq!(out.lines().count(), 1);
    serde_json::from_str(&out).unwrap()
}

/// Worked out by hand: the near pair first, in it the near triangle, which is hit; everything else begins behind it.
#[test]
fn the_events_of_a_ray_through_four_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let model = write_row(folder.path());
    let along = [&model[..], "--origin", "0,0.25,0.25", "--direction", "7,0,0"];
    let ordered = json(&along);
    // The root is 0, its children the near pair 1 and the far pair 2; the near pair's are 5 and 6.
    let expected = [
        "enter 0 1",
        "visit 0",
        "enter 1 1",
        "enter 2 11",
        "push 2",
        "visit 1",
        "enter 5 1",
        "enter 6 2",
        "push 6",
        "visit 5",
        "test 0 1",
        "nearer 1",
        "pop 6",
        "cull 6 2",
        "pop 2",
        "cull 2 11",
    ];
    assert_eq!(events(&ordered), expected);
    assert_eq!((ordered["container_tests"].as_u64(), ordered["primitive_tests"].as_u64()), (Some(5), Some(1)));
    assert_eq!(
        (ordered["visited"].as_u64(), ordered["wasted"].as_u64(), ordered["skipped"].as_u64()),
        (Some(3), Some(0), Some(2))
    );
    assert_eq!(ordered["hit"], serde_json::json!({ "t": 1.0, "triangle": 0 }));
    let all = ordered["all_hits"].as_array().unwrap().iter();
    let all: Vec<_> = all.map(|hit| (hit["triangle"].as_u64(), hit["t"].as_f64(), hit["thickness"].as_f64())).collect();
    let hit = |triangle, t, thickness| (Some(triangle), Some(t), thickness);
    assert_eq!(all, [hit(0, 1.0, None), hit(1, 2.0, Some(1.0)), hit(2, 11.0, None), hit(3, 12.0, Some(1.0))]);
    // From the other side, without order: each triangle but the last is nearer than those before, and that one is tested all the same.
    let back = [&model[..], "--origin", "13,0.25,0.25", "--direction", "-1,0,0", "--traversal", "paper"];
    let paper = json(&back);
    let expected = [
        "enter 0 1",
        "visit 0",
        "enter 1 11",
        "enter 2 1",
        "push 2",
        "visit 1",
        "enter 5 12",
        "enter 6 11",
        "push 6",
        "visit 5",
        "test 0 12",
        "nearer 12",
        "pop 6",
        "visit 6",
        "test 1 11",
        "nearer 11",
        "pop 2",
        "visit 2",
        "enter 3 1",
        "enter 4 2",
        "push 4",
        "visit 3",
        "test 3 1",
        "nearer 1",
        "pop 4",
        "visit 4",
        "test 2",
    ];
    assert_eq!(events(&paper), expected);
    assert_eq!((paper["visited"].as_u64(), paper["wasted"].as_u64()), (Some(7), Some(1)));
    // Beyond the first pair, past the triangles of the second: all is wasted.
    let past = json(&[&model[..], "--origin", "5,0.8,0.8", "--direction", "1,0,0", "--traversal", "paper"]);
    assert_eq!((past["hit"].is_null(), past["visited"].as_u64(), past["wasted"].as_u64()), (true, Some(4), Some(4)));
    assert_eq!(past["t_max"], Value::Null, "it never ends");
}

#[test]
fn the_table_has_the_events_and_the_totals() {
    let folder = tempfile::tempdir().unwrap();
    let model = write_row(folder.path());
    let (code, out, error) = run(&[&model, "--origin", "0,0.25,0.25", "--direction", "1,0,0"]);
    assert_eq!(code, 0, "{error}");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[0].contains("row.obj: primary ray, ordered traversal of the binary tree of boxes"), "{out}");
    assert_eq!(lines[1], "from 0,0.25,0.25 towards 1,0,0");
    assert!(lines[2].starts_with("step") && lines[3].ends_with("nodes"), "{out}");
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(words(lines[4]), ["1", "enter", "0", "0", "1.00000", "1", "0", "0"]);
    assert_eq!(words(lines[14]), ["11", "test", "1.00000", "0", "5", "1", "2"]);
    assert_eq!(lines.len(), 4 + 16 + 4);
    assert_eq!(lines[20], "Hits triangle 0 at 1.00000.");
    assert_eq!(lines[21], "5 container tests, 1 triangle test.");
    assert!(
        lines[23].starts_with("All 4 hits: ") && lines[23].contains(" triangle 1 at 2.00000 (1.00000 thick), "),
        "{out}"
    );
    let widths: Vec<usize> = lines[4..20].iter().map(|line| line.len()).collect();
    assert!(widths.iter().all(|width| *width == widths[0]), "the columns are aligned: {out}");
}

#[test]
fn totals_are_the_counters_of_the_same_ray() {
    let folder = tempfile::tempdir().unwrap();
    let model = write_row(folder.path());
    let triangles = row();
    for (name, traversal) in [("ordered", Traversal::Ordered), ("paper", Traversal::Paper)] {
        for (origin, direction) in [("3,0.1,0.1", "1,0.01,0"), ("30,0.3,0.3", "-1,0,0"), ("0,5,0", "1,0,0")] {
            let row = json(&[&model, "--origin", origin, "--direction", direction, "--traversal", name]);
            let vector = |name: &str| {
                Vec3::from_slice(
                    &row[name].as_array().unwrap().iter().map(|x| x.as_f64().unwrap() as f32).collect::<Vec<_>>(),
                )
            };
            let ray = Ray::new(vector("origin"), vector("direction"));
            let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new()).unwrap();
            let mut counts = TestCounts::default();
            let leaf_triangles = bvh.tree().leaf_triangles(&triangles, &CancelToken::new()).unwrap();
            let hit = with_tree!(bvh.tree(), tree => closest_hit(tree, &leaf_triangles, &ray, traversal, &mut counts));
            assert_eq!(row["container_tests"].as_u64(), Some(counts.containers), "{name}, {origin}");
            assert_eq!(row["primitive_tests"].as_u64(), Some(counts.primitives), "{name}, {origin}");
            assert_eq!(
                row["hit"]["triangle"].as_u64(),
                hit.map(|hit| u64::from(hit.primitive_index)),
                "{name}, {origin}"
            );
        }
    }
}

#[test]
fn rays_of_pixels_leave_the_surface() {
    let teapot = ["builtin:teapot:3", "--size", "64x48", "--pixel", "32,24"];
    let with = |flags: &[&str]| json(&[&teapot[..], flags].concat());
    let primary = with(&[]);
    assert_eq!((primary["kind"].as_str(), primary["pixel"].as_array().map(Vec::len)), (Some("primary"), Some(2)));
    let occlusion = with(&["--kind", "ao", "--wide", "--container", "sphere"]);
    assert_eq!((occlusion["traversal"].as_str(), occlusion["container"].as_str()), (Some("wide"), Some("sphere")));
    assert!(occlusion["t_max"].as_f64().is_some(), "an occlusion ray ends");
    assert_ne!(primary["origin"], occlusion["origin"]);
    // No ray: the reason, and no table.
    let (code, out, error) = run(&["builtin:teapot:3", "--size", "64x48", "--pixel", "0,0", "--kind", "shadow"]);
    assert_eq!((code, &out[..]), (1, ""), "{error}");
    assert!(error.contains("shadow ray of pixel 0,0") && error.contains("hits nothing"), "{error}");
    let (code, _, error) = run(&[&teapot[..], &["--kind", "shadow", "--light", "headlight"]].concat());
    assert!(code == 1 && error.contains("headlight"), "{error}");
}

#[test]
fn wrong_rays_are_usage_errors() {
    let cases: [(&[&str], &[&str]); 12] = [
        (&[], &["--pixel", "--origin"]),
        (&["--pixel", "5"], &["--pixel", "X,Y"]),
        (&["--pixel", "-1,5"], &["-1"]),
        (&["--pixel", "1280,5"], &["1280,5", "1280x720", "1279,719"]),
        (&["--pixel", "8,2", "--size", "8x8"], &["8x8", "7,7"]),
        (&["--origin", "0,0,0"], &["--direction"]),
        (&["--direction", "0,0,1"], &["--origin"]),
        (&["--origin", "0,0,0", "--direction", "0,0,0"], &["--direction", "points nowhere"]),
        (&["--origin", "0,0,nan", "--direction", "0,0,1"], &["--origin", "X,Y,Z"]),
        (&["--pixel", "1,1", "--origin", "0,0,0", "--direction", "0,0,1"], &["--pixel", "--origin"]),
        (&["--pixel", "1,1", "--kind", "light"], &["--kind", "primary, shadow, ao, bounce"]),
        (&["--pixel", "1,1", "--wide", "--traversal", "paper"], &["--wide", "--traversal"]),
    ];
    for (args, parts) in cases {
        let (code, out, error) = run(args);
        assert_eq!((code, &out[..]), (2, ""), "{args:?}: {error}");
        for part in parts {
            assert!(error.contains(part), "{args:?}: '{part}' is missing in: {error}");
        }
    }
}
