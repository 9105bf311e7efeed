//! `scaling --predict`: the speed-up on more cores than the machine has.

use std::process::{Command, Output};

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");
const PREDICT: [&str; 7] = ["scaling", "builtin:teapot:4", "--size", "64x48", "--repeat", "2", "--predict"];

fn run(program: &[&str], args: &[&str]) -> Output {
    let all = [program, &[PROGRAM], &PREDICT, args].concat();
    Command::new(all[0]).args(&all[1..]).output().unwrap()
}

/// Standard output of a run that succeeds.
fn output(program: &[&str], args: &[&str]) -> String {
    let output = run(program, args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn numbers(values: &Value, name: &str) -> Vec<f64> {
    values.as_array().unwrap().iter().map(|value| value[name].as_f64().unwrap()).collect()
}

#[test]
fn the_first_row_has_the_curve_with_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (csv, plot) = (file("rows.csv"), file("own.svg"));
    let text = output(&[], &["--json", "--csv", &csv, "--plot", &plot]);
    let rows: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(rows[1..].iter().all(|row| row.get("predicted_scaling").is_none()));
    let prediction = &rows[0]["predicted_scaling"];
    assert_eq!(prediction["runs"], 2);
    for name in ["build", "trace"] {
        let scaling = &prediction[name];
        let curve = |column: &str| numbers(&scaling["curve"], column);
        assert_eq!(curve("cores"), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0], "{name}");
        let (speedups, lower, upper) = (curve("speedup"), curve("lower"), curve("upper"));
        assert_eq!([speedups[0], lower[0], upper[0]], [1.0; 3], "{name}");
        assert!(
            speedups.iter().zip(lower.iter().zip(&upper)).all(|(at, (low, high))| low <= at && at <= high),
            "{name}"
        );
        let [work, span, serial] =
            ["work_ms", "span_ms", "serial_share"].map(|column| scaling[column].as_f64().unwrap());
        assert!(0.0 < span && span <= work * 1.001 && serial * work <= span * 1.001, "{name}: {work} {span} {serial}");
        let stages: f64 = numbers(&scaling["stages"], "work_ms").iter().sum();
        assert!((stages - work).abs() < 1e-6 * work, "{name}");
        // Two threads were measured wherever there are as many.
        assert_eq!(scaling.get("measured_at_two").is_some(), rows.len() > 1, "{name}");
    }
    let stages = prediction["build"]["stages"].as_array().unwrap().iter().map(|stage| stage["stage"].as_str().unwrap());
    let stages: Vec<&str> = stages.collect();
    for stage in ["bounds", "codes", "sort", "tree", "flatten", "wide costs", "wide plan", "wide write"] {
        assert!(stages.contains(&stage), "{stage} is missing in {stages:?}");
    }
    assert!(std::fs::read_to_string(&csv).unwrap().lines().next().unwrap().contains("predicted_scaling"));
    std::fs::write(file("rows.jsonl"), text).unwrap();
    let again = file("again.svg");
    let drawn = Command::new(PROGRAM).args(["plot", &file("rows.jsonl"), "-o", &again]).status().unwrap();
    assert!(drawn.success());
    for picture in [plot, again] {
        let text = std::fs::read_to_string(picture).unwrap();
        assert!(
            text.contains("ready to trace predicted, teapot 4") && text.contains("trace predicted, teapot 4"),
            "{text}"
        );
    }
}

#[test]
fn the_table_says_what_is_measured_and_what_is_predicted() {
    let text = output(&[], &["--container", "sphere"]);
    for part in ["Predicted speed-up of teapot 4, sphere over one core", "at worst", "serial sections", "span"] {
        assert!(text.contains(part), "'{part}' is missing in:\n{text}");
    }
    let two = std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1);
    assert_eq!(text.contains("measured at 2"), two, "{text}");
}

#[test]
fn trees_with_passes_are_refused() {
    let output = run(&[], &["--preset", "best"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && error.contains("--predict: passes"), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn one_core_gives_the_curve_of_work_and_span() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
    let first = allowed.trim().split(['-', ',']).next().unwrap();
    let text = output(&["taskset", "-c", first], &[]);
    assert!(text.contains("this process may use one core"), "{text}");
    assert!(!text.contains("measured at 2"), "{text}");
}
