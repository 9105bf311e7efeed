//! Rows kept in a file, each with the machine, the day and the commit that it was measured with.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use anyhow::Context as _;
use bvhscope::provenance::{date, machine};
use bvhscope_engine::kernel::SimdLevel;
use serde_json::{Value, json};

use crate::newest::{MAX_BYTES, newest};
use crate::packed::pack;

/// Machine, date, commit and flags of this run, which every row has beside its numbers.
pub struct Provenance(Value);

impl Provenance {
    /// Reads them from machine, clock and repository.
    pub fn of_this_run() -> Self {
        let flags: Vec<String> = std::env::args().skip(1).collect();
        Self(json!({
            "date": date(), "machine": machine(), "simd": SimdLevel::of_builds().name(),
            "commit": commit(), "flags": flags.join(" "),
        }))
    }

    /// The row with all of it.
    pub fn with(&self, mut row: Value) -> Value {
        if let (Value::Object(row), Value::Object(own)) = (&mut row, &self.0) {
            row.extend(own.clone());
        }
        row
    }
}

/// Adds rows at the end of a file, packed.
pub fn append(rows: &[Value], path: &Path) -> anyhow::Result<()> {
    let text: String = pack(rows).iter().map(|line| format!("{line}\n")).collect();
    let name = || format!("--append {}", path.display());
    let mut file = OpenOptions::new().create(true).append(true).open(path).with_context(name)?;
    file.write_all(text.as_bytes()).with_context(name)
}

/// Removes the rows of a file that the same machine has measured again with the same flags, and the oldest beyond [`MAX_BYTES`].
pub fn keep_newest(path: &Path) -> anyhow::Result<()> {
    let name = || format!("--append {}", path.display());
    let text = std::fs::read_to_string(path).with_context(name)?;
    let text = newest(&text, MAX_BYTES).with_context(name)?;
    std::fs::write(path, text).with_context(name)
}

/// The commit, with "+" where files differ from it; "unknown" outside of a repository.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=10", "HEAD"]) else { return "unknown".to_owned() };
    // The file that is written here does not count.
    let changed = git(&["status", "--porcelain", "--untracked-files=no", "--", ":!docs/performance.jsonl"]);
    if changed.is_some_and(|changed| !changed.is_empty()) { commit + "+" } else { commit }
}
