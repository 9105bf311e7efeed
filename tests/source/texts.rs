//! Files of the repository.

use std::path::{Path, PathBuf};

/// The text of each file with one of `extensions` below a folder of the repository, by its path in the repository, in order.
pub fn below(folder: &Path, extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut open, mut found) = (vec![root.join(folder)], Vec::new());
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("the folder can be read") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|own| extensions.iter().any(|extension| own == *extension)) {
                let text = std::fs::read_to_string(&path).expect("texts are UTF-8");
                found.push((path.strip_prefix(root).expect("inside the repository").to_owned(), text));
            }
        }
    }
    found.sort();
    found
}
