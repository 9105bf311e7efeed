//! The arrows between modules run one way: reads every `use crate::` (and path) in `src`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// For each module of the crate what it may import.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("geometry", &[]),
    ("cancel", &[]),
    ("budget", &[]),
    ("worker", &["cancel"]),
    ("export", &["cancel"]),
    ("camera", &["geometry"]),
    ("view", &["geometry", "camera"]),
    ("scene", &["geometry", "cancel", "budget"]),
    ("bvh", &["geometry", "cancel", "budget"]),
    ("accel", &["geometry", "cancel", "budget", "scene", "bvh"]),
    ("render", &["geometry", "cancel", "budget", "camera", "scene", "bvh", "accel"]),
    ("overlay", &["geometry", "cancel", "budget", "camera", "scene", "bvh", "accel"]),
    ("lab", &["geometry", "cancel", "budget", "export", "camera", "view", "scene", "bvh", "accel", "render"]),
];

/// What the upper rooms may import: everything below them.
const TOP: &[&str] = &["app", "headless", "cli", "main", "lib", "bin"];

/// Crates that only the window knows.
const WINDOW_CRATES: &[&str] = &["egui", "eframe", "wgpu", "rfd"];

fn source_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the source folder can be read") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            source_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// The module of the crate that a file belongs to: the first part of its path.
fn module_of(relative: &Path) -> String {
    let first = relative.iter().next().expect("a file has a name").to_string_lossy();
    first.trim_end_matches(".rs").to_owned()
}

/// The code of a file without comments and, where `tests` stands alone at its end, without its unit tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Every module named behind `crate::`, also in a braced list.
fn imported_modules(code: &str) -> BTreeSet<String> {
    let mut modules = BTreeSet::new();
    for (at, found) in code.match_indices("crate::") {
        // `$crate::` in a macro and names that merely end in "crate" are not imports of ours.
        if code[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_' || before == '$') {
            continue;
        }
        let rest = &code[at + found.len()..];
        let first_name = |text: &str| -> String {
            text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
        };
        if let Some(list) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut start = true;
            for (offset, c) in list.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => start = true,
                    c if c.is_whitespace() => {}
                    _ if start && depth == 0 => {
                        modules.insert(first_name(&list[offset..]));
                        start = false;
                    }
                    _ => {}
                }
            }
        } else {
            modules.insert(first_name(rest));
        }
    }
    modules
}

/// Each source file with its module and its code.
fn sources() -> Vec<(String, String, String)> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&source, &mut files);
    files.sort();
    files
        .iter()
        .map(|path| {
            let relative = path.strip_prefix(&source).expect("inside the folder");
            let text = std::fs::read_to_string(path).expect("source is UTF-8");
            (relative.display().to_string(), module_of(relative), code(&text))
        })
        .collect()
}

#[test]
fn no_arrow_runs_the_wrong_way() {
    let sources = sources();
    let known: BTreeSet<&str> = sources.iter().map(|(_, module, _)| module.as_str()).collect();
    let mut arrows = 0;
    let mut wrong = Vec::new();
    for (file, module, code) in &sources {
        if TOP.contains(&module.as_str()) {
            continue;
        }
        let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| name == module) else {
            wrong.push(format!("{file}: the module '{module}' has no place in the order: give it one here"));
            continue;
        };
        for import in imported_modules(code) {
            // Macros and the crate's own items are no modules.
            if import == *module || !known.contains(import.as_str()) {
                continue;
            }
            arrows += 1;
            if !allowed.contains(&import.as_str()) {
                wrong.push(format!("{file}: '{module}' must not import '{import}'"));
            }
        }
    }
    assert!(arrows > 20, "only {arrows} imports were found: the reader is broken");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_window_knows_the_toolkit() {
    for (file, module, code) in sources() {
        if TOP.contains(&module.as_str()) || module == "overlay" {
            continue;
        }
        for name in WINDOW_CRATES {
            assert!(!code.contains(&format!("{name}::")), "{file}: '{module}' must not know {name}");
        }
    }
}

#[test]
fn the_reader_understands_every_form_of_import() {
    let text = "use crate::scene::{Scene, load};\nuse crate::{bvh::{Node, Tree}, with_tree,\n    camera};\n\
                fn f() { crate::accel::x() } // crate::render\n$crate::lab::y; mycrate::app::z";
    let modules: Vec<_> = imported_modules(&code(text)).into_iter().collect();
    assert_eq!(modules, ["accel", "bvh", "camera", "scene", "with_tree"]);
}
