//! Flags, exit codes and output files of the commands.

use std::path::Path;

use assert_cmd::Command;
use bvhscope::render::Shading;

fn bvhscope() -> Command {
    Command::cargo_bin("bvhscope").unwrap()
}

/// Exit code, stdout and stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = bvhscope().args(args).output().unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

const SMALL: [&str; 3] = ["builtin:teapot:2", "--size", "24x16"];

#[test]
fn every_command_has_help_with_examples_and_the_program_a_version() {
    for command in [
        "render", "bench", "sweep", "scaling", "compare", "animate", "layouts", "copies", "diff", "plot", "merges",
        "info", "ray",
    ] {
        let (code, out, _) = run(&[command, "--help"]);
        assert_eq!(code, 0, "{command}");
        assert!(out.contains("Examples:") && out.contains(&format!("bvhscope {command}")), "{out}");
    }
    let (code, out, _) = run(&["--version"]);
    assert_eq!((code, out.trim()), (0, concat!("bvhscope ", env!("CARGO_PKG_VERSION"))));
    let help = run(&["--help"]).1;
    assert!(help.contains("Exit codes"));
    for shading in Shading::ALL {
        assert!(help.contains(shading.name()), "--help leaves {} out", shading.name());
    }
}

#[test]
fn wrong_flags_name_flag_value_and_range() {
    let cases: [(&[&str], &[&str]); 61] = [
        (&["rendr"], &["'rendr'", "neither a command nor a file", "'render'", "--help"]),
        (&["swep", "builtin:teapot", "--csv", "x.csv"], &["'swep'", "'sweep'"]),
        (&["bench", "--treshold", "3"], &["--treshold", "--threshold"]),
        (&["bench", "--threshold", "1"], &["--threshold", "'1'", "2 to 64"]),
        (&["bench", "--threshold", "65"], &["'65'", "2 to 64"]),
        (&["sweep", "--threshold", "9..=2"], &["--threshold", "9..=2", "SMALLEST..LARGEST"]),
        (&["sweep", "--threshold", "2..1"], &["2..1", "reversed", "SMALLEST..LARGEST"]),
        (&["sweep", "--epsilon", "0.1,0.7"], &["--epsilon", "0 to 0.5"]),
        (&["compare", "--builder", "lbvh"], &["--builder", "compare measures all builders"]),
        (&["sweep", "--shard", "3/2"], &["--shard", "3/2", "I/N"]),
        (&["bench", "--epsilon", "NaN"], &["--epsilon", "NaN", "0 to 0.5"]),
        (&["bench", "--threads", "0"], &["--threads", "'0'", "1 to 1024"]),
        (&["bench", "--threads", "-1"], &["-1"]),
        (&["render", "-o", "x.png", "--threads", "99999"], &["--threads", "'99999'", "1 to 1024"]),
        (&["bench", "--repeat", "0"], &["--repeat", "1 to 1000"]),
        (&["bench", "--size", "0x5"], &["--size", "0x5", "1 to 16384"]),
        (&["bench", "--traversal", "random"], &["--traversal", "random", "ordered, paper"]),
        (&["bench", "--simd", "mmx"], &["--simd", "mmx", "one of"]),
        (&["render", "-o", "x.png", "--simd", "mmx"], &["--simd", "mmx", "one of"]),
        (&["bench", "--container", "cone"], &["--container", "cone", "box, sphere, dop, oriented, both, all"]),
        (&["bench", "--builder", "none"], &["--builder", "none", "aac"]),
        (&["bench", "--preset", "worst"], &["--preset", "worst", "aac-hq", "best"]),
        (&["bench", "--optimize", "collapse,melt"], &["--optimize", "melt", "split, collapse, restructure, reinsert"]),
        (&["bench", "--optimize", "all"], &["'split'", "boxes only", "--container box"]),
        (
            &["info", "--container", "sphere", "--optimize", "reinsert"],
            &["'reinsert'", "boxes only", "Usage: bvhscope info "],
        ),
        (&["info", "--container", "dop", "--optimize", "split"], &["'split'", "boxes only", "for 14-DOPs"]),
        (&["info", "--container", "sphere", "--optimize", "orient"], &["'orient'", "boxes only", "for spheres"]),
        (&["info", "--container", "oriented"], &["--container", "box, sphere, dop"]),
        (
            &["info", "--tree", "a.bvh", "--optimize", "reinsert,orient"],
            &["--optimize reinsert", "keeps its nodes", "'orient'"],
        ),
        (&["bench", "--container", "dops"], &["--container", "box, sphere, dop, oriented, both, all"]),
        (&["--strict"], &["--strict"]),
        (&["--container", "sphere", "--optimize", "reinsert,collapse"], &["'reinsert'", "boxes only"]),
        (&["bench", "--builder", "binned-sah", "--container", "both"], &["binned SAH", "box"]),
        (&["bench", "--plot", "x.jpg"], &["x.jpg", ".png or .svg"]),
        (&["render", "-o", "x.png", "--fov", "0"], &["--fov", "1 to 170"]),
        (&["render", "-o", "x.png", "--depth", "6..4"], &["--depth", "6..4"]),
        (&["render", "-o", "x.jpg"], &["x.jpg", ".png"]),
        (&["render", "-o", "x.png", "builtin:nothing"], &["nothing", "teapot"]),
        (&["render"], &["--output"]),
        (&["bench", "--repeat"], &["--repeat", "value"]),
        (&["bench", "--csv"], &["--csv", "value"]),
        (&["bench", "--camera", "inside"], &["--camera", "inside", "default, outside, front"]),
        (&["bench", "--eye", "1,2"], &["--eye", "1,2", "X,Y,Z"]),
        (&["bench", "--target", "a,b,c"], &["--target", "X,Y,Z"]),
        (&["bench", "--up", "0,0,0"], &["--up", "points nowhere"]),
        (&["bench", "--fov", "180"], &["--fov", "1 to 170"]),
        (&["sweep", "--no-bvh"], &["--no-bvh"]),
        (&["sweep", "--container", "cone"], &["--container", "box, sphere, dop, oriented, both, all"]),
        (&["scaling", "--threads", "0"], &["--threads", "1 to 1024"]),
        (&["scaling", "--builder", "binned-sah", "--container", "both"], &["binned SAH", "box"]),
        (&["compare", "--threshold", "3"], &["--threshold"]),
        (&["render", "-o", "x.png", "--size", "-1x1"], &["--size", "-1x1", "WIDTHxHEIGHT"]),
        (&["render", "-o", "x.png", "--depth", "-1..2"], &["--depth", "-1..2", "A..B"]),
        (&["diff"], &["--b"]),
        (&["diff", "--a", "fast", "--b", "preset=hq"], &["--a", "'fast'", "NAME=VALUE"]),
        (&["diff", "--b", "treshold=7"], &["--b", "did you mean 'threshold'?"]),
        (&["diff", "--b", "epsilon=0.7"], &["--b", "epsilon=0.7", "0 to 0.5"]),
        (&["diff", "--b", "container=sphere optimize=reinsert"], &["'reinsert'", "boxes only"]),
        (&["diff", "--b", "preset=hq", "-o", "x.exr"], &["x.exr", ".png"]),
        (&["plot", "-o", "x.png"], &["FILES"]),
        (&["plot", "rows.jsonl", "-o", "x.gif"], &["x.gif", ".png or .svg"]),
    ];
    for (args, parts) in cases {
        let (code, out, error) = run(args);
        assert_eq!(code, 2, "{args:?}: {error}");
        assert_eq!(out, "", "{args:?}");
        for part in parts {
            assert!(error.contains(part), "{args:?}: '{part}' is missing in: {error}");
        }
        assert!(!error.contains("use '-- "), "{args:?}: no value begins with a dash: {error}");
    }
}

#[test]
fn tables_have_the_format_that_is_asked_for() {
    let bench = |more: &[&str]| {
        run(&[&["bench", "builtin:teapot:1", "--size", "16x16", "--repeat", "1", "--container", "box"], more].concat())
    };
    let (code, markdown, _) = bench(&["--format", "markdown"]);
    assert_eq!((code, markdown.lines().filter(|line| line.contains("---:")).count() > 0), (0, true), "{markdown}");
    let (_, latex, _) = bench(&["--format", "latex"]);
    assert!(latex.contains("\\begin{tabular}{lr") && latex.contains("\\bottomrule"), "{latex}");
    let (_, csv, _) = bench(&["--csv", "-"]);
    assert!(csv.starts_with("command,") && csv.lines().all(|line| line.contains(',')), "{csv}");
    let (code, _, error) = bench(&["--csv", "-", "--json"]);
    assert_eq!((code, error.contains("leave one out")), (2, true), "{error}");
    let (_, table, _) = bench(&[]);
    assert!(!table.contains("sphere"), "columns of a container that is not measured: {table}");
}

#[test]
fn a_missing_model_is_reported_before_others_are_measured() {
    let (code, out, error) = run(&["bench", "builtin:teapot:1", "missing.obj", "--size", "16x16", "--repeat", "1"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(error.contains("missing.obj") && !error.contains("teapot"), "{error}");
}

#[test]
fn unusable_files_fail_with_code_one_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("out.png");
    let missing = folder.path().join("missing.obj");
    let (code, _, error) = run(&["render", missing.to_str().unwrap(), "-o", picture.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(error.contains("missing.obj"), "{error}");
    assert!(!picture.exists());

    let nowhere = folder.path().join("no/out.png");
    let (code, _, error) = run(&["render", "-o", nowhere.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(error.contains("does not exist"), "{error}");

    let (code, _, error) = run(&["plot", missing.to_str().unwrap(), "-o", picture.to_str().unwrap()]);
    assert_eq!((code, error.contains("missing.obj")), (1, true));
    let bad = folder.path().join("bad.jsonl");
    std::fs::write(&bad, "\n{\"command\":\"bench\"}\n").unwrap();
    let (code, _, error) = run(&["plot", bad.to_str().unwrap(), "-o", picture.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(error.contains("bad.jsonl:2"), "{error}");
    assert!(!picture.exists());
}

#[test]
fn one_bad_model_does_not_keep_the_others_from_being_measured() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.obj");
    std::fs::write(&bad, "v 0 0\nf 1 2 3\n").unwrap();
    let bad = bad.to_str().unwrap();
    let (code, out, error) = run(&["bench", bad, SMALL[0], SMALL[1], SMALL[2], "--json", "--repeat", "1"]);
    assert_eq!(code, 1);
    assert_eq!(out.lines().count(), 2);
    assert!(error.contains("bad.obj") && error.contains("1 of 2 models"), "{error}");
}

#[test]
fn render_writes_picture_and_distances() {
    let folder = tempfile::tempdir().unwrap();
    let (picture, depth) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    let (code, out, error) = run(&[
        "render",
        "builtin:teapot:2",
        "-o",
        picture.to_str().unwrap(),
        "--depth-image",
        depth.to_str().unwrap(),
        "--size",
        "48x32",
        "--samples",
        "1",
        "--camera",
        "front",
        "--json",
    ]);
    assert_eq!(code, 0, "{error}");
    let row: serde_json::Value = serde_json::from_str(&out).unwrap();
    let picture = image::open(&picture).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (48, 32));
    let colors: std::collections::HashSet<_> = picture.pixels().collect();
    assert!(colors.len() > 20, "the picture is flat");
    let depth = image::open(&depth).unwrap().to_rgb32f();
    let hits = depth.pixels().filter(|pixel| pixel.0[0].is_finite()).count();
    assert_eq!(Some(hits as u64), row["hits"].as_u64());
    assert!(row["container_tests_per_ray"].as_f64().is_some_and(|tests| tests > 1.0), "{out}");
    assert!(row["primitive_tests_per_ray"].as_f64().is_some_and(|tests| tests > 0.0), "{out}");
    assert!(hits > 100 && depth.pixels().any(|pixel| pixel.0[0] == f32::INFINITY));
}

#[test]
fn render_writes_linear_radiance() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let render = |output: &str, flags: &[&str]| {
        let line = ["render", "builtin:teapot:2", "--size", "48x32", "--samples", "1", "-o", output];
        run(&[&line, flags].concat())
    };
    for (name, flags) in [("a.png", &[][..]), ("a.exr", &[]), ("b.EXR", &["--exposure", "3"])] {
        let (code, _, error) = render(&path(name), flags);
        assert_eq!(code, 0, "{name}: {error}");
    }
    let [shown, linear, exposed] = ["a.png", "a.exr", "b.EXR"].map(|name| image::open(path(name)).unwrap().to_rgb32f());
    assert_eq!(linear, exposed, "the exposure is left to whoever reads the file");
    // In the background the linear values are those that the screen shows; the teapot is darkened by 0.04 for the screen.
    let encode = |x: f32| if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    for (x, y, pixel) in linear.enumerate_pixels() {
        let [linear, shown] = [pixel.0[0], shown.get_pixel(x, y).0[0]];
        let on_teapot = linear > 0.06;
        let expected = encode(if on_teapot { linear - 0.04 } else { linear });
        // Highlights are compressed further, dark places less.
        assert!(
            linear.is_finite() && shown <= expected.max(encode(linear * 0.2)) + 0.02,
            "({x}, {y}): {linear}, {shown}"
        );
        assert!(on_teapot || (shown - expected).abs() < 0.004, "({x}, {y}): {linear}, {shown}");
    }
    // Another program reads the very same values.
    #[cfg(unix)]
    {
        let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/read_exr.py");
        let mut reader = std::process::Command::new("python3");
        if crate::tree_check::run_tool(reader.arg(script).args([path("a.exr"), path("a.f32")])).is_some() {
            let expected: Vec<u8> = linear.as_raw().iter().flat_map(|value| value.to_le_bytes()).collect();
            assert!(std::fs::read(path("a.f32")).unwrap() == expected, "{} bytes expected", expected.len());
        }
    }
    let brightest = linear.pixels().map(|pixel| pixel.0[0]).fold(0.0, f32::max);
    assert!((0.7..3.0).contains(&brightest), "{brightest}");
    for (name, flags, reason) in [
        ("c.exr", &["--overlay", "box"][..], "linear radiance"),
        ("c.exr", &["--shading", "heat"], "stand for numbers"),
        ("c.jpg", &[], "must end in .png, .svg or .exr"),
    ] {
        let (code, _, error) = render(&path(name), flags);
        assert!(code == 2 && error.contains(reason) && !std::path::Path::new(&path(name)).exists(), "{error}");
    }
}

#[test]
fn plots_open_as_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let lines = folder.path().join("rows.jsonl");
    for (command, extra) in [
        ("bench", &["--repeat", "1"][..]),
        ("sweep", &["--threshold", "2..=4", "--repeat", "1"]),
        ("scaling", &["--threads", "2", "--repeat", "1"]),
        ("compare", &["--repeat", "1"]),
        ("animate", &["--repeat", "1", "--frames", "3"]),
    ] {
        let mut args = vec![command];
        args.extend(SMALL);
        if command == "animate" {
            args[1] = "builtin:walker:500";
        }
        args.extend(extra);
        args.push("--json");
        let (code, out, error) = run(&args);
        assert_eq!(code, 0, "{command}: {error}");
        std::fs::write(&lines, out).unwrap();
        for name in ["p.png", "p.svg"] {
            let path = folder.path().join(name);
            let (code, _, error) = run(&["plot", lines.to_str().unwrap(), "-o", path.to_str().unwrap()]);
            assert_eq!(code, 0, "{command}: {error}");
            check_plot(&path, command);
        }
    }
}

#[test]
fn rows_that_nobody_measured_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let [lines, plot] = ["rows.jsonl", "p.svg"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let (_, row, _) = run(&[&["scaling"][..], &SMALL, &["--threads", "1", "--repeat", "1", "--json"]].concat());
    for (field, value) in [("trace_speedup", "1e308"), ("build_ms", "1e-320"), ("trace_ms_spread", "[1.0,-1e31]")] {
        let mut changed: serde_json::Value = serde_json::from_str(&row).unwrap();
        changed[field] = serde_json::from_str(value).unwrap();
        std::fs::write(&lines, format!("{row}{changed}\n")).unwrap();
        let (code, _, error) = run(&["plot", &lines, "-o", &plot]);
        assert_eq!((code, error.lines().count()), (1, 1), "{error}");
        assert!(error.contains(&format!("rows.jsonl:2: '{field}' is ")) && error.contains("1e30"), "{error}");
    }
    std::fs::write(&lines, "{\"command\":\"diff\"}\n").unwrap();
    let (_, _, error) = run(&["plot", &lines, "-o", &plot]);
    assert!(error.contains("a row of diff, of which there is no plot"), "{error}");
}

/// A PNG has ink on white; an SVG has the names of the axes.
fn check_plot(path: &Path, command: &str) {
    if path.extension().is_some_and(|extension| extension == "png") {
        let picture = image::open(path).unwrap().to_rgb8();
        assert!(picture.width() > 1000 && picture.height() > 200);
        let ink = picture.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
        assert!(ink > 2_000 && ink < picture.len() / 6, "{command}: {ink} pixels of ink");
    } else {
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        let labels: &[&str] = match command {
            "scaling" => &["Threads", "Speed-up over one thread", "Parallel efficiency (%)"],
            "animate" => &["Time of the clip (s)", "Update until rays can be traced (ms)", "Tests per ray", "SAH cost"],
            "sweep" => &[
                "Threshold δ (primitives)",
                "Relative to δ = ",
                "Build time (ms)",
                "Trace time, binary tree (ms)",
                "Tests per entering ray",
                "SAH cost",
            ],
            // Costs of a box and a sphere do not compare, and of a single scene there is no other.
            "bench" => &["Build time (ms)", "Trace time, binary tree (ms)", "Tests per entering ray"],
            _ => &["Build time (ms)", "Trace time, binary tree (ms)", "Tests per entering ray", "SAH cost"],
        };
        for label in labels {
            assert!(text.contains(label), "{command}: '{label}' is missing");
        }
    }
}

#[test]
fn tables_are_aligned_and_csv_has_the_json_names() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("rows.csv");
    let mut args = vec!["bench"];
    args.extend(SMALL);
    args.extend(["--repeat", "1", "--no-bvh", "--csv", csv.to_str().unwrap()]);
    let (code, out, error) = run(&args);
    assert_eq!(code, 0, "{error}");
    for part in [
        "Build and trace time",
        "Intersection tests per ray",
        "Build time by stage",
        "the paper's teapot",
        "box:sph",
        "without BVH",
        "B/tri",
    ] {
        assert!(out.contains(part), "'{part}' is missing in:\n{out}");
    }
    let mut reader = csv::Reader::from_path(&csv).unwrap();
    let head = reader.headers().unwrap().clone();
    for name in ["model", "triangles", "build_ms", "tests_per_ray", "sah_cost", "bytes_per_triangle"] {
        assert!(head.iter().any(|column| column == name), "{name}");
    }
    assert_eq!(reader.records().map(Result::unwrap).count(), 3);
}

#[test]
fn strict_turns_warnings_into_code_three() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("a.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n").unwrap();
    let path = model.to_str().unwrap();
    let (code, _, error) = run(&["info", path]);
    assert_eq!(code, 0, "{error}");
    assert!(error.contains("a.obj"), "{error}");
    assert_eq!(run(&["info", path, "--strict"]).0, 3);
    assert_eq!(run(&["info", "builtin:teapot:2", "--strict"]).0, 0);
    // The warning is in the JSON rows of every command.
    let picture = folder.path().join("a.png");
    let render = ["render", path, "--size", "8x8", "-o", picture.to_str().unwrap(), "--json"];
    let bench = ["bench", path, "--size", "8x8", "--repeat", "1", "--json"];
    for args in [&["info", path, "--json"][..], &render, &bench] {
        let (_, out, _) = run(args);
        let row: serde_json::Value = serde_json::from_str(out.lines().next().unwrap()).unwrap();
        let warning = row["warnings"][0].as_str().unwrap();
        assert!(warning.starts_with("1 face with a vertex") && warning.ends_with("(first at line 5)"), "{warning}");
    }
    let (code, _, _) = run(&["bench", path, "--size", "8x8", "--repeat", "1", "--strict"]);
    assert_eq!(code, 3);
}

/// Names of the values that every command reports of a tree.
const TREE_NAMES: [&str; 28] = [
    "builder",
    "container",
    "threshold",
    "epsilon",
    "curve",
    "optimize",
    "threads",
    "build_ms",
    "ready_ms",
    "build_stages_ms",
    "mtriangles_per_s",
    "collapse_ms",
    "sah_cost",
    "traversal_cost",
    "intersection_cost",
    "epo",
    "epo_triangles",
    "nodes",
    "leaves",
    "max_depth",
    "mean_leaf_depth",
    "leaf_size",
    "tree_bytes",
    "triangle_bytes",
    "wide_node_bytes",
    "wide_triangle_bytes",
    "overlay_bytes",
    "bytes_per_triangle",
];

#[test]
fn info_describes_a_scene() {
    let (code, out, error) = run(&["info", "builtin:teapot:2", "--json"]);
    assert_eq!(code, 0, "{error}");
    let info: serde_json::Value = serde_json::from_str(&out).unwrap();
    for name in
        ["triangles", "nodes", "leaves", "max_depth", "sah_cost", "epo", "bytes_per_triangle", "findings", "warnings"]
    {
        assert!(info.get(name).is_some(), "{name}");
    }
    // `render` and the measuring commands report as much of a tree.
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("a.png");
    let render = ["render", "builtin:teapot:2", "--size", "8x8", "-o", picture.to_str().unwrap(), "--json"];
    let bench = ["bench", "builtin:teapot:2", "--container", "box", "--size", "8x8", "--repeat", "1", "--json"];
    for args in [&render[..], &bench] {
        let row = rows(args).remove(0);
        for name in TREE_NAMES {
            assert!(row.get(name).is_some_and(|value| !value.is_null()), "{args:?} lacks {name}");
        }
        // Everything but times is the same in all commands.
        for name in TREE_NAMES.into_iter().filter(|name| !name.ends_with("_ms") && *name != "mtriangles_per_s") {
            let same = |value: &serde_json::Value| value.as_f64().map(|number| number as f32);
            assert_eq!(same(&row[name]), same(&info[name]), "{name}");
        }
    }
    let text = run(&["info", "builtin:teapot:2"]).1;
    assert!(text.contains("SAH cost") && text.contains("findings"), "{text}");
    let text = run(&["info", "builtin:teapot:2", "--optimize", "split,reinsert"]).1;
    assert!(text.contains("split, SAH cost from ") && text.contains(", reinsert to "), "{text}");
}

/// Rows as JSON objects; the command must succeed.
fn rows(args: &[&str]) -> Vec<serde_json::Value> {
    let (code, out, error) = run(args);
    assert_eq!(code, 0, "{args:?}: {error}");
    out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn every_commands_rows_have_the_names_and_agree_on_hits() {
    const NAMES: [&str; 22] = [
        "model",
        "triangles",
        "builder",
        "container",
        "optimize",
        "threads",
        "build_ms",
        "build_stages_ms",
        "trace_ms",
        "rays",
        "hits",
        "binary_mrays_per_s",
        "tests_per_ray",
        "container_tests_per_ray",
        "primitive_tests_per_ray",
        "sah_cost",
        "epo",
        "nodes",
        "leaves",
        "max_depth",
        "bytes_per_triangle",
        "repeat",
    ];
    let model = ["builtin:cornell", "--size", "24x16", "--repeat", "1", "--json"];
    let cases: [(&str, &[&str], usize); 4] = [
        ("bench", &["--no-bvh"], 3),
        ("sweep", &["--threshold", "2..=4", "--container", "both", "--epsilon", "0.1,0.2"], 12),
        ("scaling", &["--threads", "2", "--container", "both"], 4),
        ("compare", &["--container", "both"], 34),
    ];
    for (command, extra, count) in cases {
        let args: Vec<&str> = [command].iter().chain(&model).chain(extra).copied().collect();
        let rows = rows(&args);
        assert_eq!(rows.len(), count, "{command}");
        for row in &rows {
            for name in NAMES {
                assert!(row.get(name).is_some(), "{command}: {name} is missing in {row}");
            }
            for name in ["threshold", "epsilon"] {
                let clusters = row["builder"] == "aac" || row["builder"] == "swift";
                assert_eq!(row.get(name).is_some(), clusters, "{command}: {name} in {row}");
            }
            assert_eq!((&row["hits"], &row["rays"]), (&rows[0]["hits"], &rows[0]["rays"]), "{command}");
            assert_eq!(row.get("speedup").is_some(), command == "scaling", "{command}");
        }
        if command == "bench" {
            assert_eq!(rows[2]["tests_per_ray"].as_f64(), rows[2]["triangles"].as_f64());
        }
    }
}

#[test]
fn shards_cover_every_point_and_are_plotted_together() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |shard: &str| -> Vec<String> {
        let mut args = vec!["sweep"];
        args.extend(SMALL);
        args.extend(["builtin:cornell", "--threshold", "2..=6", "--container", "both", "--repeat", "1", "--json"]);
        args.extend(["--shard", shard]);
        let settled = |row: &serde_json::Value| {
            // Only times may differ between runs.
            ["model", "container", "threshold", "epsilon", "tests_per_ray", "hits", "nodes", "sah_cost"]
                .map(|name| row[name].to_string())
                .join(" ")
        };
        let (code, out, error) = run(&args);
        assert_eq!(code, 0, "{error}");
        std::fs::write(folder.path().join(shard.replace('/', "of")), &out).unwrap();
        out.lines().map(|line| settled(&serde_json::from_str(line).unwrap())).collect()
    };
    let mut whole = sweep("1/1");
    let mut parts: Vec<String> = ["1/3", "2/3", "3/3"].iter().flat_map(|shard| sweep(shard)).collect();
    whole.sort();
    parts.sort();
    assert_eq!((whole.len(), whole), (20, parts));
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let picture = file("all.svg");
    let (code, _, error) = run(&["plot", &file("1of3"), &file("3of3"), &file("2of3"), "-o", &picture]);
    assert_eq!(code, 0, "{error}");
    check_plot(Path::new(&picture), "sweep");
}
