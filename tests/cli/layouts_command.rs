//! Layouts of wide trees: `layouts` prints a row for each layout and kind of rays, writes CSV and plots, and refuses what has none.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Exit code, output and stderr of a command with `args` in `folder`.
fn bvhscope(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder).args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Those of `bvhscope layouts`.
fn layouts(folder: &Path, args: &[&str]) -> (i32, String, String) {
    bvhscope(folder, &[&["layouts"], args].concat())
}

fn rows(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const TEAPOT: [&str; 3] = ["builtin:teapot:4", "--size", "48x48"];

#[test]
fn a_row_for_each_layout_and_population_with_exact_hits_and_a_front() {
    let folder = tempfile::tempdir().unwrap();
    let axes = ["--children", "2,8", "--collapse", "all", "--planes", "f32,8", "--leaves", "1,4", "--rays", "all"];
    let files = ["--json", "--csv", "rows.csv", "--plot", "front.svg"];
    let (code, out, error) = layouts(folder.path(), &[&TEAPOT[..], &axes, &files].concat());
    assert_eq!(code, 0, "{error}");
    let rows = rows(&out);
    // The program's own tree and 2 · 4 · 2 · 2 layouts, of each five kinds of rays.
    assert_eq!(rows.len(), 33 * 5);
    let number = |row: &Value, name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"));
    for row in &rows {
        assert_eq!(number(row, "differing_hits"), 0.0, "{row}");
        assert!(number(row, "rays") > 100.0 && number(row, "hits") > 0.0, "{row}");
        let tests = number(row, "container_tests_per_ray") + number(row, "primitive_tests_per_ray");
        assert!((tests - number(row, "tests_per_ray")).abs() < 1e-9 * tests, "{row}");
        assert!((0.2..=1.0).contains(&number(row, "fullness")), "{row}");
        assert!(number(row, "triangles_per_leaf") <= number(row, "leaf_limit"), "{row}");
        let lines = number(row, "lines_64_per_ray");
        assert!((0.5 * lines..=lines).contains(&number(row, "lines_128_per_ray")), "{row}");
    }
    let find = |population: &str, children: u64, collapse: &str, planes: &str, leaves: u64| {
        rows.iter()
            .find(|row| {
                row["population"] == population
                    && row["children"] == children
                    && row["collapse"] == collapse
                    && row["planes"] == planes
                    && row["leaf_limit"] == leaves
            })
            .unwrap()
    };
    // Rounded boxes are larger: more tests, in smaller nodes.
    for population in ["primary", "shadow", "ao", "bounce", "random"] {
        let [exact, rounded] = ["f32", "8"].map(|planes| find(population, 8, "optimal", planes, 4));
        assert!(number(rounded, "node_bytes") < 0.5 * number(exact, "node_bytes"));
        assert!(number(rounded, "layout_sah_cost") > number(exact, "layout_sah_cost"));
        let front = rows.iter().filter(|row| row["population"] == population && row["on_front"] == true);
        let mut costs: Vec<[f64; 2]> =
            front.map(|row| ["bytes_per_ray", "tests_per_ray"].map(|name| number(row, name))).collect();
        assert!(costs.len() > 1, "{population}");
        costs.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert!(costs.windows(2).all(|pair| pair[0] == pair[1] || pair[0][1] > pair[1][1]), "{population}: {costs:?}");
    }
    // Random lines read what the memory SAH expects of those that enter the root, as far as so few tell.
    let random = find("random", 8, "optimal", "f32", 4);
    let ratio = number(random, "bytes_per_ray") / number(random, "msah_bytes");
    assert!((0.8..1.2).contains(&ratio), "{ratio}: {random}");

    let csv = std::fs::read_to_string(folder.path().join("rows.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let named = csv.lines().next().unwrap();
    for name in rows[0].as_object().unwrap().keys() {
        assert!(named.split(',').any(|column| column == name), "{name} is in no column of {named}");
    }
    let plot = std::fs::read_to_string(folder.path().join("front.svg")).unwrap();
    assert!(plot.contains("Bytes a ray") && plot.contains("8 children") && plot.contains("own tree"));
    let (code, _, error) = {
        std::fs::write(folder.path().join("rows.jsonl"), &out).unwrap();
        let args = ["plot", "rows.jsonl", "-o", "again.svg"];
        let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder.path()).args(args).output().unwrap();
        (output.status.code().unwrap(), (), String::from_utf8(output.stderr).unwrap())
    };
    assert!(code == 1 && error.contains("a row of layouts, of which there is no plot"), "{error}");
}

#[test]
fn tables_are_printed_for_people() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, error) = layouts(folder.path(), &[&TEAPOT[..], &["--children", "8", "--rays", "ao"]].concat());
    assert_eq!(code, 0, "{error}");
    for text in ["Layouts of teapot 4", "8 engine, f32, leaves 16", "8 optimal, 8, leaves 4", "All hits are those"] {
        assert!(out.contains(text), "'{text}' is missing in\n{out}");
    }
    let (code, out, _) =
        layouts(folder.path(), &[&TEAPOT[..], &["--children", "8", "--rays", "ao", "--format", "markdown"]].concat());
    assert!(code == 0 && out.contains("| layout | nodes |"), "{out}");
}

#[test]
fn rays_and_trees_of_files_are_measured() {
    let folder = tempfile::tempdir().unwrap();
    let program = |args: &[&str]| {
        let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder.path()).args(args).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    program(&["rays", "builtin:teapot:4", "--kind", "ao", "--count", "500", "-o", "ao.rays"]);
    // A tree of up to eight children, which is made binary again.
    program(&["tree", "builtin:teapot:4", "--wide", "-o", "wide.bvh"]);
    let args = ["builtin:teapot:4", "--rays", "ao.rays", "--tree", "wide.bvh", "--collapse", "all", "--json"];
    let (code, out, error) = layouts(folder.path(), &args);
    assert_eq!(code, 0, "{error}");
    let rows = rows(&out);
    assert_eq!(rows.len(), 1 + 4 * 4 * 2);
    for row in rows {
        assert_eq!((row["population"].as_str(), row["differing_hits"].as_u64()), (Some("file"), Some(0)), "{row}");
        assert!(row["tree"] == "wide.bvh" && row.get("threshold").is_none(), "{row}");
    }
}

#[test]
fn a_scene_of_nothing_and_one_triangle_have_layouts() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty.obj"), "v 0 0 0\n").unwrap();
    std::fs::write(folder.path().join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    for (model, triangles) in [("empty.obj", 0), ("one.obj", 1)] {
        let (code, out, error) = layouts(folder.path(), &[model, "--collapse", "all", "--rays", "all", "--json"]);
        if code == 1 {
            // A model without triangles may be refused by its loader.
            assert!(model == "empty.obj" && error.contains("empty.obj"), "{error}");
            continue;
        }
        assert_eq!(code, 0, "{model}: {error}");
        for row in rows(&out) {
            let numbers = ["triangles", "layout_nodes", "triangle_bytes"].map(|name| row[name].as_u64().unwrap());
            assert_eq!(numbers, [triangles, 0, 40 * triangles], "{row}");
            assert_eq!(row["differing_hits"], 0, "{row}");
        }
        let (code, _, error) = layouts(folder.path(), &[model, "--plot", "front.png"]);
        assert_eq!(code, 0, "{model}: {error}");
    }
}

#[test]
fn what_has_no_layouts_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], code: i32, expected: &str| {
        let (found, _, error) = layouts(folder.path(), args);
        assert!(found == code && error.contains(expected), "{args:?}: {found}, {error}");
    };
    refused(&["builtin:teapot:2", "--container", "sphere"], 1, "this is one of spheres");
    refused(&["builtin:village", "--instances", "two-level"], 1, "'layouts' needs the triangles of every copy");
    refused(&["builtin:teapot:2", "--children", "1"], 2, "--children");
    refused(&["builtin:teapot:2", "--children", "17"], 2, "--children");
    refused(&["builtin:teapot:2", "--leaves", "0"], 2, "--leaves");
    refused(&["builtin:teapot:2", "--leaves", "4,33"], 2, "--leaves");
    refused(&["builtin:teapot:2", "--planes", "12"], 2, "one of f32, 16, 8 is expected");
    refused(&["builtin:teapot:2", "--collapse", "best"], 2, "one of greedy, optimal, memory, visits is expected");
    refused(&["builtin:teapot:2", "--json", "--csv", "-"], 2, "both write to standard output");
    refused(&["builtin:teapot:2", "--plot", "front.pdf"], 2, "must end in .png or .svg");
}

#[test]
fn a_heat_map_is_of_the_layout_that_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let render = |args: &[&str]| bvhscope(folder.path(), &[&["render", "--size", "320x200"], args].concat());
    let picture = |name: &str, args: &[&str]| {
        let args = [&["builtin:teapot:2", "--shading", "heat-lines", "-o", name, "--json"], args].concat();
        let (code, out, error) = render(&args);
        assert_eq!(code, 0, "{args:?}: {error}");
        let row: Value = serde_json::from_str(&out).unwrap();
        (row, error, std::fs::read(folder.path().join(name)).unwrap())
    };
    let plain = ["--legend", "off"];
    let (tree, _, of_tree) = picture("tree.png", &plain);
    let (_, _, of_engine) = picture("engine.png", &["--legend", "off", "--layout", "engine"]);
    assert!(of_tree == of_engine, "the program's own tree is a layout of the same counts");
    assert_eq!(tree["layout"], Value::Null);
    let name = "4 optimal, 8, leaves 4";
    let (row, error, of_layout) = picture("layout.png", &["--layout", name]);
    assert_eq!(row["layout"], name);
    assert_eq!(row["tests_per_ray"], tree["tests_per_ray"], "numbers of the tree stay its own");
    assert!(error.contains("Cache lines of each ray in 4 optimal, 8, leaves 4, colours from 0 to"), "{error}");
    let (_, _, short) = picture("short.png", &["--layout", "4,optimal,8,4"]);
    assert!(of_layout == short, "another way to write its name");
    let visits = ["--layout", "8 visits, f32, leaves 4"];
    assert_eq!(picture("visits.png", &visits).0["layout"], visits[1]);

    let refused = |args: &[&str], code: i32, expected: &str| {
        let (found, _, error) = render(&[args, &["-o", "refused.png"]].concat());
        assert!(found == code && error.contains(expected), "{args:?}: {found}, {error}");
    };
    let heat = ["--shading", "heat", "--layout", "engine"];
    refused(&[&["builtin:teapot:2"][..], &["--layout", "engine"]].concat(), 2, "--shading lit has nothing of a layout");
    refused(&["builtin:teapot:2", "--layout", "8 best, f32, leaves 4"], 2, "engine or a layout is expected");
    refused(&[&["builtin:teapot:2", "--container", "sphere"][..], &heat].concat(), 1, "this is one of spheres");
    refused(
        &[&["builtin:village", "--instances", "two-level"][..], &heat].concat(),
        1,
        "load it with --instances flat",
    );
}

#[test]
fn layouts_that_memory_does_not_suffice_for_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let errors: Vec<String> = (50..250)
        .step_by(8)
        .map(|megabytes| {
            let limit = format!("{megabytes}MB");
            let args = [
                "builtin:terrain:100000",
                "--children",
                "16",
                "--rays",
                "random",
                "--size",
                "32x32",
                "--memory-limit",
                &limit,
            ];
            let (code, _, error) = layouts(folder.path(), &args);
            assert!(code == 0 || code == 1 && error.contains("limit"), "{limit}: {code}, {error}");
            error
        })
        .collect();
    // First not even the model fits, at last all does.
    assert!(errors.iter().any(|error| error.contains("the layouts")), "{errors:?}");
}
