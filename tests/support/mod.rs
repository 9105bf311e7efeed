//! Shared by the test programs: notices of skipped tests, child processes that end with their test, folders of models.

#![allow(dead_code, reason = "each test program uses its part")]

use std::fmt::Display;
use std::io::Write as _;
use std::path::PathBuf;

#[cfg(unix)]
pub mod process;

/// Says on stderr that the current test cannot run here, and why. Unlike what `println!` and `eprintln!` write, the line
/// is shown for tests that pass too.
pub fn skip(reason: impl Display) {
    let thread = std::thread::current();
    // The test's name is the thread's. Nothing is lost where stderr is closed.
    let _ = writeln!(std::io::stderr(), "skipped: {}: {reason}", thread.name().unwrap_or("test"));
}

/// The folder of real models with its list, MANIFEST.md: `BVHSCOPE_MODELS`, else `../shared/models`.
pub fn models() -> Option<PathBuf> {
    let folder = std::env::var_os("BVHSCOPE_MODELS").map_or_else(|| PathBuf::from("../shared/models"), PathBuf::from);
    if folder.join("MANIFEST.md").is_file() {
        return Some(folder);
    }
    skip(format_args!("no models in {}", folder.display()));
    None
}
