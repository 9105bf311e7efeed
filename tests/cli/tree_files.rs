//! `tree`, and `--tree` of the other commands: trees that are written, read, shown and measured.

use std::path::Path;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::CancelToken;
use bvhscope_engine::settings::Passes;
use bvhscope_engine::tree::ContainerKind;
use serde_json::Value;

use crate::in_folder::{failure, json, output, run};

const MODEL: &str = "builtin:teapot:3";

/// A folder with `MODEL.bvh` in it, the tree of the model with its triangles.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    output(folder.path(), &format!("tree {MODEL} -o mine.bvh --with-triangles"));
    folder
}

/// Header and data of a tree file.
fn parts(file: &Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(file).unwrap();
    let mut lines = bytes.splitn(3, |&byte| byte == b'\n');
    assert_eq!(lines.next(), Some(&b"bvhscope tree 1"[..]));
    (serde_json::from_slice(lines.next().unwrap()).unwrap(), lines.next().unwrap().to_vec())
}

/// Writes a file of these parts.
fn write(file: &Path, header: &Value, data: &[u8]) {
    std::fs::write(file, [format!("bvhscope tree 1\n{header}\n").as_bytes(), data].concat()).unwrap();
}

/// Enlarges the box of node 3 of a tree file to the right by a unit: it then sticks out of its parent.
fn with_a_fault(from: &Path, to: &Path) {
    let (mut header, mut data) = parts(from);
    let at = 3 * 24 + 12;
    let x = f32::from_le_bytes(data[at..at + 4].try_into().unwrap());
    data[at..at + 4].copy_from_slice(&(x + 100.0).to_le_bytes());
    header.as_object_mut().unwrap().remove("build_ms");
    write(to, &header, &data);
}

#[test]
fn a_tree_that_was_written_has_the_same_statistics() {
    let folder = tempfile::tempdir().unwrap();
    for settings in ["--preset hq", "--container sphere", "--builder lbvh --optimize all", "--builder binned-sah"] {
        output(folder.path(), &format!("tree {MODEL} -o t.bvh {settings}"));
        let built = json(folder.path(), &format!("info {MODEL} {settings} --json"));
        let read = json(folder.path(), &format!("info {MODEL} --tree t.bvh --json"));
        for name in ["builder", "container", "sah_cost", "epo", "nodes", "leaves", "max_depth", "mean_leaf_depth"] {
            assert_eq!(read[name], built[name], "{settings}: {name}");
        }
        for name in ["leaf_size", "tree_bytes", "wide_node_bytes", "bytes_per_triangle", "triangles"] {
            assert_eq!(read[name], built[name], "{settings}: {name}");
        }
        assert_eq!((&read["tree"], &read["faults"]), (&"t.bvh".into(), &Value::Array(Vec::new())), "{settings}");
        assert!(built.get("faults").is_none() && read.get("optimize").is_none() && built.get("optimize").is_some());
        assert_eq!(built.get("threshold").is_some(), built["builder"] == "aac", "{settings}");
        let (header, _) = parts(&folder.path().join("t.bvh"));
        let [of_info, of_file] = [&read["build_ms"], &header["build_ms"]].map(|ms| ms.as_f64().unwrap());
        assert!(of_file > 0.0 && (of_info - of_file).abs() < 1e-9, "{settings}: {of_info}, {of_file}");
    }
}

#[test]
fn pictures_through_a_written_tree_are_the_same() {
    let folder = folder();
    let picture = |line: &str| {
        output(folder.path(), &format!("render {line} -o a.png --size 64x48 --samples 2"));
        std::fs::read(folder.path().join("a.png")).unwrap()
    };
    assert_eq!(picture(&format!("{MODEL} --tree mine.bvh")), picture(MODEL));
    // The counted tests are those of the very same tree.
    let heat = picture(&format!("{MODEL} --shading heat"));
    assert_eq!(picture(&format!("{MODEL} --shading heat --tree mine.bvh")), heat);
    // A file with its triangles is a model, and its tree is the one that is taken.
    assert_eq!(picture("mine.bvh --shading heat"), heat);
    assert_ne!(picture("mine.bvh --shading heat --builder lbvh"), heat, "settings ask for another tree");
}

#[test]
fn a_tree_of_a_file_gets_oriented_boxes() {
    let folder = folder();
    let at = folder.path();
    let rows = |line: &str| -> Vec<Value> {
        output(at, line).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let [_, plain, oriented] =
        &rows(&format!("bench {MODEL} --container oriented --tree mine.bvh --size 32x24 --repeat 1 --json"))[..]
    else {
        panic!("the file's tree twice")
    };
    assert_eq!([plain, oriented].map(|row| row["container"].as_str()), [Some("box"), Some("oriented")]);
    assert_eq!((&plain["hits"], &plain["nodes"]), (&oriented["hits"], &oriented["nodes"]));
    let tests = |row: &Value| row["tests_per_ray"].as_f64().unwrap();
    assert!(tests(oriented) < tests(plain), "{oriented}");
    // Written and read again, it is the same tree.
    output(at, &format!("tree {MODEL} --tree mine.bvh --optimize orient -o turned.bvh"));
    assert_eq!(parts(&at.join("turned.bvh")).0["container"], "oriented");
    let [by_pass, by_file] = ["mine.bvh --optimize orient", "turned.bvh"]
        .map(|tree| json(at, &format!("info {MODEL} --tree {tree} --json")));
    for name in ["container", "sah_cost", "nodes"] {
        assert_eq!(by_pass[name], by_file[name], "{name}");
    }
}

#[test]
fn a_tree_is_oriented_without_its_file() {
    let folder = folder();
    let (path, token) = (folder.path().join("mine.bvh"), CancelToken::new());
    let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(3) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
    let plain = Accel::read(&scene, &path, Passes::NONE, &token).unwrap();
    std::fs::remove_file(&path).unwrap();
    let oriented = plain.oriented(&token).unwrap();
    let kinds = [&plain, &oriented].map(|accel| accel.tree.container_kind());
    assert_eq!(kinds, [ContainerKind::Aabb, ContainerKind::Oriented]);
    assert_eq!((&oriented.file, oriented.tree.node_count()), (&plain.file, plain.tree.node_count()));
    assert_eq!(oriented.report.stages.stages[0].1, oriented.report.build_time - plain.report.build_time);
}

#[test]
fn orienting_a_tree_keeps_the_memory_limit() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let model = "builtin:terrain:150000";
    output(at, &format!("tree {model} -o t.bvh"));
    let read = format!("info {model} --tree t.bvh --memory-limit 160MB");
    output(at, &read);
    let (code, error) = failure(at, &format!("{read} --optimize orient"));
    assert_eq!(code, Some(1), "{error}");
    assert!(error.starts_with("bvhscope: t.bvh: the tree would need about "), "{error}");
    assert!(error.ends_with("; take something smaller or raise --memory-limit\n"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

#[test]
fn measuring_commands_take_trees_of_files() {
    let folder = folder();
    let at = folder.path();
    let small = "--size 32x24 --repeat 2 --json";
    let rows = |line: &str| -> Vec<Value> {
        output(at, line).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let [built, read] = &rows(&format!("bench {MODEL} --container box --tree mine.bvh {small}"))[..] else {
        panic!("a row for each tree")
    };
    let (header, data) = parts(&at.join("mine.bvh"));
    assert_eq!((&read["tree"], &read["builder"], built.get("tree")), (&"mine.bvh".into(), &"aac".into(), None));
    for name in ["tests_per_ray", "container_tests_per_ray", "hits", "sah_cost", "epo", "nodes", "container"] {
        assert_eq!(read[name], built[name], "{name}");
    }
    let [of_bench, of_file] = [&read["build_ms"], &header["build_ms"]].map(|ms| ms.as_f64().unwrap());
    assert!((of_bench - of_file).abs() < 1e-9 && read["repeat"] == 2, "{read}");
    let [ready, collapse] = ["ready_ms", "collapse_ms"].map(|name| read[name].as_f64().unwrap());
    assert!(
        (ready - of_file - collapse).abs() < 1e-9,
        "ready once the file's build and the wide tree are done: {read}"
    );
    // Once beside all points of a sweep, and in the first of its shards.
    let of_sweep = |shard: &str| -> Vec<bool> {
        let measured = rows(&format!("sweep {MODEL} --threshold 4,6,8 --tree mine.bvh {shard} {small}"));
        measured.iter().map(|row| row.get("tree").is_some()).collect()
    };
    assert_eq!(of_sweep(""), [false, false, false, true]);
    assert_eq!([of_sweep("--shard 1/2"), of_sweep("--shard 2/2")], [vec![false, false, true], vec![false]]);
    // Trees of one builder are told apart by their files, labels, and where files have one name by the whole paths.
    std::fs::create_dir(at.join("copy")).unwrap();
    std::fs::copy(at.join("mine.bvh"), at.join("copy/mine.bvh")).unwrap();
    let bench = |flags: &str| -> Vec<String> {
        let text = output(at, &format!("sweep {MODEL} --threshold 6 --size 32x24 --repeat 1 {flags}"));
        let names =
            text.lines().filter_map(|line| line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).nth(1));
        names.filter(|name| name.contains("mine") || name.contains("copy")).map(str::to_owned).collect()
    };
    assert_eq!(bench("--tree mine.bvh"), ["mine.bvh (aac)"]);
    assert_eq!(bench("--tree mine.bvh --tree copy/mine.bvh"), ["mine.bvh", "copy/mine.bvh"]);
    assert_eq!(bench("--tree mine.bvh --tree copy/mine.bvh --label my-mine"), ["my-mine", "copy/mine.bvh"]);
    // A row for each file beside the builders; build times that are not known are null, and a dash in the table.
    let mut unknown = header.clone();
    let fields = unknown.as_object_mut().unwrap();
    fields.remove("build_ms");
    fields.insert("builder".to_owned(), "other".into());
    write(&at.join("other.bvh"), &unknown, &data);
    let compared = rows(&format!("compare {MODEL} --tree mine.bvh --tree other.bvh {small}"));
    let read: Vec<&Value> = compared.iter().filter(|row| row.get("tree").is_some()).collect();
    assert_eq!(read.len(), 2);
    assert_eq!((&read[1]["builder"], &read[1]["build_ms"]), (&"other".into(), &Value::Null));
    assert_eq!(read[1].get("ready_ms"), None);
    assert!(compared.len() > 10, "{} rows", compared.len());
    let table = output(at, &format!("compare {MODEL} --tree other.bvh --size 8x8 --repeat 2"));
    let line = table
        .lines()
        .find(|line| line.contains("other.bvh") && line.contains('–'))
        .unwrap_or_else(|| panic!("{table}"));
    assert_eq!(line.matches('–').count(), 5, "{line}: δ, ε, build time, its spread, and ready");
    // `plot` reads the output of `compare`.
    std::fs::write(at.join("rows.jsonl"), output(at, &format!("compare {MODEL} --tree other.bvh {small}"))).unwrap();
    output(at, "plot rows.jsonl -o plot.svg");
    assert!(std::fs::read_to_string(at.join("plot.svg")).unwrap().contains("other"));
}

#[test]
fn a_ray_and_a_difference_go_through_trees_of_files() {
    let folder = folder();
    let at = folder.path();
    let of = |tree: &str| json(at, &format!("ray {MODEL} --pixel 32,24 --size 64x48 --json {tree}"));
    let (mut read, built) = (of("--tree mine.bvh"), of(""));
    assert!(built["events"].as_array().is_some_and(|events| events.len() > 10));
    for name in ["origin", "direction", "hit", "container_tests", "primitive_tests", "visited", "events", "containers"]
    {
        assert!(built.get(name).is_some(), "{name}");
        assert_eq!(read[name], built[name], "{name}");
    }
    output(at, &format!("tree {MODEL} -o sphere.bvh --container sphere"));
    read = of("--tree sphere.bvh");
    assert_eq!((&read["container"], &read["hit"]["triangle"]), (&"sphere".into(), &built["hit"]["triangle"]));
    let found = json(at, &format!("diff {MODEL} --b mine.bvh --size 32x24 --repeat 1 --json"));
    assert_eq!((&found["survived_share"], &found["pixels_same"]), (&1.0.into(), &(32 * 24).into()));
    assert_eq!((&found["b"]["tree"], found["a"].get("tree")), (&"mine.bvh".into(), None));
    let found = json(at, &format!("diff {MODEL} --a sphere.bvh --b mine.bvh --size 32x24 --repeat 1 --json"));
    assert_eq!((&found["a"]["container"], &found["b"]["container"]), (&"sphere".into(), &"box".into()));
}

#[test]
fn faults_are_listed_and_count_as_warnings() {
    let folder = folder();
    let at = folder.path();
    with_a_fault(&at.join("mine.bvh"), &at.join("wrong.bvh"));
    let text = output(at, &format!("info {MODEL} --tree wrong.bvh"));
    let fault = "1 node sticks out of its parent by up to ";
    let line = text.lines().find(|line| line.contains(fault)).unwrap_or_else(|| panic!("{text}"));
    assert!(
        line.ends_with(", first node 3") && text.contains("\nfaults\n") && text.contains("build        –"),
        "{text}"
    );
    let sound = output(at, &format!("info {MODEL} --tree mine.bvh"));
    assert!(sound.contains("\nfaults\n  none\n") && sound.contains("ms, says the file"), "{sound}");
    let found = json(at, &format!("info {MODEL} --tree wrong.bvh --json"));
    assert_eq!(found["faults"][0]["kind"], "node-outside");
    assert_eq!((&found["faults"][0]["count"], &found["faults"][0]["first"]), (&1.into(), &3.into()));
    assert!(found["faults"][0]["excess"].as_f64().is_some_and(|excess| excess > 90.0) && found["build_ms"].is_null());
    let lines = [
        format!("info {MODEL} --tree wrong.bvh --json"),
        format!("render {MODEL} --tree wrong.bvh -o a.png --size 8x8"),
        format!("ray {MODEL} --tree wrong.bvh --pixel 1,1 --json"),
        format!("diff {MODEL} --b wrong.bvh --size 8x8 --repeat 1"),
        format!("bench {MODEL} --container all --tree wrong.bvh --size 8x8 --repeat 1"),
        format!("tree {MODEL} --tree wrong.bvh -o copy.bvh --with-triangles"),
    ];
    for line in lines {
        let output = run(at, &line);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(error.matches(&format!("wrong.bvh: {fault}")).count(), 1, "{line}: {error}");
        assert_eq!(run(at, &format!("{line} --strict")).status.code(), Some(3), "{line}");
    }
    assert_eq!(run(at, &format!("info {MODEL} --tree mine.bvh --strict")).status.code(), Some(0));
    // A copy is what was read.
    assert_eq!(std::fs::read(at.join("copy.bvh")).unwrap(), std::fs::read(at.join("wrong.bvh")).unwrap());
}

#[test]
fn triangles_are_written_in_the_order_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 4 3 1\n").unwrap();
    output(at, "info a.obj --triangles a.f32");
    let [a, b, c, d] = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let expected: Vec<u8> = [a, b, c, a, c, d, d, c, a].concat().into_iter().flat_map(f32::to_le_bytes).collect();
    assert_eq!(std::fs::read(at.join("a.f32")).unwrap(), expected);
}

#[test]
fn nodes_are_written_as_tables_and_as_the_wide_tree() {
    let folder = folder();
    let at = folder.path();
    output(at, &format!("tree {MODEL} -o nodes.csv"));
    let nodes = json(at, &format!("info {MODEL} --json"))["nodes"].as_u64().unwrap();
    let csv = std::fs::read_to_string(at.join("nodes.csv")).unwrap();
    assert_eq!(csv.lines().count() as u64, nodes + 1);
    assert!(csv.starts_with("node,parent,depth,"), "{csv}");
    output(at, "tree mine.bvh -o again.csv");
    assert_eq!(std::fs::read_to_string(at.join("again.csv")).unwrap(), csv, "of the model's own tree");
    output(at, &format!("tree {MODEL} -o nodes.json --wide"));
    let table: Value = serde_json::from_slice(&std::fs::read(at.join("nodes.json")).unwrap()).unwrap();
    let children = |row: &Value| row[4].as_u64().unwrap();
    let most = table["nodes"].as_array().unwrap().iter().map(children).max();
    assert_eq!((most, table["settings"]["wide"].as_bool()), (Some(8), Some(true)));
    output(at, &format!("tree {MODEL} -o wide.bvh --wide"));
    let (header, _) = parts(&at.join("wide.bvh"));
    assert_eq!(
        (&header["arity"], header["nodes"].as_u64()),
        (&8.into(), table["nodes"].as_array().map(|n| n.len() as u64))
    );
}

/// A JSON object whose keys are all different, however deep.
struct DistinctKeys;

impl<'de> serde::Deserialize<'de> for DistinctKeys {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Self)
    }
}

impl<'de> serde::de::Visitor<'de> for DistinctKeys {
    type Value = Self;

    fn expecting(&self, text: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        text.write_str("JSON")
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Self, A::Error> {
        let mut keys = std::collections::BTreeSet::new();
        while let Some((key, Self)) = map.next_entry::<String, Self>()? {
            if let Some(key) = keys.replace(key) {
                return Err(serde::de::Error::custom(format!("the key '{key}' is there twice")));
            }
        }
        Ok(self)
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut items: A) -> Result<Self, A::Error> {
        while items.next_element::<Self>()?.is_some() {}
        Ok(self)
    }

    fn visit_bool<E>(self, _: bool) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_u64<E>(self, _: u64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_i64<E>(self, _: i64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_f64<E>(self, _: f64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_str<E>(self, _: &str) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_unit<E>(self) -> Result<Self, E> {
        Ok(self)
    }
}

#[test]
fn json_has_each_key_once() {
    let folder = folder();
    let at = folder.path();
    output(at, &format!("tree {MODEL} -o wide.bvh --wide"));
    let view = "--size 8x8 --repeat 1 --json";
    for line in [
        format!("info {MODEL} --tree wide.bvh --json --rays primary"),
        format!("render {MODEL} --tree wide.bvh -o a.png --size 8x8 --json"),
        format!("ray {MODEL} --tree wide.bvh --pixel 4,4 --size 8x8 --json"),
        format!("bench {MODEL} --tree wide.bvh {view}"),
        format!("diff {MODEL} --b wide.bvh {view}"),
        format!("scaling {MODEL} --threads 1 {view}"),
    ] {
        for object in output(at, &line).lines() {
            let read: Result<DistinctKeys, _> = serde_json::from_str(object);
            assert!(read.is_ok(), "{line}: {}", read.err().unwrap());
        }
    }
}

#[test]
fn unusable_files_fail_with_one_line() {
    let folder = folder();
    let at = folder.path();
    let (header, data) = parts(&at.join("mine.bvh"));
    let mut without = header.clone();
    without["arrays"].as_object_mut().unwrap().remove("corners");
    write(&at.join("bare.bvh"), &without, &data);
    std::fs::write(at.join("cut.bvh"), &std::fs::read(at.join("mine.bvh")).unwrap()[..900]).unwrap();
    std::fs::write(at.join("text.bvh"), "Dear user\n").unwrap();
    for (line, parts) in [
        (format!("info {MODEL} --tree missing.bvh"), ["missing.bvh: no such file", "; "]),
        (format!("info {MODEL} --tree text.bvh"), ["text.bvh: does not begin with the line", "docs/tree-file.md"]),
        (format!("info {MODEL} --tree cut.bvh"), ["cut.bvh: array 'bounds' of ", "; the file may be cut off"]),
        ("info builtin:cornell --tree mine.bvh".to_owned(), ["mine.bvh: its number of triangles", "info --triangles"]),
        (
            "info bare.bvh".to_owned(),
            ["bare.bvh: is a tree without its triangles", "; name the mesh, and this file with --tree"],
        ),
        (format!("render {MODEL} --tree cut.bvh -o a.png"), ["cut.bvh: array", "; "]),
        (format!("bench {MODEL} --tree cut.bvh"), ["cut.bvh: array", "; "]),
        (format!("compare {MODEL} --tree text.bvh"), ["text.bvh: does not", "; "]),
        (format!("diff {MODEL} --b cut.bvh"), ["cut.bvh: array", "; "]),
        (format!("tree {MODEL} --tree cut.bvh -o b.bvh"), ["cut.bvh: array", "; "]),
        (format!("tree {MODEL} --tree mine.bvh -o mine.bvh"), ["mine.bvh: is read for this", "; "]),
        (format!("info {MODEL} --tree mine.bvh --triangles mine.bvh"), ["mine.bvh: is read for this", "; "]),
    ] {
        let (code, error) = failure(at, &line);
        assert_eq!((code, error.lines().count()), (Some(1), 1), "{line}: {error}");
        assert!(parts.iter().all(|part| error.contains(part)), "{line}: {error}");
    }
    assert!(!at.join("b.bvh").exists() && !at.join("a.png").exists());
}

#[test]
fn flags_that_do_not_go_together_are_named() {
    let folder = folder();
    for (line, flags) in [
        (format!("info {MODEL} --tree mine.bvh --builder lbvh"), ["--tree", "--builder"]),
        (format!("render {MODEL} -o a.png --tree mine.bvh --preset hq"), ["--tree", "--preset"]),
        (format!("ray {MODEL} --pixel 1,1 --tree mine.bvh --container box"), ["--tree", "--container"]),
        (format!("tree {MODEL} -o a.bvh --tree mine.bvh --optimize all"), ["--tree", "--optimize"]),
        (format!("bench {MODEL} builtin:cornell --tree mine.bvh"), ["--tree", "2 are named"]),
        (format!("compare {MODEL} builtin:cornell --tree mine.bvh"), ["--tree", "2 are named"]),
        (format!("sweep {MODEL} builtin:cornell --tree mine.bvh"), ["--tree", "2 are named"]),
        (format!("tree {MODEL} -o a.txt"), ["a.txt", ".csv"]),
        (format!("tree {MODEL} -o a.csv --with-triangles"), ["--with-triangles", "a.csv"]),
        (format!("tree {MODEL}"), ["--output", "required"]),
    ] {
        let (code, error) = failure(folder.path(), &line);
        assert_eq!(code, Some(2), "{line}: {error}");
        assert!(flags.iter().all(|flag| error.contains(flag)), "{line}: {error}");
    }
}
