#![no_main]

#[path = "../../tests/hostile/mod.rs"]
mod hostile;

use std::sync::LazyLock;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| hostile::mtl(FOLDER.path(), bytes));
