//! `animate`: trees that follow a model that moves, by each policy.

use assert_cmd::Command;
use serde_json::Value;

/// Exit code, stdout and stderr of the program.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn rows(args: &[&str]) -> Vec<Value> {
    let (code, out, error) = run(args);
    assert_eq!(code, 0, "{args:?}: {error}");
    out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const POLICIES: [&str; 8] =
    ["keep", "refit", "rotate", "reinsert", "partial-rebuild", "rebuild", "rebuild-behind", "whole-clip"];
const WALKER: [&str; 8] = ["animate", "builtin:walker:2000", "--size", "32x32", "--repeat", "1", "--frames", "5"];

#[test]
fn each_frame_has_a_row_of_each_policy() {
    let rows = rows(&[&WALKER[..], &["--json", "--rays", "primary,random"]].concat());
    assert_eq!(rows.len(), 5 * POLICIES.len());
    for (at, row) in rows.iter().enumerate() {
        let frame = at / POLICIES.len();
        assert_eq!((&row["policy"], &row["frame"]), (&POLICIES[at % 8].into(), &frame.into()));
        assert_eq!((&row["command"], &row["clip"]), (&"animate".into(), &"walk".into()));
        for number in ["sah_cost", "epo", "update_ms", "ready_ms", "ray_ns", "population_tests_per_ray", "time_s"] {
            assert!(row[number].as_f64().is_some(), "{number} of {row}");
        }
        assert!(row.get("build_ms").is_none() && row["update_ms"].as_f64() < row["ready_ms"].as_f64());
        assert_eq!(row.get("behind_ms").is_some(), row["policy"] == "rebuild-behind" && frame == 1, "{row}");
        let names: Vec<&str> =
            row["populations"].as_array().unwrap().iter().map(|rays| rays["population"].as_str().unwrap()).collect();
        assert_eq!(names, ["primary", "random"]);
    }
    let costs = |policy: &str| -> Vec<f64> {
        rows.iter().filter(|row| row["policy"] == policy).map(|row| row["sah_cost"].as_f64().unwrap()).collect()
    };
    let [refit, rebuild] = ["refit", "rebuild"].map(costs);
    assert!((refit[0] / rebuild[0] - 1.0).abs() < 1e-5, "the first frame is that of the build: {refit:?} {rebuild:?}");
    assert!(refit[2] > rebuild[2], "{refit:?} {rebuild:?}");
    let seconds: Vec<f64> = rows.iter().step_by(8).map(|row| row["time_s"].as_f64().unwrap()).collect();
    assert!(seconds[0] == 0.0 && seconds.windows(2).all(|pair| pair[1] > pair[0]), "{seconds:?}");
}

#[test]
fn costs_and_tests_are_the_same_again_whatever_the_threads() {
    let args = |threads| [&WALKER[..], &["--json", "--threads", threads]].concat();
    let counts = |row: &Value| {
        ["policy", "frame", "sah_cost", "epo", "population_tests_per_ray", "nodes"].map(|name| row[name].clone())
    };
    let [one, two] = ["1", "2"].map(|threads| rows(&args(threads)).iter().map(counts).collect::<Vec<_>>());
    assert_eq!(one, two);
}

#[test]
fn the_table_ends_with_findings_and_the_plot_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let [plot, csv] = ["motion.svg", "motion.csv"].map(|name| folder.path().join(name));
    let chosen = ["--policy", "rebuild,refit", "--clip", "jump", "--plot"];
    let (code, text, error) =
        run(&[&WALKER[..], &chosen, &[plot.to_str().unwrap(), "--csv", csv.to_str().unwrap()]].concat());
    assert_eq!(code, 0, "{error}");
    assert!(text.starts_with("walker 2000, aac, box: 5 frames of clip 'jump'"), "{text}");
    assert!(text.contains("With 1,024 rays a frame and over 5 frames, ") && text.contains("ebuilding "), "{text}");
    assert!(error.contains("box, rebuild, frame 4 (") && error.contains("tests a ray"), "{error}");
    let drawn = std::fs::read_to_string(plot).unwrap();
    for part in ["Refit", "Rebuild", "Update until rays can be traced (ms)", "Time of the clip (s)", "SAH cost"] {
        assert!(drawn.contains(part), "{part} is missing in the plot");
    }
    let table = std::fs::read_to_string(csv).unwrap();
    assert!(table.lines().count() == 11 && table.lines().next().unwrap().contains(",policy,clip,frame,time_s,"));
}

#[test]
fn spheres_follow_by_all_policies_that_take_them() {
    let rows = rows(&[&WALKER[..], &["--json", "--container", "both"]].concat());
    let of = |container: &str| rows.iter().filter(|row| row["container"] == container).count();
    assert_eq!((of("box"), of("sphere")), (5 * 7, 5 * 7), "reinsertion is for boxes");
}

#[test]
fn what_cannot_be_measured_is_refused_with_a_reason() {
    let cases: [(&[&str], i32, &[&str]); 7] = [
        (&["animate", "builtin:teapot:2"], 1, &["builtin:teapot:2", "no clips", "does not move"]),
        (&["animate", "builtin:walker:2000", "--clip", "swim"], 1, &["--clip swim", "0 'walk'", "1 'jump'"]),
        (&["animate", "builtin:walker:2000", "--frames", "0"], 2, &["--frames", "1 to 10000"]),
        (&["animate", "builtin:walker:2000", "--policy", "reload"], 2, &["--policy", "keep, refit", "whole-clip"]),
        (
            &["animate", "builtin:walker:2000", "--policy", "reinsert", "--container", "sphere"],
            2,
            &["'reinsert'", "boxes only", "'rotate'"],
        ),
        (
            &["animate", "builtin:walker:2000", "--builder", "binned-sah", "--container", "sphere"],
            2,
            &["binned SAH", "no spheres", "14-DOPs"],
        ),
        (&["animate", "builtin:walker:2000", "--plot", "x.jpg"], 2, &["x.jpg", ".png or .svg"]),
    ];
    for (args, expected, parts) in cases {
        let (code, out, error) = run(args);
        assert_eq!((code, out.as_str()), (expected, ""), "{args:?}: {error}");
        for part in parts {
            assert!(error.contains(part), "{args:?}: '{part}' is missing in: {error}");
        }
    }
}

#[test]
fn of_copies_in_two_levels_the_tree_above_alone_is_updated() {
    let scene = ["animate", "builtin:traffic:300", "--size", "48x32", "--repeat", "1", "--frames", "10", "--json"];
    let [flat, levels] = ["flat", "two-level"]
        .map(|form| rows(&[&scene[..], &["--instances", form, "--rays", "ao", "--epo-samples", "9"]].concat()));
    assert_eq!([flat.len(), levels.len()], [10 * POLICIES.len(); 2]);
    let sum = |rows: &[Value], number: &str| rows.iter().map(|row| row[number].as_f64().unwrap()).sum::<f64>();
    for (row, of_flat) in levels.iter().zip(&flat) {
        for number in ["sah_cost", "update_ms", "ready_ms", "ray_ns", "population_tests_per_ray"] {
            assert!(row[number].as_f64().is_some(), "{number} of {row}");
        }
        assert!(row.get("epo").is_none() && row["triangles"] == of_flat["triangles"], "{row}");
        // 301 copies above, over 100,000 triangles below.
        assert!(row["nodes"].as_u64().unwrap() < 602 && of_flat["nodes"].as_u64().unwrap() > 20_000, "{row}");
    }
    for number in ["update_ms", "ready_ms"] {
        let [of_flat, of_levels] = [&flat, &levels].map(|rows| sum(rows, number));
        assert!(of_levels * 5.0 < of_flat, "{number}: {of_levels} {of_flat}");
    }
    let last = |policy: &str| levels[9 * POLICIES.len()..].iter().find(|row| row["policy"] == policy).unwrap();
    let [refit, rebuild] = [last("refit"), last("rebuild")];
    // Neighbours have gone opposite ways.
    for number in ["sah_cost", "population_tests_per_ray"] {
        assert!(refit[number].as_f64() > rebuild[number].as_f64(), "{number}: {refit} {rebuild}");
    }
    let verdicts = refit["verdicts"].as_array().unwrap();
    let against = verdicts.iter().find(|verdict| verdict["against"] == "rebuild").unwrap_or_else(|| panic!("{refit}"));
    assert!(against.get("break_even_rays").is_some() || against["break_even_interval"].is_array(), "{against}");
    let (code, _, error) = run(&[&scene[..], &["--instances", "two-level", "--container", "sphere"]].concat());
    assert!(code == 1 && error.contains("copies have boxes, not spheres"), "{code} {error}");
}
