//! The table of what must not break names tests that exist, one or more in each row, and leaves no row out.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::Path;

/// The file that a name in the table stands for: of this folder, else a module of the library.
fn source(file: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let places = [format!("tests/{file}.rs"), format!("src/{file}.rs"), format!("src/{file}/mod.rs")];
    places.iter().find_map(|place| std::fs::read_to_string(root.join(place)).ok()).unwrap_or_default()
}

/// Counts, offsets and lengths of files: the linter refuses every operation that could wrap or panic, all over the readers. The
/// built-in scenes are the one exception, for no file speaks there.
#[test]
fn the_readers_calculate_without_overflow() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene");
    let (mut on, mut off) = (Vec::new(), Vec::new());
    for entry in ["", "obj", "gltf", "builtin"].iter().flat_map(|folder| std::fs::read_dir(scene.join(folder)).unwrap())
    {
        let path = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for line in text.lines().filter(|line| line.contains("clippy::arithmetic_side_effects")) {
            let place = (path.strip_prefix(&scene).unwrap().display().to_string(), line.to_owned());
            if line.starts_with("#![warn(") { on.push(place) } else { off.push(place) }
        }
    }
    assert_eq!(on, [("mod.rs".to_owned(), "#![warn(clippy::arithmetic_side_effects)]".to_owned())]);
    assert!(off.len() == 1 && off[0].0 == "mod.rs" && off[0].1.starts_with("#[allow("), "{off:?}");
    let text = source("scene");
    let exempted = text.split("#[allow(clippy::arithmetic_side_effects").nth(1).unwrap();
    assert!(exempted.lines().nth(1).unwrap() == "mod builtin;", "{exempted}");
}

#[test]
fn every_row_has_tests_that_exist() {
    let table = include_str!("reliability.md");
    let mut expected = 1;
    for row in table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| #")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells[0].parse::<u32>().unwrap(), expected, "{row}");
        expected += 1;
        let names: Vec<&str> = cells[3].split('`').filter(|part| part.contains("::")).collect();
        assert!(!names.is_empty(), "row {} names no test", cells[0]);
        for name in names {
            let (file, test) = name.split_once("::").unwrap();
            let text = source(file);
            let at = text.find(&format!("fn {test}("));
            // Attributes stand between the mark of a test and its name, blank lines do not.
            let head = at.map(|at| text[..at].rsplit("\n\n").next().unwrap_or_default());
            let is_test = head.is_some_and(|head| head.contains("#[test]"));
            assert!(is_test, "row {}: there is no test {name}", cells[0]);
        }
    }
    assert_eq!(expected, 93);
}
