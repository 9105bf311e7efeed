//! `copies`: what the copies of a scene of two levels cost rays, with independent sums.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

fn program(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder).args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn copies(folder: &Path, args: &[&str]) -> (i32, String, String) {
    program(folder, &[&["copies"], args].concat())
}

fn number(row: &Value, name: &str) -> f64 {
    row[name].as_f64().unwrap_or_else(|| panic!("{name} of {row}"))
}

#[test]
fn parts_add_up_to_the_scene_and_to_what_bench_counts() {
    let folder = tempfile::tempdir().unwrap();
    let model = ["builtin:village:40", "--size", "64x64"];
    let files = ["--rays", "all", "--most", "1000", "--json", "--csv", "rows.csv"];
    let (code, out, error) = copies(folder.path(), &[&model[..], &files].concat());
    assert_eq!(code, 0, "{error}");
    let rows: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for population in ["primary", "shadow", "ao", "bounce", "random"] {
        let of = |part: &str| {
            let is_part = |row: &&Value| row["population"] == population && row["part"] == part;
            rows.iter().filter(is_part).collect::<Vec<_>>()
        };
        let ([all], [above]) = (&of("all")[..], &of("above")[..]) else { panic!("{population}") };
        assert!(number(all, "tests_per_ray") > 1.0 && number(all, "share_of_tests") == 1.0, "{all}");
        for part in ["mesh", "copy"] {
            // The cheapest copies are there, too, as all are asked for.
            let sum = |name: &str| of(part).iter().map(|row| number(row, name)).sum::<f64>();
            for name in ["entered_per_ray", "hits_per_ray", "primitive_tests_per_ray"] {
                assert!((sum(name) - number(all, name)).abs() < 1e-9, "{population}, {part}: {name}");
            }
            for name in ["container_tests_per_ray", "tests_per_ray", "share_of_tests"] {
                assert!(
                    (sum(name) + number(above, name) - number(all, name)).abs() < 1e-9,
                    "{population}, {part}: {name}"
                );
            }
        }
        for row in of("copy").into_iter().chain(of("mesh")).filter(|row| !row["wasted_share"].is_null()) {
            let expected = 1.0 - number(row, "hits_per_ray") / number(row, "entered_per_ray");
            assert!((number(row, "wasted_share") - expected).abs() < 1e-9, "{row}");
        }
        let tests: Vec<f64> = of("copy").iter().map(|row| number(row, "tests_per_ray")).collect();
        assert!(tests.is_sorted_by(|a, b| a >= b), "{population}: the dearest first");
        let copies: f64 = of("mesh").iter().map(|row| number(row, "copies")).sum();
        assert_eq!(copies, number(all, "copies"), "{population}");
        // Means over all copies, which are few, each counted once.
        for name in ["mesh_box_ratio", "copy_box_ratio"] {
            let sum: f64 = of("mesh").iter().map(|row| number(row, name) * number(row, "copies")).sum();
            assert!((sum / copies - number(all, name)).abs() < 1e-9, "{population}: {name}");
            assert!(
                above[name].is_null() && of("copy").iter().all(|row| number(row, name) >= 1.0),
                "{population}: {name}"
            );
        }
        assert_eq!(number(all, "measured_copies"), copies, "{population}");
        let is_closer = |row: &&Value| number(row, "copy_box_ratio") <= number(row, "mesh_box_ratio");
        assert!(of("copy").iter().all(is_closer), "boxes around octants lie within the turned box: {population}");
    }
    // A picture of as many pixels traces the very primary rays.
    let args = [
        "bench",
        "--instances",
        "two-level",
        "--repeat",
        "1",
        "--container",
        "box",
        "--traversal",
        "ordered",
        "--json",
    ];
    let (code, out, error) = program(folder.path(), &[&args[..], &model].concat());
    assert_eq!(code, 0, "{error}");
    let bench: Value = serde_json::from_str(out.lines().next().unwrap()).unwrap();
    let all = rows.iter().find(|row| row["population"] == "primary" && row["part"] == "all").unwrap();
    for name in ["container_tests_per_ray", "primitive_tests_per_ray"] {
        assert!((number(&bench, name) - number(all, name)).abs() < 1e-3, "{name}: {bench} {all}");
    }

    let csv = std::fs::read_to_string(folder.path().join("rows.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let head = csv.lines().next().unwrap();
    for name in rows.iter().flat_map(|row| row.as_object().unwrap().keys()) {
        assert!(head.split(',').any(|column| column == name), "{name} is in no column of {head}");
    }
}

#[test]
fn tables_are_printed_for_people() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["builtin:forest:60", "--size", "32x32", "--rays", "primary", "--most", "3"];
    let (code, out, error) = copies(folder.path(), &small);
    assert_eq!(code, 0, "{error}");
    for text in [
        "Copies of forest 60",
        "tree over the copies",
        "mesh 0",
        "The 3 copies with most tests",
        "wasted",
        "turned box",
        "means over all copies",
    ] {
        assert!(out.contains(text), "'{text}' is missing in\n{out}");
    }
    let (code, out, _) = copies(folder.path(), &[&small[..], &["--format", "markdown"]].concat());
    assert!(code == 0 && out.contains("| part | copies |"), "{out}");
    let (code, out, _) = copies(folder.path(), &[&small[..], &["--csv", "-"]].concat());
    assert!(code == 0 && out.lines().count() > 5 && out.starts_with("command,"), "{out}");
}

#[test]
fn forms_of_a_scene_have_the_same_hits_and_their_own_costs() {
    let folder = tempfile::tempdir().unwrap();
    let model = ["builtin:forest:60", "--size", "48x48", "--rays", "all"];
    let files = ["--open", "1,4,2", "--json", "--csv", "rows.csv", "--plot", "open.svg"];
    let (code, out, error) = copies(folder.path(), &[&model[..], &files].concat());
    assert_eq!(code, 0, "{error}");
    let rows: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(rows.len(), 4 * 5);
    for of_population in (0..5).map(|at| rows.iter().skip(at).step_by(5).collect::<Vec<_>>()) {
        let [flat, whole, twice, four] = of_population[..] else { panic!("{of_population:?}") };
        assert_eq!(
            (&flat["form"], &flat["open"], &flat["entered_per_ray"]),
            (&"flat".into(), &Value::Null, &Value::Null)
        );
        // The same rays end at the same triangles.
        for (row, open) in [(flat, 0.0), (whole, 1.0), (twice, 2.0), (four, 4.0)] {
            assert_eq!((&row["rays"], &row["hits"]), (&flat["rays"], &flat["hits"]), "{row}");
            assert_eq!((&row["population"], &row["differing_hits"]), (&flat["population"], &0.into()), "{row}");
            assert_eq!(row["open"].as_f64().unwrap_or(0.0), open, "{row}");
            for name in ["nodes_per_ray", "blocks_per_ray", "lines_64_per_ray", "ready_ms", "traced_bytes"] {
                assert!(number(row, name) > 0.0, "{name} of {row}");
            }
        }
        // The ground is a mesh too.
        assert_eq!(whole["parts"], 61);
        assert!(number(four, "parts") > number(twice, "parts") && number(twice, "parts") > 61.0);
        assert!(number(four, "parts") <= 4.0 * 61.0, "{four}");
        assert!(number(whole, "traced_bytes") < 0.5 * number(flat, "traced_bytes"), "{whole}");
    }
    let csv = std::fs::read_to_string(folder.path().join("rows.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let head = csv.lines().next().unwrap();
    for name in rows.iter().flat_map(|row| row.as_object().unwrap().keys()) {
        assert!(head.split(',').any(|column| column == name), "{name} is in no column of {head}");
    }
    let plot = std::fs::read_to_string(folder.path().join("open.svg")).unwrap();
    assert!(plot.contains("Parts for each copy") && plot.contains("Nodes and blocks a ray"), "{plot}");

    let small = ["builtin:village:20", "--size", "16x16", "--rays", "primary"];
    let (code, out, error) = copies(folder.path(), &[&small[..], &["--open", "1"]].concat());
    assert_eq!(code, 0, "{error}");
    for text in ["two levels", "flat", "All forms have the same hits."] {
        assert!(out.contains(text), "'{text}' is missing in\n{out}");
    }
    // Flat it would not fit, in two levels it does.
    let large =
        ["builtin:forest:3000", "--size", "16x16", "--rays", "primary", "--open", "1", "--memory-limit", "700M"];
    let (code, out, error) = copies(folder.path(), &large);
    assert_eq!(code, 0, "{error}");
    assert!(error.contains("the flat scene is left out") && !out.contains("flat"), "{error}{out}");
}

/// Rows of JSON.
fn rows_of(out: &str) -> Vec<Value> {
    out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn advice_is_measured_by_the_same_rays() {
    let folder = tempfile::tempdir().unwrap();
    let model = ["builtin:village:40", "--size", "40x40", "--rays", "all", "--json"];
    let (code, out, error) = copies(folder.path(), &[&model[..], &["--advice", "--csv", "rows.csv"]].concat());
    assert_eq!(code, 0, "{error}");
    let rows = rows_of(&out);
    let (_, forms, _) = copies(folder.path(), &[&model[..], &["--open", "1"]].concat());
    let forms = rows_of(&forms);
    for population in ["primary", "shadow", "ao", "bounce", "random"] {
        let of = |change: &str| {
            let is_change = |row: &&Value| row["population"] == population && row["change"] == change;
            rows.iter().filter(is_change).collect::<Vec<_>>()
        };
        let [as_it_is] = of("none")[..] else { panic!("{population}") };
        let form = forms.iter().find(|row| row["population"] == population && row["open"] == 1.0).unwrap();
        for name in ["traced_bytes", "rays", "hits", "entered_per_ray", "nodes_per_ray", "blocks_per_ray"] {
            assert_eq!(as_it_is[name], form[name], "{name} of {population}");
        }
        let (splits, merges) = (of("split"), of("merge"));
        assert_eq!(merges.len(), as_it_is["measured_pairs"].as_u64().unwrap() as usize);
        let measured = as_it_is["measured_meshes"].as_u64().unwrap() as usize;
        assert!(measured > 4 && splits.len() == 3 * measured, "{} and {as_it_is}", splits.len());
        let visits = |row: &Value| number(row, "nodes_per_ray") + number(row, "blocks_per_ray");
        for row in splits.iter().chain(&merges) {
            assert!((number(row, "visits_change") - (visits(row) / visits(as_it_is) - 1.0)).abs() < 1e-9, "{row}");
            let bytes = number(row, "traced_bytes") / number(as_it_is, "traced_bytes") - 1.0;
            assert!((number(row, "bytes_change") - bytes).abs() < 1e-9 && bytes != 0.0, "{row}");
            assert_eq!(row["rays"], as_it_is["rays"], "{row}");
        }
        for row in splits {
            assert_eq!((&row["differing_hits"], &row["hits"]), (&0.into(), &as_it_is["hits"]), "{row}");
        }
    }
    let csv = std::fs::read_to_string(folder.path().join("rows.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let head = csv.lines().next().unwrap();
    for name in rows.iter().flat_map(|row| row.as_object().unwrap().keys()) {
        assert!(head.split(',').any(|column| column == name), "{name} is in no column of {head}");
    }
}

/// A mesh of PBRT of small triangles at `corners`.
fn object(name: &str, corners: impl Iterator<Item = [f64; 3]>) -> String {
    let (mut indices, mut points) = (String::new(), String::new());
    for (at, [x, y, z]) in corners.enumerate() {
        indices += &format!("{} {} {} ", 3 * at, 3 * at + 1, 3 * at + 2);
        points += &format!("{x} {y} {z} {} {y} {z} {x} {} {} ", x + 0.2, y + 0.2, z + 0.1);
    }
    format!(
        "ObjectBegin \"{name}\" Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point3 P\" [{points}] ObjectEnd\n"
    )
}

/// Writes a scene with objects and copies of them, after transforms as PBRT has them, and measures advice on it.
fn advice(folder: &Path, objects: &[String], copies_of: &[(String, &str)]) -> (Vec<Value>, String) {
    let copies_of = copies_of
        .iter()
        .map(|(place, name)| format!("AttributeBegin {place} ObjectInstance \"{name}\" AttributeEnd\n"));
    let text = format!("WorldBegin\n{}{}", objects.concat(), copies_of.collect::<String>());
    std::fs::write(folder.join("a.pbrt"), text).unwrap();
    let args = ["a.pbrt", "--advice", "--size", "64x64", "--rays", "random"];
    let [(code, out, error), (_, table, _)] =
        [&["--json"][..], &[]].map(|json| copies(folder, &[&args[..], json].concat()));
    assert_eq!(code, 0, "{error}");
    (rows_of(&out), table)
}

#[test]
fn meshes_that_always_stand_together_are_better_as_one() {
    let folder = tempfile::tempdir().unwrap();
    // Triangles throughout the same cube, by the golden ratio; those of the second mesh are stored turned, at half their size.
    let corner = |at: usize| [0.618, 0.755, 0.57].map(|step| 10.0 * (at as f64 * step).fract());
    let second = |at: usize| {
        let [x, y, z] = corner(at);
        [0.5 * y, -0.5 * x, 0.5 * z]
    };
    let objects =
        [object("a", (0..200).map(corner)), object("b", (200..400).map(second)), object("c", (0..30).map(corner))];
    let mut places = Vec::new();
    for at in 0..24 {
        let place = format!("Translate {} {} {} Rotate {} 1 2 3", at % 5 * 12, at / 5 * 12, at % 3 * 5, at * 20);
        places.push((place.clone(), "a"));
        places.push((format!("{place} Rotate 90 0 0 1 Scale 2 2 2"), "b"));
        places.push((format!("{place} Rotate {} 0 1 0", at * at), "c"));
    }
    let (rows, table) = advice(folder.path(), &objects, &places);
    let merges: Vec<&Value> = rows.iter().filter(|row| row["change"] == "merge").collect();
    let [merge] = merges[..] else { panic!("{table}") };
    let mut pair = [&merge["mesh"], &merge["with_mesh"]].map(|mesh| mesh.as_u64().unwrap());
    pair.sort_unstable();
    assert_eq!((pair, &merge["pairs"]), ([0, 1], &1.into()));
    assert!(
        number(merge, "visits_change") < -0.1
            && number(merge, "entered_per_ray") < 0.7 * number(&rows[0], "entered_per_ray"),
        "{merge}"
    );
    assert!(
        number(merge, "differing_hits") <= 0.001 * number(merge, "rays") && number(merge, "hits") > 1_000.0,
        "{merge}"
    );
    assert!(table.contains("Merging pays for these rays: meshes "), "{table}");
}

#[test]
fn a_long_mesh_askew_is_better_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    // From corner to corner of its box, which is crossed by those of many others.
    let objects = [object("a", (0..256).map(|at| [0.125 * f64::from(at); 3]))];
    let places: Vec<_> = (0..24).map(|at| (format!("Translate {} 0 0", 3 * at), "a")).collect();
    let (rows, table) = advice(folder.path(), &objects, &places);
    let saved: Vec<f64> = rows[1..].iter().map(|row| number(row, "visits_change")).collect();
    let parts: Vec<u64> = rows[1..].iter().map(|row| row["parts"].as_u64().unwrap()).collect();
    assert_eq!(parts, [2, 4, 8], "{table}");
    assert!(saved[2] < -0.2 && saved[2] < saved[1] && saved[1] < saved[0], "{saved:?}");
    assert!(rows.iter().all(|row| row["differing_hits"] == 0 && row["hits"] == rows[0]["hits"]), "{table}");
    assert!(table.contains("Splitting pays for these rays: mesh 0 in 8 parts"), "{table}");
    assert!(table.contains("all rays end at the same distance") && !table.contains("Merging"), "{table}");
}

/// Rows of `compare` of a scene in either form, by their names.
#[test]
fn compare_has_the_other_forms_beside_the_builders() {
    let folder = tempfile::tempdir().unwrap();
    let view = ["builtin:stack:6", "--eye", "0.1,0.9,0.2", "--target", "1,0.8,0.5", "--size", "48x40"];
    let run = |args: &[&str]| -> Vec<Value> {
        let (code, out, error) = program(folder.path(), &[args, &view[..], &["--json"]].concat());
        assert_eq!(code, 0, "{error}");
        out.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .filter(|row: &Value| row.get("builder").is_some())
            .collect()
    };
    let compare = |form: &str| {
        let rows = run(&["compare", "--instances", form, "--repeat", "1"]);
        let named =
            |name: &str| rows.iter().find(|row| row["label"] == name).cloned().unwrap_or_else(|| panic!("{name}"));
        let forms = ["fast, flat", "fast, two levels", "fast, two levels, opened to 2"].map(named);
        assert!(rows.len() > 12 && rows.iter().all(|row| row["hits"] == rows[0]["hits"]), "the same hits");
        forms
    };
    let costs = run(&["copies", "--open", "1,2", "--rays", "primary"]);
    let [of_flat, of_levels] = ["flat", "two-level"].map(compare);
    for forms in [&of_flat, &of_levels] {
        let [flat, levels, opened] = forms;
        for (row, cost) in forms.iter().zip(&costs) {
            assert_eq!((&row["open"], &row["hits"]), (&cost["open"], &cost["hits"]), "{row}");
            assert_eq!(row["entering_rays"], cost["rays"], "all rays enter the scene");
            // The list of parts, which whole copies need not have, takes 8 bytes for each of the seven copies.
            let parts = if cost["open"] == 1.0 { 8.0 * 7.0 } else { 0.0 };
            assert_eq!(number(row, "traced_bytes") + parts, number(cost, "traced_bytes"), "{row}");
            let lines = number(row, "bytes_per_entering_ray") / 64.0;
            assert!((lines - number(cost, "lines_64_per_ray")).abs() < 1e-3, "{lines} and {cost}");
            for name in ["build_ms", "ready_ms", "wide_trace_ms", "mrays_per_s"] {
                assert!(number(row, name) > 0.0, "{name} of {row}");
            }
        }
        assert_ne!(opened["bytes_per_entering_ray"], levels["bytes_per_entering_ray"]);
        // There is no binary tree over parts, and its nodes are shown nowhere.
        for name in ["trace_ms", "tests_per_ray", "sah_cost", "nodes", "tree_hash", "bytes_per_triangle"] {
            assert!(opened.get(name).is_none() && flat.get(name).is_some() && levels.get(name).is_some(), "{name}");
        }
        let stages: Vec<&String> = opened["build_stages_ms"].as_object().unwrap().keys().collect();
        assert_eq!(stages, ["meshes", "parts"]);
        let line = |row: &Value| row["command_line"].as_str().unwrap().to_owned();
        assert!(line(flat).starts_with("bvhscope bench") && line(flat).contains("--instances flat"), "{}", line(flat));
        assert!(line(levels).contains("--instances two-level"), "{}", line(levels));
        assert!(line(opened).starts_with("bvhscope compare") && !line(opened).contains("--preset"), "{}", line(opened));
    }
    // Whichever form is loaded, trees are the same, and so is what rays cost in them.
    for (one, other) in of_flat.iter().zip(&of_levels) {
        for name in ["tree_hash", "tests_per_ray", "bytes_per_entering_ray", "rays", "hits", "triangles"] {
            assert_eq!(one[name], other[name], "{name} of {one}");
        }
    }
}

#[test]
fn the_table_of_compare_says_what_forms_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let compare = |model: &[&str]| {
        let small = ["compare", "--size", "8x8", "--repeat", "1"];
        let (code, out, error) = program(folder.path(), &[&small[..], model].concat());
        assert_eq!(code, 0, "{error}");
        (out, error)
    };
    let (out, error) = compare(&["builtin:stack:6"]);
    for text in ["fast, flat", "fast, two levels, opened to 2", "trees", "Forms of the scene"] {
        assert!(out.contains(text), "'{text}' is missing in\n{out}");
    }
    assert!(!error.contains("left out"), "{error}");
    // Flat it would not fit, in two levels it does.
    let (out, error) = compare(&["builtin:forest:3000", "--memory-limit", "700M"]);
    assert!(error.contains("the flat scene is left out") && !out.contains("fast, flat"), "{error}{out}");
    assert!(out.contains("fast, two levels, opened to 2"), "{out}");
    // No form is measured of a scene without copies.
    let (_, out, _) =
        program(folder.path(), &["compare", "builtin:teapot:2", "--size", "8x8", "--repeat", "1", "--json"]);
    assert!(!out.contains("traced_bytes"), "{out}");
}

#[test]
fn what_has_no_copies_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], code: i32, expected: &str| {
        let (found, _, error) = copies(folder.path(), args);
        assert!(found == code && error.contains(expected), "{args:?}: {found}, {error}");
    };
    refused(&["builtin:teapot:2"], 1, "has no copies of meshes in two levels");
    refused(&["builtin:village", "--instances", "flat"], 1, "has no copies of meshes in two levels");
    refused(&["builtin:village", "--container", "sphere"], 1, "not spheres");
    refused(&["builtin:village", "--open", "0.5"], 2, "a number from 1 to 64");
    refused(&["builtin:village", "--plot", "a.png"], 2, "--open");
    refused(&["builtin:village", "--advice", "--open", "2"], 2, "--open");
    refused(&["builtin:village", "--advice", "--instances", "flat"], 1, "has no copies of meshes in two levels");
    refused(&["builtin:village", "--json", "--csv", "-"], 2, "both write to standard output");
}

#[test]
fn a_scene_of_copies_has_the_triangles_of_the_flat_one_in_all_commands() {
    let folder = tempfile::tempdir().unwrap();
    for line in [
        "info builtin:village:30 --json",
        "render builtin:village:30 --size 16x16 -o a.png --json",
        "ray builtin:village:30 --size 16x16 --pixel 8,8 --json",
        "bench builtin:village:30 --size 16x16 --repeat 1 --json",
    ] {
        let triangles = ["flat", "two-level"].map(|form| {
            let args: Vec<&str> = line.split(' ').chain(["--instances", form]).collect();
            let (code, out, error) = program(folder.path(), &args);
            assert_eq!(code, 0, "{line}: {error}");
            let first: Value = serde_json::Deserializer::from_str(&out).into_iter().next().unwrap().unwrap();
            first["triangles"].as_u64().unwrap()
        });
        assert_eq!(triangles, [38_920; 2], "{line}");
    }
}
