//! Writers of tree files in other languages: the C header, the Python module, the lines of `docs/tree-file.md`, and the small
//! builders in `examples/tree_file/`. Each is compiled or run, and its trees are traced.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::scene::{Instancing, LoadOptions, SceneSource, load};
use bvhscope_engine::geometry::Placement;
use bvhscope_engine::settings::Passes;
use bvhscope_engine::tree::Node;
use bvhscope_engine::tree_file::{Header, Instance, KnownScene, TreeFile, TwoLevelFile, write_tree};
use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, ContainerKind, Preset, Sphere, Triangle, build};
use glam::Vec3;
use serde_json::json;

use crate::support::{Lack, skip};
use crate::tree_check::{checked, compiled, rays, repository, run_tool, triangles_of, write_triangles};

/// The triangles of `every_field.c`.
fn row() -> Vec<Triangle> {
    let at = |x: f32| Triangle { a: Vec3::new(x, 0.0, 0.0), b: Vec3::new(x, 1.0, 0.0), c: Vec3::new(x, 0.0, 1.0) };
    [1.0, 2.0, 11.0].map(at).to_vec()
}

#[test]
fn the_header_writes_every_field_as_c_and_as_cpp() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let source = repository("tests/cli/tree_writers/every_field.c");
    for (compiler, flags) in [("cc", &["-std=c99"][..]), ("c++", &["-std=c++11", "-x", "c++"])] {
        let program = path(compiler);
        let Some(()) = compiled(compiler, flags, &source, &program, &[]) else { continue };
        let [boxes, spheres, refused] = ["boxes.bvh", "spheres.bvh", "refused.bvh"].map(path);
        let mut command = Command::new(&program);
        let printed = run_tool(command.args([&boxes, &spheres, &refused]).current_dir(folder.path())).unwrap();
        let refusals = [
            "arity is not 2 to 32",
            "an array of the nodes is missing",
            "the file cannot be created",
            "the file cannot be given its name; is there a folder of that name?",
        ];
        assert_eq!(printed.lines().collect::<Vec<_>>(), refusals, "{compiler}");

        let TreeFile { header, tree, numbers, .. } = checked(&boxes, &row());
        assert_eq!(header.builder.as_deref(), Some("by \"hand\"\\\n\u{e9}"));
        assert_eq!((header.settings, header.build_ms, header.arity), (Some(json!("none")), Some(12.346), 3));
        let AnyTree::Aabb(tree) = tree else { panic!("boxes were written") };
        assert_eq!(tree.nodes.iter().map(Node::arity).collect::<Vec<_>>(), [2, 2, 0, 0, 0], "empty slots are none");
        assert_eq!(numbers, Some(vec![0, 2, 1, 3, 4]));
        assert_eq!(tree.primitive_indices, [0, 1, 2]);
        let bytes = std::fs::read(&boxes).unwrap();
        assert_eq!(TreeFile::read(&bytes, None, u64::MAX, &CancelToken::new()).unwrap().corners, Some(row()));

        let AnyTree::Sphere(tree) = checked(&spheres, &row()).tree else { panic!("spheres were written") };
        assert_eq!(tree.nodes[0].container, Sphere { center: Vec3::new(6.0, 0.5, 0.5), radius: 6.0 });
        assert_eq!(tree.primitive_indices, [2, 1, 0]);
        let mut left: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.retain(|name| Path::new(name).extension().is_some_and(|extension| extension != "bvh"));
        assert!(left.is_empty(), "{left:?}");
    }
}

/// The lines of C in `docs/tree-file.md`, within a program that has the arrays of a small tree.
#[test]
fn the_documented_lines_of_c_write_a_tree() {
    let document = std::fs::read_to_string(repository("docs/tree-file.md")).unwrap();
    let lines = document.split("```c\n").nth(1).and_then(|rest| rest.split("```").next()).expect("lines of C");
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("write.c");
    let program = format!(
        "#include <stdint.h>\n#include <stdio.h>\nint main(void) {{\n\
         float bounds[18] = {{1, 0, 0, 11, 1, 1, 1, 0, 0, 2, 1, 1, 11, 0, 0, 11, 1, 1}};\n\
         uint32_t children[6] = {{1, 2}}, leaves[6] = {{0, 0, 0, 2, 2, 1}}, order[3] = {{0, 1, 2}};\n\
         uint32_t nodes = 3, indices = 3, triangles = 3;\n{lines}\nreturn 0;\n}}\n"
    );
    std::fs::write(&source, program).unwrap();
    let program = folder.path().join("write");
    let Some(()) = compiled("cc", &["-std=c99"], &source, &program, &[]) else { return };
    run_tool(Command::new(&program).current_dir(folder.path())).unwrap();
    let file = checked(&folder.path().join("mine.bvh"), &row());
    assert_eq!((file.tree.node_count(), file.numbers), (3, None));
}

/// The same of two levels, with two instances of a triangle.
#[test]
fn the_documented_lines_of_c_write_trees_in_two_levels() {
    let document = std::fs::read_to_string(repository("docs/tree-file.md")).unwrap();
    let lines = document.split("```c\n").nth(2).and_then(|rest| rest.split("```").next()).expect("lines of C");
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("write.c");
    let program = format!(
        "#include <stdint.h>\n#include <stdio.h>\nint main(void) {{\n\
         float bounds[24] = {{1, 0, 0, 1, 1, 1, 1, 0, 0, 6, 1, 1, 1, 0, 0, 1, 1, 1, 6, 0, 0, 6, 1, 1}};\n\
         uint32_t children[8] = {{0, 0, 1, 2}}, leaves[8] = {{0, 1, 0, 0, 0, 1, 1, 1}}, order[3] = {{0, 0, 1}};\n\
         uint32_t nodes = 4, indices = 3, triangles = 1, trees = 2, instances = 2;\n\
         uint32_t counts[6] = {{1, 1, 1, 3, 2, 2}}, meshes[2] = {{0, 0}};\n\
         float matrices[24] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0}};\n\
         {lines}\nreturn 0;\n}}\n"
    );
    std::fs::write(&source, program).unwrap();
    let program = folder.path().join("write");
    let Some(()) = compiled("cc", &["-std=c99"], &source, &program, &[]) else { return };
    run_tool(Command::new(&program).current_dir(folder.path())).unwrap();
    let bytes = std::fs::read(folder.path().join("mine.bvh")).unwrap();
    let meshes = [&row()[..1]];
    let instances: Vec<Instance> = [0.0, 5.0]
        .map(|x| Instance { mesh: 0, matrix: [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]] })
        .to_vec();
    let bounds = row()[0].bounds();
    let places: Vec<Placement> =
        instances.iter().map(|one| Placement::new(&one.transform(), &bounds).unwrap()).collect();
    let scene = KnownScene { meshes: meshes.to_vec(), instances: places.iter().map(|place| (0, place)).collect() };
    let file = TwoLevelFile::read(&bytes, Some(&scene), u64::MAX, &CancelToken::new()).unwrap();
    assert_eq!((file.faults, file.instances, file.top.tree.node_count()), (Vec::new(), instances, 3));
}

const MODEL: &str = "builtin:teapot:4";

#[path = "../../../engine/examples/write_tree.rs"]
#[allow(dead_code, reason = "its main function and its mesh are for people")]
mod write_tree_example;

#[test]
fn the_builder_in_rust_writes_a_tree_with_its_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let (path, triangles) = (folder.path().join("mine.bvh"), triangles_of(MODEL));
    write_tree_example::write(&path, &triangles).unwrap();
    let file = TreeFile::read(&std::fs::read(&path).unwrap(), None, u64::MAX, &CancelToken::new()).unwrap();
    assert_eq!(file.corners.as_deref(), Some(&triangles[..]));
    assert_eq!((file.header.arity, file.numbers), (4, None));
    checked(&path, &triangles);
}

#[test]
fn the_builder_in_c_writes_a_tree() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, program, tree] = ["mesh.f32", "median_split", "mine.bvh"].map(|name| folder.path().join(name));
    let triangles = triangles_of(MODEL);
    write_triangles(&triangles, &mesh);
    let source = repository("examples/tree_file/median_split.c");
    let Some(()) = compiled("cc", &["-std=c99"], &source, &program, &[]) else { return };
    run_tool(Command::new(&program).args([&mesh, &tree])).unwrap();
    let file = checked(&tree, &triangles);
    assert_eq!(file.header.builder.as_deref(), Some("median split"));
    assert!(file.tree.node_count() > triangles.len() / 4, "{} nodes", file.tree.node_count());
}

/// Python, where it finds `assets/bvhscope_tree.py`. A module of NumPy's name that cannot be imported hides it if asked.
fn python(folder: &Path, with_numpy: bool) -> Command {
    let hidden = folder.join("hidden");
    std::fs::create_dir_all(&hidden).unwrap();
    std::fs::write(hidden.join("numpy.py"), "raise ImportError('hidden')\n").unwrap();
    let assets = repository("assets");
    let paths = if with_numpy { vec![assets] } else { vec![hidden, assets] };
    let mut command = Command::new("python3");
    command.env("PYTHONPATH", std::env::join_paths(paths).unwrap()).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// False where a test wants NumPy and it is missing, which is recorded as skipped.
fn can_run(folder: &Path, with_numpy: bool) -> bool {
    let script = "try:\n    import numpy\n    print('numpy')\nexcept ImportError:\n    print('none')\n";
    let Some(found) = run_tool(python(folder, with_numpy).args(["-c", script])) else { return false };
    if with_numpy && found.trim() == "none" {
        skip(Lack::Tools, "no NumPy: Debian's package python3-numpy");
        return false;
    }
    assert_eq!(found.trim(), if with_numpy { "numpy" } else { "none" });
    true
}

#[test]
fn the_builder_in_python_writes_a_tree() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, tree] = ["mesh.f32", "mine.bvh"].map(|name| folder.path().join(name));
    let triangles = triangles_of(MODEL);
    write_triangles(&triangles, &mesh);
    for with_numpy in [false, true] {
        if can_run(folder.path(), with_numpy) {
            let script = repository("examples/tree_file/median_split.py");
            run_tool(python(folder.path(), with_numpy).arg(script).args([&mesh, &tree])).unwrap();
            let file = checked(&tree, &triangles);
            assert_eq!(file.header.builder.as_deref(), Some("median split"));
            assert!(file.header.build_ms.is_some_and(|ms| ms > 0.0));
            std::fs::remove_file(&tree).unwrap();
        }
    }
}

/// Opens a file of two levels and fails where rays find anything else than in the flat scene that it holds.
fn checked_levels(path: &Path, triangles: &[Triangle]) {
    let token = CancelToken::new();
    let source = SceneSource::parse(path.as_os_str()).unwrap();
    let scene = |instances: Instancing| {
        let options = LoadOptions { instances, ..LoadOptions::default() };
        Arc::new(load(&source, &options, &token).unwrap())
    };
    let (flat, levels) = (scene(Instancing::Flat), scene(Instancing::Auto));
    assert_eq!((flat.triangles.len(), flat.has_tree), (100 * triangles.len(), false));
    let flat = Accel::build(&flat, &BuildSettings::default(), &token).unwrap();
    let levels = Accel::read(&levels, path, Passes::NONE, &token).unwrap();
    assert_eq!((levels.faults(), levels.builder_name().as_ref()), (&[][..], "median split"));
    let mut hits = 0;
    for ray in rays(&flat.scene.triangles) {
        let expected = flat.wide().closest_hit(&ray);
        let found = levels.levels().unwrap().wide().closest_hit(&ray);
        let found = found.map(|hit| (levels.levels().unwrap().number(&hit), hit.t, hit.u, hit.v));
        assert_eq!(found, expected.map(|hit| (hit.primitive_index, hit.t, hit.u, hit.v)), "{ray:?}");
        hits += usize::from(found.is_some());
    }
    assert!(hits > 40, "only {hits} hits");
}

#[test]
fn the_builders_in_c_and_python_write_trees_in_two_levels() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, program, tree] = ["mesh.f32", "two_levels", "mine.bvh"].map(|name| folder.path().join(name));
    let triangles = triangles_of("builtin:teapot:2");
    write_triangles(&triangles, &mesh);
    if compiled("cc", &["-std=c99"], &repository("examples/tree_file/two_levels.c"), &program, &[]).is_some() {
        run_tool(Command::new(&program).args([&mesh, &tree])).unwrap();
        checked_levels(&tree, &triangles);
    }
    for with_numpy in [false, true] {
        if can_run(folder.path(), with_numpy) {
            let script = repository("examples/tree_file/two_levels.py");
            run_tool(python(folder.path(), with_numpy).arg(script).args([&mesh, &tree])).unwrap();
            checked_levels(&tree, &triangles);
            let before = std::fs::read(&tree).unwrap();
            run_tool(python(folder.path(), with_numpy).args(["-c", COPY_LEVELS]).args([&tree, &tree])).unwrap();
            let [before, after] = [before, std::fs::read(&tree).unwrap()]
                .map(|bytes| TwoLevelFile::read(&bytes, None, u64::MAX, &CancelToken::new()).unwrap());
            assert_eq!(before, TwoLevelFile { ids: None, ..after.clone() });
            assert_eq!(after.ids, Some((0..100).collect()));
        }
    }
}

/// Reads a file of two levels, and writes what it read with a number for each instance.
const COPY_LEVELS: &str = "\
import sys, bvhscope_tree
t = bvhscope_tree.read_two_levels(sys.argv[1])
def parts(tree):
    arity = t.header['arity']
    rows = [list(map(int, row)) for row in zip(*[iter(getattr(tree.children, 'flat', tree.children))] * arity)]
    return dict(bounds=tree.bounds, children=rows, leaves=tree.leaves, indices=tree.indices)
bvhscope_tree.write_two_levels(sys.argv[2], [dict(parts(m), corners=m.corners) for m in t.meshes], parts(t.top), t.instances,
                               t.matrices, ids=range(len(t.instances)), builder=t.header['builder'])
";

/// Reads a file and writes what it read.
const COPY: &str = "\
import sys, bvhscope_tree
t = bvhscope_tree.read(sys.argv[1])
h = t.header
bvhscope_tree.write(sys.argv[2], t.bounds, t.children, t.leaves, t.indices, corners=t.corners, triangles=h['triangles'],
                    container=h['container'], arity=h['arity'], builder=h.get('builder'), settings=h.get('settings'),
                    build_ms=h.get('build_ms'), x_note=h.get('x_note'))
";

/// Trees of this engine, binary and eight-wide, boxes and spheres, through the module and back.
#[test]
fn the_python_module_reads_and_writes_the_same_tree() {
    let folder = tempfile::tempdir().unwrap();
    let [original, copy] = ["original.bvh", "copy.bvh"].map(|name| folder.path().join(name));
    let (triangles, token) = (triangles_of(MODEL), CancelToken::new());
    for with_numpy in [false, true] {
        if !can_run(folder.path(), with_numpy) {
            continue;
        }
        for container in ContainerKind::ALL {
            let bvh = build(&triangles, &BuildSettings::preset(Preset::Hq, container), &token).unwrap();
            for corners in [None, Some(&triangles[..])] {
                let mut header = Header::new(triangles.len());
                header.builder = Some("ours, \u{e9}".to_owned());
                header.settings = Some(json!({"threshold": 12}));
                header.build_ms = Some(1.5);
                header.other.insert("x_note".to_owned(), json!([1, 2]));
                let mut bytes = Vec::new();
                write_tree(bvh.tree(), &header, corners, &mut bytes, &token).unwrap();
                std::fs::write(&original, &bytes).unwrap();
                run_tool(python(folder.path(), with_numpy).args(["-c", COPY]).args([&original, &copy])).unwrap();
                let known = corners.is_none().then_some(&triangles[..]);
                let [before, after] = [&original, &copy]
                    .map(|path| TreeFile::read(&std::fs::read(path).unwrap(), known, u64::MAX, &token).unwrap());
                assert_eq!(before, after);
                assert_eq!(&after.tree, bvh.tree());
                checked(&copy, &triangles);
            }
        }
    }
}

/// Refused arguments, each with its message.
#[test]
fn the_python_module_says_what_does_not_fit() {
    let folder = tempfile::tempdir().unwrap();
    let script = "\
import sys, bvhscope_tree
def attempt(*arrays, **fields):
    try:
        bvhscope_tree.write('x.bvh', *arrays, **fields)
        print('written')
    except ValueError as error:
        print(error)
box = [0, 0, 0, 1, 1, 1]
attempt([box], [[-1, -1]], [[0, 1]], [0], triangles=1)
attempt([box], [[-1, -1]], [[0, 1]], [0])
attempt([box], [[-1, -1]], [[0, 1]], [0], triangles=1, container='cone')
attempt([box], [[-1]], [[0, 1]], [0], triangles=1)
attempt([box[:5]], [[-1, -1]], [[0, 1]], [0], triangles=1)
attempt([box, box], [[-1, -1]], [[0, 1]], [0], triangles=1)
attempt([box], [[-2, -1]], [[0, 1]], [0], triangles=1)
attempt([box], [[-1, -1]], [[0, 1]], [0], triangles=2, corners=[[0] * 9])
try:
    bvhscope_tree.read(sys.argv[1])
except ValueError as error:
    print(error)
";
    let expected = [
        "written",
        "the number of triangles is missing",
        "container is 'cone', neither 'box', 'sphere', 'dop' nor 'oriented'",
        "arity is 1, not 2 to 32",
        "bounds has 5 numbers, not a multiple of 6",
        "bounds has 2 rows, leaves has 1",
        "children",
        "triangles is 2, corners has 1 rows",
        "other.bvh: does not begin with 'bvhscope tree 1'",
    ];
    std::fs::write(folder.path().join("other.bvh"), "solid nothing\n").unwrap();
    for with_numpy in [false, true] {
        if can_run(folder.path(), with_numpy) {
            let mut command = python(folder.path(), with_numpy);
            let printed = run_tool(command.args(["-c", script, "other.bvh"]).current_dir(folder.path())).unwrap();
            assert_eq!(printed.lines().count(), expected.len(), "{printed}");
            for (line, expected) in printed.lines().zip(expected) {
                assert!(line.starts_with(expected), "{line} where {expected} is expected");
            }
        }
    }
}
