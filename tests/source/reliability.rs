//! Each row of reliability.md names at least one test, and every test that it names exists.

use std::path::Path;

/// The sources that a file in the table may stand for: of a test program or a module; after `engine/`, of the engine's.
fn sources(file: &str) -> impl Iterator<Item = String> {
    let (package, file) = file.strip_prefix("engine/").map_or((".", file), |file| ("engine", file));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(package);
    let places = ["tests", "tests/engine", "src"]
        .map(|folder| [format!("{folder}/{file}.rs"), format!("{folder}/{file}/mod.rs")]);
    places.into_iter().flatten().filter_map(move |place| std::fs::read_to_string(root.join(place)).ok())
}

/// The lint against arithmetic that could wrap or panic is on for all readers of files. The exceptions take
/// finished triangles or polygons or decoded images, and the built-in scenes read nothing.
#[test]
fn the_readers_calculate_without_overflow() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene");
    let (mut on, mut off) = (Vec::new(), Vec::new());
    for entry in ["", "obj", "gltf", "ply", "stl", "pbrt", "recognise", "builtin"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(scene.join(folder)).unwrap())
    {
        let path = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for line in text.lines().filter(|line| line.contains("clippy::arithmetic_side_effects")) {
            let place = (path.strip_prefix(&scene).unwrap().display().to_string(), line.to_owned());
            if line.starts_with("#![warn(") { on.push(place) } else { off.push(place) }
        }
    }
    assert_eq!(on, [("mod.rs".to_owned(), "#![warn(clippy::arithmetic_side_effects)]".to_owned())]);
    // The codecs of meshopt wrap on purpose, and their sums have bounds.
    off.retain(|(file, _)| file != "gltf/meshopt.rs");
    assert!(off.iter().all(|(file, line)| file == "mod.rs" && line.starts_with("#[allow(")), "{off:?}");
}

#[test]
fn every_row_has_tests_that_exist() {
    let table = include_str!("../reliability.md");
    let mut expected = 1;
    let mut missing = Vec::new();
    for row in table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| #")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells[0].parse::<u32>().unwrap(), expected, "{row}");
        expected += 1;
        let names: Vec<&str> = cells[3].split('`').filter(|part| part.contains("::")).collect();
        assert!(!names.is_empty(), "row {} names no test", cells[0]);
        missing.extend(names.into_iter().filter(|name| !is_test(name)).map(|name| format!("row {}: {name}", cells[0])));
    }
    assert!(missing.is_empty(), "these tests do not exist: {missing:#?}");
    assert!(expected > 1, "the table is empty");
}

/// True if `file::name` is a function marked as a test.
fn is_test(name: &str) -> bool {
    let (file, test) = name.split_once("::").unwrap();
    sources(file).any(|text| {
        // Attributes and comments stand between the mark of a test and its name, blank lines do not.
        let function = text.find(&format!("fn {test}("));
        function.is_some_and(|at| text[..at].rsplit("\n\n").next().is_some_and(|head| head.contains("#[test]")))
    })
}
