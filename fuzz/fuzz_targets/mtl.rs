#![no_main]

#[path = "../../tests/loading/entry_points.rs"]
mod entry_points;

use std::sync::LazyLock;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry_points::mtl(FOLDER.path(), bytes));
