//! Rays by which trees are measured: `info --rays` counts the visits of nodes, measuring commands say what rays cost.

use assert_cmd::Command;
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
