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
fn trees_have_names_rays_depths_rows_and_a_plot() {
    let folder = tempfile::tempdir().unwrap();
    let [csv, plot] = ["rows.csv", "plot.svg"].map(|name| folder.path().join(name));
    let files = ["--csv", csv.to_str().unwrap(), "--plot", plot.to_str().unwrap()];
    let trees = ["--a", "threshold=4", "--b", "threshold=20", "--rays", "ao,random"];
    let found = json(&[&trees[..], &files, &["--label", "small"]].concat());
    assert_eq!([&found["a"]["label"], &found["b"]["label"]], ["small", "AAC δ 20 ε 0.2, boxes"]);
    for (row, side) in [("a", 0), ("b", 1)] {
        let (row, depths) = (&found[row], found["by_depth"][side].as_array().unwrap());
        let sum = |name: &str| depths.iter().map(|depth| depth[name].as_f64().unwrap()).sum::<f64>();
        assert_eq!([sum("nodes"), sum("leaves")].map(Some), ["nodes", "leaves"].map(|name| row[name].as_f64()));
        assert!((sum("sah_cost") / row["sah_cost"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{depths:?}");
        let visits: u64 = depths.iter().map(|depth| depth["visits"]["ao"].as_u64().unwrap()).sum();
        assert_eq!(Some(visits), row["populations"][0]["visits"].as_u64());
    }
    let tests = |row: &str| found[row]["populations"][0]["tests_per_entering_ray"].as_f64().unwrap();
    let difference = found["difference"]["ao_tests_per_entering_ray"].as_f64().unwrap();
    assert!((difference - (tests("b") - tests("a"))).abs() < 1e-9, "{difference}");
    let [csv, plot] = [csv, plot].map(|path| std::fs::read_to_string(path).unwrap());
    assert_eq!(csv.lines().count(), 3, "{csv}");
    assert!([&csv, &plot].iter().all(|text| text.contains("small") && text.contains("AAC δ 20")), "{csv}");
    let (code, out, error) = diff(&[&trees[..], &["--csv", "-"]].concat());
    assert!(code == Some(0) && out.starts_with("command,") && out.lines().count() == 3, "{out}{error}");
    let (_, out, _) = diff(&trees);
    assert!(out.lines().any(|line| line.starts_with("tests/entering ray, ao")), "{out}");
    let head = out.lines().skip_while(|line| *line != "By depth").nth(2).unwrap();
    assert_eq!(head.split_whitespace().collect::<String>(), "AB".repeat(7), "{out}");
}

#[test]
fn the_table_has_both_trees_and_a_word_for_better_or_worse() {
    let (code, out, error) = diff(&["--a", "builder=lbvh", "--b", "preset=best"]);
    assert_eq!(code, Some(0), "{error}");
    let line = |name: &str| out.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {out}"));
    assert!(line("tests/ray").ends_with("better") && line("tests/ray").contains(" -"), "{out}");
    assert!(line("nodes").ends_with("other"), "{out}");
    assert!(line("A: LBVH (Morton), boxes: builder=lbvh").contains("container=box"), "{out}");
    assert!(
        line("B: AAC δ 6 ε 0.2, boxes, collapse restructure reinsert: builder=aac")
            .contains("optimize=collapse,restructure,reinsert"),
        "{out}"
    );
    assert!(out.contains("Nodes of A that B has too") && out.contains("Pixels: B takes fewer tests"), "{out}");
}
