//! Trees in two levels: written by `tree`, opened as a model, taken by `--tree`, compared.

use std::path::Path;

use serde_json::Value;

use crate::in_folder::{self, json, output, run};

const MODEL: &str = "builtin:village:30";

/// The text that a command prints to stderr which fails with exit code 1.
fn failure(folder: &Path, line: &str) -> String {
    let (code, error) = in_folder::failure(folder, line);
    assert_eq!(code, Some(1), "{line}");
    error
}

/// A folder with the trees of the model, with its triangles in `whole.bvh`, without in `trees.bvh`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    output(folder.path(), &format!("tree {MODEL} --instances two-level -o whole.bvh --with-triangles"));
    output(folder.path(), &format!("tree {MODEL} --instances two-level -o trees.bvh"));
    folder
}

#[test]
fn trees_that_were_written_have_the_same_statistics_and_pictures() {
    let folder = folder();
    let built = json(folder.path(), &format!("info {MODEL} --instances two-level --json"));
    let picture = |line: &str| {
        output(folder.path(), &format!("render {line} --shading heat -o a.png --size 64x48 --samples 1"));
        std::fs::read(folder.path().join("a.png")).unwrap()
    };
    let of_built = picture(&format!("{MODEL} --instances two-level"));
    let taken = format!("{MODEL} --instances two-level --tree trees.bvh");
    for line in [&taken, "whole.bvh"] {
        let read = json(folder.path(), &format!("info {line} --json"));
        for name in ["sah_cost", "nodes", "leaves", "max_depth", "triangles", "copies", "meshes", "builder"] {
            assert_eq!(read[name], built[name], "{line}: {name}");
        }
        assert_eq!(read["faults"], Value::Array(Vec::new()), "{line}");
    }
    assert_eq!(picture(&taken), of_built, "the counted tests are those of the very same trees");
    // The camera of a model depends on its up direction alone, which is y in both.
    assert_eq!(picture("whole.bvh"), of_built);
    // Written again, with the trees that were read.
    output(folder.path(), "tree whole.bvh -o again.bvh --with-triangles");
    let [whole, again] = ["whole.bvh", "again.bvh"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(whole == again);
}

#[test]
fn files_of_one_level_and_of_two_are_told_apart() {
    let folder = folder();
    let refused = |line: &str, text: &str| {
        let error = failure(folder.path(), line);
        assert!(error.contains(text) && error.lines().count() == 1, "{line}: {error}");
    };
    refused(&format!("info {MODEL} --instances flat --tree trees.bvh"), "load the model with --instances two-level");
    output(folder.path(), &format!("tree {MODEL} --instances flat -o flat.bvh"));
    let bytes = std::fs::read(folder.path().join("flat.bvh")).unwrap();
    assert!(bytes.starts_with(b"bvhscope tree 1\n"), "older versions read it");
    refused(&format!("info {MODEL} --instances two-level --tree flat.bvh"), "load the model with --instances flat");
    refused("info builtin:village:20 --instances two-level --tree trees.bvh", "that of the model");
    refused("info trees.bvh", "is a tree without its triangles");
    // Flat, a file is a model without a tree.
    let flat = json(folder.path(), "info whole.bvh --instances flat --json");
    let of_model = json(folder.path(), &format!("info {MODEL} --instances flat --json"));
    assert_eq!((&flat["triangles"], &flat["nodes"]), (&of_model["triangles"], &of_model["nodes"]));
}

#[test]
fn two_trees_in_two_levels_are_compared() {
    let folder = folder();
    output(folder.path(), &format!("tree {MODEL} --instances two-level --builder lbvh -o lbvh.bvh"));
    let line = format!("diff {MODEL} --instances two-level --a trees.bvh --b lbvh.bvh --size 64x48 --repeat 1 --json");
    let found = json(folder.path(), &line);
    assert_eq!((&found["a"]["builder"], &found["b"]["builder"]), (&"aac".into(), &"lbvh".into()));
    assert_eq!(found["a"]["hits"], found["b"]["hits"]);
    assert!(found["survived_share"].as_f64().unwrap() < 1.0);
    let same = json(folder.path(), &line.replace("lbvh.bvh", "trees.bvh"));
    assert_eq!((same["survived_share"].as_f64(), same["pixels_more"].as_u64()), (Some(1.0), Some(0)));
}

#[test]
fn wide_trees_of_both_levels_are_written() {
    let folder = folder();
    output(folder.path(), &format!("tree {MODEL} --instances two-level --wide -o wide.bvh"));
    let [binary, wide] = ["trees.bvh", "wide.bvh"]
        .map(|file| json(folder.path(), &format!("info {MODEL} --instances two-level --tree {file} --json")));
    assert_eq!((wide["max_arity"].as_u64(), wide["faults"].as_array().map(Vec::len)), (Some(8), Some(0)));
    assert!(wide["nodes"].as_u64() < binary["nodes"].as_u64());
}

#[test]
fn tables_have_the_nodes_of_all_trees() {
    let folder = folder();
    output(folder.path(), "tree whole.bvh -o nodes.csv");
    output(folder.path(), "tree whole.bvh -o nodes.json");
    let csv = std::fs::read_to_string(folder.path().join("nodes.csv")).unwrap();
    let table: Value = serde_json::from_slice(&std::fs::read(folder.path().join("nodes.json")).unwrap()).unwrap();
    let trees = table["trees"].as_array().unwrap();
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!((names[0], names[1], names.last()), ("mesh", "node", Some(&"items")));
    let columns: Vec<&str> = table["columns"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert_eq!(columns, names[1..names.len() - 1]);
    for tree in trees {
        let mesh = tree["mesh"].as_u64().map_or_else(String::new, |mesh| mesh.to_string());
        let mut items = Vec::new();
        for (number, node) in tree["nodes"].as_array().unwrap().iter().enumerate() {
            let cells: Vec<&str> = lines.next().unwrap().split(',').collect();
            assert_eq!((cells[0], cells[1]), (&mesh[..], &number.to_string()[..]));
            assert_eq!(cells[8].parse::<f64>().unwrap() as f32, node[7].as_f64().unwrap() as f32);
            items.extend(cells.last().unwrap().split_whitespace().map(str::to_owned));
        }
        let indices: Vec<String> = tree["indices"].as_array().unwrap().iter().map(Value::to_string).collect();
        items.sort_unstable();
        let mut sorted = indices;
        sorted.sort_unstable();
        assert_eq!(items, sorted);
    }
    assert_eq!(lines.next(), None);
    let instances = table["instances"].as_array().unwrap();
    assert_eq!(trees[0]["indices"].as_array().unwrap().len(), instances.len());
    assert!(instances.iter().all(|row| row.as_array().unwrap().len() == 13));
}

#[test]
fn faults_of_meshes_are_printed_with_the_mesh() {
    let folder = folder();
    let path = folder.path().join("whole.bvh");
    let mut bytes = std::fs::read(&path).unwrap();
    let data = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(1).unwrap().0 + 1;
    // The upper end along x of node 3 of mesh 0.
    let at = data + 3 * 24 + 12;
    bytes[at..at + 4].copy_from_slice(&1e6_f32.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let found = run(folder.path(), "info whole.bvh");
    assert_eq!(found.status.code(), Some(0));
    let text = String::from_utf8(found.stdout).unwrap();
    assert!(
        text.contains("1 node sticks out of its parent by up to") && text.contains("first node 3 of mesh 0"),
        "{text}"
    );
}
