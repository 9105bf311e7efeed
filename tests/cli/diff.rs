//! `diff`: two trees of one model.

use assert_cmd::Command;
use serde_json::Value;

fn diff(extra: &[&str]) -> (Option<i32>, String, String) {
    let model = ["diff", "builtin:teapot:3", "--size", "48x32", "--repeat", "1"];
    let output = Command::cargo_bin("bvhscope").unwrap().args(model).args(extra).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), out, error)
}

fn json(extra: &[&str]) -> Value {
    let (code, out, error) = diff(&[extra, &["--json"]].concat());
    assert_eq!((code, out.lines().count()), (Some(0), 1), "{error}");
    serde_json::from_str(&out).unwrap()
}

/// The pixels of a PNG.
fn pixels(path: &std::path::Path) -> Vec<[u8; 3]> {
    image::open(path).unwrap().to_rgb8().pixels().map(|pixel| pixel.0).collect()
}

#[test]
fn equal_trees_differ_in_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("same.png");
    let found = json(&["--a", "threshold=9", "--b", "threshold=9 preset=fast", "-o", picture.to_str().unwrap()]);
    for (name, value) in found["difference"].as_object().unwrap() {
        // Times are measured.
        if name != "build_ms" && name != "mrays_per_s" {
            assert_eq!(value.as_f64(), Some(0.0), "{name}");
        }
    }
    assert_eq!([&found["survived_share"], &found["survived_interior_share"]].map(Value::as_f64), [Some(1.0); 2]);
    assert_eq!(found["survived_nodes"], found["a"]["nodes"]);
    assert_eq!([&found["pixels_fewer"], &found["pixels_more"]].map(Value::as_u64), [Some(0); 2]);
    assert_eq!(found["pixels_same"].as_u64(), Some(48 * 32));
    assert!(pixels(&picture).iter().all(|&[r, g, b]| r == g && g == b), "neutral grey");
}

#[test]
fn a_better_tree_takes_fewer_tests() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("better.png");
    let found = json(&["--a", "builder=lbvh", "--b", "preset=best", "-o", picture.to_str().unwrap()]);
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    for name in ["tests_per_ray", "container_tests_per_ray", "sah_cost", "nodes"] {
        let difference = number(&format!("/b/{name}")) - number(&format!("/a/{name}"));
        assert!(difference < 0.0 && (number(&format!("/difference/{name}")) - difference).abs() < 1e-9, "{name}");
    }
    assert!(number("/pixels_fewer") > number("/pixels_more"), "{found}");
    let survived = number("/survived_interior_share");
    assert!(survived > 0.01 && survived < 0.9, "{survived}");
    assert!(number("/survived_nodes") < number("/a/nodes"));
    let limit = number("/difference_range/1");
    assert!(limit >= 1.0 && number("/difference_range/0") == -limit);
    // As many blue pixels as have fewer tests, apart from those that round to grey.
    let pixels = pixels(&picture);
    let blue = pixels.iter().filter(|[r, _, b]| b > r).count() as f64;
    let orange = pixels.iter().filter(|[r, _, b]| r > b).count() as f64;
    assert_eq!(pixels.len(), 48 * 32);
    assert!((blue - number("/pixels_fewer")).abs() <= 2.0 && (orange - number("/pixels_more")).abs() <= 2.0);
}

#[test]
fn costs_of_different_containers_are_not_subtracted() {
    let found = json(&["--a", "container=box", "--b", "container=sphere"]);
    let difference = found["difference"].as_object().unwrap();
    assert!(!difference.contains_key("sah_cost") && !difference.contains_key("epo"), "{difference:?}");
    assert!(difference["tests_per_ray"].as_f64().unwrap() > 0.0, "{difference:?}");
}

#[test]
fn the_table_has_both_trees_and_a_word_for_better_or_worse() {
    let (code, out, error) = diff(&["--a", "builder=lbvh", "--b", "preset=best"]);
    assert_eq!(code, Some(0), "{error}");
    let line = |name: &str| out.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {out}"));
    assert!(line("tests/ray").ends_with("better") && line("tests/ray").contains(" -"), "{out}");
    assert!(line("nodes").ends_with("other"), "{out}");
    assert!(line("A: builder=lbvh").contains("container=box"), "{out}");
    assert!(line("B: builder=aac").contains("optimize=collapse,restructure,reinsert"), "{out}");
    assert!(out.contains("Nodes of A that B has too") && out.contains("Pixels: B takes fewer tests"), "{out}");
}
