//! Rays by which trees are measured: `info --rays` counts the visits of nodes, measuring commands say what rays cost.

use assert_cmd::Command;
use bvhscope::ray_file::{FileRay, RayHeader, RaySet, write_rays};
use bvhscope_engine::CancelToken;
use glam::DVec3;
use serde_json::Value;

/// Exit code, stdout and stderr of the program.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json(args: &[&str]) -> Vec<Value> {
    let (code, out, error) = run(args);
    assert_eq!(code, 0, "{args:?}: {error}");
    out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const NAMES: [&str; 5] = ["primary", "shadow", "ao", "bounce", "random"];

#[test]
fn info_counts_the_visits_of_each_node() {
    let info = json(&["info", "builtin:teapot:2", "--rays", "all", "--json"]).remove(0);
    let populations = info["populations"].as_array().unwrap();
    let names: Vec<&str> = populations.iter().map(|rays| rays["population"].as_str().unwrap()).collect();
    assert_eq!(names, NAMES);
    for rays in populations {
        let visits: Vec<u64> = rays["node_visits"].as_array().unwrap().iter().map(|v| v.as_u64().unwrap()).collect();
        assert_eq!(Some(visits.len() as u64), info["nodes"].as_u64());
        assert_eq!((Some(visits[0]), Some(visits.iter().sum())), (rays["root_hits"].as_u64(), rays["visits"].as_u64()));
        assert!(visits[0] > 100 && rays["cost"].as_f64().unwrap() > 1.0, "{}", rays["population"]);
    }
    let [cost, sah_cost] = [&populations[4]["cost"], &info["sah_cost"]].map(|value| value.as_f64().unwrap());
    assert!((cost / sah_cost - 1.0).abs() < 0.05, "random lines: {cost} instead of {sah_cost}");
    assert_eq!(json(&["info", "builtin:teapot:2", "--json"])[0].get("populations"), None, "not asked for");

    let text = run(&["info", "builtin:teapot:2", "--rays", "shadow"]).1;
    let line = text.lines().find(|line| line.trim_start().starts_with("shadow ")).unwrap_or_else(|| panic!("{text}"));
    assert!(line.contains("enter the root") && line.contains("predicted"), "{line}");
}

#[test]
fn builders_are_compared_by_what_rays_cost() {
    let common = ["compare", "builtin:teapot:2", "--size", "64x48", "--repeat", "1", "--rays", "primary,random"];
    let (code, lines, error) = run(&[&common[..], &["--json"]].concat());
    assert_eq!(code, 0, "{error}");
    let parsed = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let (rows, correlations): (Vec<_>, Vec<_>) = parsed.partition(|line| line.get("command").is_some());
    assert!(rows.len() > 8);
    for row in &rows {
        let rays = row["populations"].as_array().unwrap();
        let names: Vec<&str> = rays.iter().map(|rays| rays["population"].as_str().unwrap()).collect();
        assert_eq!(names, ["primary", "random"]);
        assert_eq!(rays[0]["rays"], 64 * 48);
    }
    let of: Vec<&str> = correlations.iter().map(|found| found["population"].as_str().unwrap()).collect();
    assert_eq!(of, ["primary", "random"]);
    assert!(correlations[1]["sah_cost_r"].as_f64().unwrap() > 0.99 && correlations[1]["alpha"].is_number());
    let folder = tempfile::tempdir().unwrap();
    let [file, plot] = ["rows.jsonl", "rows.svg"].map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&file, &lines).unwrap();
    let (code, _, error) = run(&["plot", &file, "-o", &plot]);
    assert_eq!(code, 0, "correlations are no rows to plot: {error}");
    let text = run(&common).1;
    assert!(text.contains("How well the measured cost was predicted"), "{text}");
    let correlation = |name: &str| -> f64 {
        let line = text.lines().find(|line| line.split_whitespace().nth(3) == Some(name)).unwrap();
        line.split_whitespace().nth(5).unwrap().parse().unwrap()
    };
    assert!(correlation("random") > 0.99, "{text}");
    let (code, _, error) = run(&["compare", "--rays", "primary,photons"]);
    assert!(code == 2 && error.contains("--rays") && error.contains("bounce"), "{error}");
}

/// A ray that stands for three costs as much as the same ray three times, and a file of a view's rays as much as that view's.
#[test]
fn rays_of_a_file_are_measured_with_their_weights() {
    let folder = tempfile::tempdir().unwrap();
    let [primary, weighted, repeated] = ["p.rays", "w.rays", "r.rays"].map(|name| folder.path().join(name));
    let path = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let view = ["--size", "256x256", "--camera", "front"];
    let made = run(&[&["rays", "builtin:teapot:2", "--kind", "primary", "-o", &path(&primary)], &view[..]].concat());
    assert_eq!(made.0, 0, "{}", made.2);
    let info = |rays: &str| {
        let camera = ["--camera", "front", "--json", "--rays", rays];
        json(&[&["info", "builtin:teapot:2"][..], &camera].concat()).remove(0)["populations"].clone()
    };
    let both = info(&format!("primary,{}", path(&primary)));
    assert_eq!((&both[0]["population"], &both[1]["population"]), (&"primary".into(), &"file".into()));
    for number in ["rays", "entering_rays", "root_hits", "visits", "cost", "tests_per_entering_ray", "node_visits"] {
        assert_eq!(both[0][number], both[1][number], "{number}");
    }
    let rays = RaySet::read(&primary, DVec3::ZERO, &CancelToken::new()).unwrap().rays;
    let write = |path: &std::path::Path, rays: &[FileRay]| {
        let mut bytes = Vec::new();
        write_rays(&RayHeader::default(), rays, &mut bytes, &CancelToken::new()).unwrap();
        std::fs::write(path, bytes).unwrap();
    };
    let middle = &rays[rays.len() / 2 + 90..][..60];
    let weight = |index: usize| 1.0 + (index % 3) as f32;
    write(
        &weighted,
        &middle.iter().enumerate().map(|(at, &ray)| FileRay { weight: weight(at), ..ray }).collect::<Vec<_>>(),
    );
    let times = middle.iter().enumerate().flat_map(|(at, &ray)| std::iter::repeat_n(ray, weight(at) as usize));
    write(&repeated, &times.collect::<Vec<_>>());
    let [weighted, repeated] = [info(&path(&weighted)), info(&path(&repeated))];
    assert_eq!(weighted, repeated);
    assert_eq!(weighted[0]["rays"], 120);
    assert!(weighted[0]["visits"].as_u64().unwrap() > 300, "{weighted}");
}

#[test]
fn builders_are_ranked_by_the_rays_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.rays").display().to_string();
    assert_eq!(run(&["rays", "builtin:teapot:2", "--kind", "random", "--count", "5000", "-o", &file]).0, 0);
    let common = ["compare", "builtin:teapot:2", "--size", "16x16", "--repeat", "1", "--rays", &file];
    let text = run(&common).1;
    let line =
        text.lines().find(|line| line.split_whitespace().nth(3) == Some("file")).unwrap_or_else(|| panic!("{text}"));
    let correlation: f64 = line.split_whitespace().nth(5).unwrap().parse().unwrap();
    assert!(correlation > 0.8, "random lines cost what the SAH predicts: {text}");
    let row = &json(&[&common[..], &["--json"]].concat())[0];
    assert_eq!((&row["populations"][0]["population"], &row["populations"][0]["rays"]), (&"file".into(), &5000.into()));
    assert!(row["command_line"].as_str().unwrap().contains("a.rays"), "{row}");
    // The same rays in each frame.
    let walker = ["animate", "builtin:walker:500", "--size", "16x16", "--repeat", "1", "--frames", "2", "--json"];
    for row in json(&[&walker[..], &["--rays", &file]].concat()) {
        let population = &row["populations"][0];
        assert_eq!((&population["population"], &population["rays"]), (&"file".into(), &5000.into()), "{row}");
    }
}
