//! Golden files of the texts that programs and people read: help, `info`, JSON, CSV, tables and differences. Times, and what
//! else depends on the machine, is masked.
//!
//! `UPDATE_GOLDEN=1 cargo test --test cli golden` overwrites them: read the difference before committing.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use bvhscope::lab::Measurement;
use bvhscope::lab::report_table::{difference_table, summary, tables};
use bvhscope::lab::rows::{write_csv, write_json_lines};
use serde_json::Value;

const MODEL: &[&str] = &["builtin:teapot:2", "--threads", "1"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/golden")
}

/// Compares `text` with the golden file `name`, and reports the first line that differs.
fn check(name: &str, text: &str) {
    let path = folder().join(name);
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let (found, expected) = (lines(text), lines(&golden));
    if let Some(at) = (0..found.len().max(expected.len())).find(|&at| found.get(at) != expected.get(at)) {
        panic!("{name}:{}: {:?} instead of {:?}", at + 1, found.get(at), expected.get(at));
    }
}

/// Stdout of a command that succeeds.
fn run(args: &[&str]) -> String {
    let output = Command::cargo_bin("bvhscope").unwrap().args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Whether the value of a JSON name differs from run to run or between machines.
fn is_masked(name: &str) -> bool {
    let of_machine = ["mtriangles_per_s", "output", "simd", "version", "machine", "date", "command_line"];
    name.contains("_ms") || name.contains("mrays_per_s") || of_machine.contains(&name)
}

/// A JSON object with one name a line, sorted, without masked values.
fn listed(value: &Value, name: &str, text: &mut String) {
    match value {
        // Only builds by make know their commit.
        Value::Object(fields) => fields.iter().filter(|(field, _)| *field != "commit").for_each(|(field, value)| {
            let path = if name.is_empty() { field.clone() } else { format!("{name}.{field}") };
            if is_masked(field) {
                text.push_str(&format!("{path}: masked\n"));
            } else {
                listed(value, &path, text);
            }
        }),
        Value::Array(items) if items.iter().any(Value::is_object) => {
            items.iter().enumerate().for_each(|(index, item)| listed(item, &format!("{name}[{index}]"), text));
        }
        _ => text.push_str(&format!("{name}: {value}\n")),
    }
}

fn json_of(args: &[&str]) -> String {
    let mut text = String::new();
    for (index, line) in run(args).lines().enumerate() {
        text.push_str(&format!("# line {}\n", index + 1));
        listed(&serde_json::from_str(line).unwrap(), "", &mut text);
    }
    text
}

#[test]
fn help_is_as_recorded() {
    let commands = [
        "", "render", "bench", "sweep", "scaling", "compare", "animate", "layouts", "copies", "diff", "plot", "merges",
        "info", "ray", "rays", "tree",
    ];
    let mut text = String::new();
    for command in commands {
        let args: Vec<&str> = [command, "--help"].into_iter().filter(|word| !word.is_empty()).collect();
        text.push_str(&format!("$ bvhscope {}\n{}\n", args.join(" "), run(&args)));
    }
    check("help.txt", &text);
}

#[test]
fn commands_print_the_recorded_names_and_counts() {
    let rays = ["--rays", "all"];
    let size = ["--size", "24x16", "--repeat", "1"];
    let passes = ["--optimize", "all", "--container", "box"];
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("x.png");
    let sets: [(&str, Vec<&str>); 6] = [
        ("info", [&["info"][..], MODEL, &["--json"]].concat()),
        ("info of a better tree", [&["info"][..], MODEL, &["--json"], &passes].concat()),
        ("render", [&["render"][..], MODEL, &["--json", "--size", "24x16", "-o", picture.to_str().unwrap()]].concat()),
        ("bench", [&["bench"][..], MODEL, &size, &rays, &["--json"]].concat()),
        ("sweep", [&["sweep"][..], MODEL, &size, &["--threshold", "4..=5", "--json"]].concat()),
        ("diff", [&["diff"][..], MODEL, &size, &["--a", "threshold=4", "--b", "builder=lbvh", "--json"]].concat()),
    ];
    let mut text = String::new();
    for (name, args) in sets {
        text.push_str(&format!("## {name}\n{}", json_of(&args)));
    }
    // The visits of each node are many.
    let short = |line: &str| if line.len() > 400 { format!("{} …", &line[..120]) } else { line.to_owned() };
    let mut text: String = text.lines().map(|line| short(line) + "\n").collect();
    text.push_str(&info_as_text());
    check("commands.txt", &text);
}

/// `text` without the numbers in front of " ms", and without the stages of a build.
fn without_times(text: &str) -> String {
    let mask = |line: &str| {
        let line = line.split_once(" (bounds ").map_or(line, |(start, _)| start);
        let words: Vec<&str> = line.split(' ').collect();
        let is_time = |at: usize| words.get(at + 1).is_some_and(|next| next.trim_end_matches([',', ';']) == "ms");
        (0..words.len()).map(|at| if is_time(at) { "#" } else { words[at] }).collect::<Vec<_>>().join(" ") + "\n"
    };
    text.lines().map(mask).collect()
}

fn info_as_text() -> String {
    let mut text = run(&[&["info"][..], MODEL].concat());
    text += &run(&[&["info"][..], MODEL, &["--preset", "best", "--container", "box", "--rays", "primary"]].concat());
    text += &run(&[&["info"][..], MODEL, &["--builder", "lbvh", "--container", "sphere"]].concat());
    without_times(&text)
}

/// All texts that are made of rows are pure functions of them, so recorded rows give the same text on every machine.
#[test]
fn tables_csv_and_json_of_recorded_rows_are_as_recorded() {
    let recorded = std::fs::read_to_string(folder().join("rows.jsonl")).unwrap();
    let all: Vec<Measurement> = recorded.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let mut text = String::new();
    for command in ["bench", "sweep", "scaling", "compare", "animate", "diff"] {
        let rows: Vec<Measurement> = all.iter().filter(|row| row.command == command).cloned().collect();
        assert!(!rows.is_empty(), "{command}");
        text.push_str(&format!("## {command}\n"));
        rows.iter().for_each(|row| text.push_str(&format!("{}\n", summary(row))));
        match <[Measurement; 2]>::try_from(rows.clone()) {
            Ok(pair) if command == "diff" => text.push_str(&difference_table(&pair).to_string()),
            _ => tables(command, &rows).iter().for_each(|table| text.push_str(&format!("{table}\n"))),
        }
    }
    check("tables.txt", &text);
    let (mut csv, mut json) = (Vec::new(), Vec::new());
    write_csv(&all, &mut csv).unwrap();
    write_json_lines(&all, &mut json).unwrap();
    check("rows.csv", std::str::from_utf8(&csv).unwrap());
    let mut listing = String::new();
    for line in std::str::from_utf8(&json).unwrap().lines() {
        let Value::Object(fields) = serde_json::from_str(line).unwrap() else { panic!("{line}") };
        fields.iter().for_each(|(name, value)| listing.push_str(&format!("{name}: {value}\n")));
    }
    check("rows.txt", &listing);
}
