//! Ctrl-C and its like: exit code 130, rows that are done are kept, nothing half written stays.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Far beyond what a loaded machine needs; a hang shows.
const PATIENCE: Duration = Duration::from_secs(600);

/// Starts the program, waits a little, interrupts it.
fn interrupted(args: &[&str], signal: &str, cwd: &Path) -> (Option<i32>, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_bvhscope"))
        .args(args)
        .current_dir(cwd)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    assert!(child.try_wait().unwrap().is_none(), "{args:?} ended before it could be interrupted");
    assert!(Command::new("kill").arg(signal).arg(child.id().to_string()).status().unwrap().success());
    let give_up = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < give_up, "{args:?} goes on after {signal}");
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn interrupting_ends_with_130_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let picture = ["render", "builtin:terrain:40000", "--size", "2000x2000", "--samples", "1000", "-o", "out.png"];
    let tree = ["info", "builtin:terrain:4000000", "--preset", "best", "--json"];
    for (signal, args) in [("-INT", &picture[..]), ("-TERM", &picture), ("-INT", &tree)] {
        let (code, error) = interrupted(args, signal, folder.path());
        assert_eq!(code, Some(130), "{signal}: {error}");
        assert!(error.contains("interrupted"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
    }
}

/// Starts a sweep of thousands of points, interrupts it when `ready` is told that a row is done, and gives exit code and
/// what was still printed.
fn interrupt(extra: &[&str], ready: impl FnOnce(&mut Child)) -> (Option<i32>, String, String) {
    let epsilons: Vec<String> = (0..50).map(|hundredth| format!("0.{hundredth:02}")).collect();
    let mut child = Command::new(env!("CARGO_BIN_EXE_bvhscope"))
        .arg("sweep")
        .args(["builtin:teapot:2", "--size", "24x16"])
        .args(["--threshold", "2..=64", "--container", "both", "--epsilon", &epsilons.join(",")])
        .args(extra)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    ready(&mut child);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let (mut out, mut error) = (String::new(), String::new());
    // What is left of either is less than a pipe holds, or comes after the interruption.
    child.stdout.as_mut().unwrap().read_to_string(&mut out).unwrap();
    child.stderr.as_mut().unwrap().read_to_string(&mut error).unwrap();
    (child.wait().unwrap().code(), out, error)
}

/// Reads up to the end of the first line, and not a byte more.
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
    let (code, out, error) = interrupt(&files, |child| first = first_line(child.stdout.as_mut().unwrap()));
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
    let (code, out, error) = interrupt(&[], |child| note = first_line(child.stderr.as_mut().unwrap()));
    assert_eq!(code, Some(130), "{error}");
    assert!(note.contains("tests per ray"), "{note}");
    assert!(out.starts_with("Sweep") && out.lines().count() > 4, "{out}");
}
