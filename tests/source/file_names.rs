//! Test files have names of their own, so that a name alone, as in the output of a failed test, leads to one file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::texts::below;

#[test]
fn no_two_test_files_have_one_name() {
    let mut places: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for (path, _) in ["tests", "engine/tests"].iter().flat_map(|folder| below(Path::new(folder), &["rs"])) {
        places.entry(path.file_name().unwrap().display().to_string()).or_default().push(path);
    }
    assert!(places.len() > 100, "only {} files were read", places.len());
    places.retain(|name, paths| paths.len() > 1 && name != "main.rs" && name != "mod.rs");
    assert!(places.is_empty(), "{places:#?}");
}
