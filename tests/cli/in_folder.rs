//! Commands that run in a folder.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the words of `line`.
pub fn run(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bvhscope")).args(line.split_whitespace()).current_dir(folder).output().unwrap()
}

/// Output of a command that succeeds.
pub fn output(folder: &Path, line: &str) -> String {
    let output = run(folder, line);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{line}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

/// That output as JSON.
pub fn json(folder: &Path, line: &str) -> Value {
    serde_json::from_str(&output(folder, line)).unwrap()
}

/// The exit code of a command, and the text that it prints to stderr.
pub fn failure(folder: &Path, line: &str) -> (Option<i32>, String) {
    let output = run(folder, line);
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}
