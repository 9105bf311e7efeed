//! Shared by the test programs: notices of skipped tests, child processes that end with their test, folders of models.

#![allow(dead_code, reason = "each test program uses its part")]

use std::path::PathBuf;

mod skip;

#[cfg(unix)]
pub mod process;

#[allow(unused_imports, reason = "each test program uses its part")]
pub use skip::{Lack, is_allowed, skip};

/// The folder of real models with its list, MANIFEST.md: `BVHSCOPE_MODELS`, else `../shared/models`.
pub fn models() -> Option<PathBuf> {
    let folder = std::env::var_os("BVHSCOPE_MODELS").map_or_else(|| PathBuf::from("../shared/models"), PathBuf::from);
    if folder.join("MANIFEST.md").is_file() {
        return Some(folder);
    }
    skip(Lack::Models, format_args!("no models in {}", folder.display()));
    None
}
