//! Trees of other people's builders as tree files: Embree's, and what tinybvh and madmann91/bvh save.

use std::path::{Path, PathBuf};
use std::process::Command;

use bvhscope_engine::{Triangle, with_tree};
use glam::Vec3;

use crate::support::{Lack, skip};
use crate::tree_check::{checked, compiled, repository, run_tool, triangles_of, write_triangles};

/// `embree_build`, linked with the Embree that this machine has.
fn embree_build(folder: &Path) -> Option<PathBuf> {
    let probe = folder.join("probe.c");
    std::fs::write(&probe, "int main(void) { return 0; }\n").unwrap();
    let has = |library: &&str| {
        let mut command = Command::new("cc");
        command.arg(&probe).arg(format!("-l{library}")).arg("-o").arg(folder.join("probe"));
        command.output().is_ok_and(|output| output.status.success())
    };
    let Some(library) = ["embree4", "embree3"].into_iter().find(has) else {
        skip(Lack::Tools, "no Embree: Debian's package libembree-dev");
        return None;
    };
    let program = folder.join("embree_build");
    let source = repository("examples/tree_file/embree_build.c");
    compiled("cc", &["-std=c11"], &source, &program, &[&format!("-l{library}")])?;
    Some(program)
}

/// A teapot, and slanted slivers through it that only splitting separates.
fn slivers() -> Vec<Triangle> {
    let mut triangles = triangles_of("builtin:teapot:3");
    triangles.extend((0..60).map(|i| {
        let a = Vec3::new(-3.0, -3.0 + 0.1 * i as f32, 0.0);
        Triangle { a, b: a + Vec3::new(6.0, 6.0, 3.0), c: a + Vec3::new(6.0, 6.1, 3.0) }
    }));
    triangles
}

#[test]
fn embrees_builder_writes_trees_of_every_quality_and_arity() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = embree_build(folder.path()) else { return };
    let [mesh, tree] = ["mesh.f32", "embree.bvh"].map(|name| folder.path().join(name));
    let triangles = slivers();
    write_triangles(&triangles, &mesh);
    for quality in ["low", "medium", "high"] {
        for arity in [2, 4, 8] {
            let arity_text = arity.to_string();
            run_tool(Command::new(&program).arg(&mesh).args([quality, &arity_text]).arg(&tree)).unwrap();
            let file = checked(&tree, &triangles);
            assert!(file.header.builder.is_some_and(|name| name.starts_with("Embree ")));
            assert!(file.header.build_ms.is_some_and(|ms| ms > 0.0));
            let largest = with_tree!(&file.tree, tree => tree.nodes.iter().map(|node| node.arity()).max());
            assert_eq!(largest, Some(arity), "{quality}");
            let indices = file.tree.primitive_indices().len();
            assert_eq!(indices > triangles.len(), quality == "high", "{quality}, {arity}: {indices} indices");
        }
    }
}

/// Converts a file that another library saved; `None` without Python.
fn converted(format: &str, saved: &Path, tree: &Path) -> Option<Result<(), String>> {
    let mut command = Command::new("python3");
    command
        .arg(repository("assets/convert_tree.py"))
        .arg(format)
        .args([saved, tree])
        .env("PYTHONDONTWRITEBYTECODE", "1");
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            skip(Lack::Tools, format_args!("python3: {error}"));
            return None;
        }
    };
    Some(if output.status.success() { Ok(()) } else { Err(String::from_utf8(output.stderr).unwrap()) })
}

/// The mesh whose trees the libraries saved, in `tests/cli/saved_trees/`: a grid of six by six squares with bumps.
fn grid() -> Vec<Triangle> {
    let corner = |x: u32, y: u32| Vec3::new(x as f32, y as f32, ((7 * x + 5 * y) % 8) as f32 / 4.0);
    let square = |x, y| {
        let (a, c) = (corner(x, y), corner(x + 1, y + 1));
        [Triangle { a, b: corner(x + 1, y), c }, Triangle { a, b: c, c: corner(x, y + 1) }]
    };
    (0..36).flat_map(|i| square(i % 6, i / 6)).collect()
}

const SAVED: [(&str, &str); 4] = [
    ("tinybvh", "tinybvh-1.6.7.bin"),
    ("tinybvh", "tinybvh-1.6.7-hq.bin"),
    ("madmann91", "madmann91-v2-float.bin"),
    ("madmann91", "madmann91-v2-double.bin"),
];

#[test]
fn files_that_tinybvh_and_madmann91_saved_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    let (triangles, tree) = (grid(), folder.path().join("mine.bvh"));
    for (format, name) in SAVED {
        let Some(result) = converted(format, &repository("tests/cli/saved_trees").join(name), &tree) else { return };
        result.unwrap();
        let file = checked(&tree, &triangles);
        assert_eq!(file.header.triangles as usize, triangles.len(), "{name}");
        assert!(file.tree.node_count() > triangles.len() / 4, "{name}: {} nodes", file.tree.node_count());
    }
}

#[test]
fn files_that_no_library_saved_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let [saved, tree] = ["saved.bin", "mine.bvh"].map(|name| folder.path().join(name));
    for (format, name) in SAVED {
        let sound = std::fs::read(repository("tests/cli/saved_trees").join(name)).unwrap();
        // One byte more, the first half, nothing, text, and nodes whose children are the first two.
        let longer = [&sound[..], &[0]].concat();
        let half = sound[..sound.len() / 2].to_vec();
        let mut circles = sound.clone();
        circles[sound.len() / 3..2 * sound.len() / 3].fill(0);
        let text = b"solid x\n".to_vec();
        for (fault, bytes) in
            [("longer", longer), ("half", half), ("nothing", Vec::new()), ("text", text), ("zeros", circles)]
        {
            std::fs::write(&saved, bytes).unwrap();
            let Some(result) = converted(format, &saved, &tree) else { return };
            let message = result.expect_err(fault);
            assert_eq!(message.lines().count(), 1, "{name}, {fault}: {message}");
            assert!(message.contains("saved.bin: "), "{name}, {fault}: {message}");
            assert!(!tree.exists(), "{name}, {fault}");
        }
    }
}
