//! Ctrl-C and its like: exit code 130, rows that are done are kept, nothing half written stays.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::process::{Running, Signal};

/// Starts the program and interrupts it once it is at work. Exit code and stderr.
fn interrupted(args: &[&str], signal: Signal, cwd: &Path) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bvhscope"));
    command.args(args).current_dir(cwd).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = Running::start(&mut command);
    child.wait_for_handler(signal);
    child.wait_until_it_worked(Duration::from_millis(300));
    assert!(child.is_running(), "{args:?} ended before it could be interrupted");
    child.signal(signal);
    let status = child.wait_for_end();
    let mut error = String::new();
    child.stderr.as_mut().unwrap().read_to_string(&mut error).unwrap();
    (status.code(), error)
}

#[test]
fn interrupting_ends_with_130_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let picture = ["render", "builtin:terrain:40000", "--size", "2000x2000", "--samples", "1000", "-o", "out.png"];
    let tree = ["info", "builtin:terrain:4000000", "--preset", "best", "--json"];
    let wide = ["layouts", "builtin:terrain:400000", "--collapse", "all", "--planes", "all", "--leaves", "all"];
    for (signal, args) in
        [(Signal::INT, &picture[..]), (Signal::TERM, &picture), (Signal::INT, &tree), (Signal::INT, &wide)]
    {
        let (code, error) = interrupted(args, signal, folder.path());
        assert_eq!(code, Some(130), "{signal:?}: {error}");
        assert!(error.contains("interrupted"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
    }
}

/// Starts a sweep of 6,300 points and interrupts it when `wait_for_row` returns. Exit code, and what is still printed after that.
fn interrupted_sweep(extra: &[&str], wait_for_row: impl FnOnce(&mut Running)) -> (Option<i32>, String, String) {
    let epsilons: Vec<String> = (0..50).map(|hundredth| format!("0.{hundredth:02}")).collect();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bvhscope"));
    command
        .arg("sweep")
        .args(["builtin:teapot:2", "--size", "24x16"])
        .args(["--threshold", "2..=64", "--container", "both", "--epsilon", &epsilons.join(",")])
        .args(extra)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = Running::start(&mut command);
    wait_for_row(&mut child);
    child.signal(Signal::INT);
    let (mut out, mut error) = (String::new(), String::new());
    // The rest of either stream is less than a pipe holds, or comes after the interruption.
    child.stdout.as_mut().unwrap().read_to_string(&mut out).unwrap();
    child.stderr.as_mut().unwrap().read_to_string(&mut error).unwrap();
    (child.wait_for_end().code(), out, error)
}

/// Reads the first line and no byte beyond it.
fn first_line(stream: &mut impl Read) -> String {
    let mut line = Vec::new();
    let mut byte = [0];
    while !line.ends_with(b"\n") && stream.read(&mut byte).unwrap() == 1 {
        line.extend(byte);
    }
    String::from_utf8(line).unwrap()
}

#[test]
fn an_interrupted_sweep_keeps_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let (csv, plot) = (folder.path().join("rows.csv"), folder.path().join("rows.svg"));
    let mut first = String::new();
    let files = ["--json", "--csv", csv.to_str().unwrap(), "--plot", plot.to_str().unwrap()];
    let (code, out, error) = interrupted_sweep(&files, |child| first = first_line(child.stdout.as_mut().unwrap()));
    assert_eq!(code, Some(130), "{error}");
    assert!(error.contains("interrupted"), "{error}");
    let out = first + &out;
    let rows: Vec<serde_json::Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(!rows.is_empty() && rows.len() < 6300, "{} rows", rows.len());
    assert_eq!(csv::Reader::from_path(&csv).unwrap().records().map(Result::unwrap).count(), rows.len());
    assert!(std::fs::read_to_string(&plot).unwrap().contains("Build time (ms)"));
}

#[test]
fn an_interrupted_table_is_printed_as_far_as_it_goes() {
    let mut note = String::new();
    let (code, out, error) = interrupted_sweep(&[], |child| note = first_line(child.stderr.as_mut().unwrap()));
    assert_eq!(code, Some(130), "{error}");
    assert!(note.contains("tests per entering ray"), "{note}");
    assert!(out.starts_with("Sweep") && out.lines().count() > 4, "{out}");
}
