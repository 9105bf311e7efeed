//! The program from outside: flags, exit codes, files.

#![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::path::Path;

use assert_cmd::Command;

fn bvhscope() -> Command {
    Command::cargo_bin("bvhscope").unwrap()
}

/// Runs and gives exit code, stdout, stderr.
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
    for command in ["render", "bench", "sweep", "scaling", "compare", "plot", "info"] {
        let (code, out, _) = run(&[command, "--help"]);
        assert_eq!(code, 0, "{command}");
        assert!(out.contains("Examples:") && out.contains(&format!("bvhscope {command}")), "{out}");
    }
    let (code, out, _) = run(&["--version"]);
    assert_eq!((code, out.trim()), (0, concat!("bvhscope ", env!("CARGO_PKG_VERSION"))));
    assert!(run(&["--help"]).1.contains("Exit codes"));
}

#[test]
fn wrong_flags_name_flag_value_and_range() {
    let cases: [(&[&str], &[&str]); 24] = [
        (&["bench", "--treshold", "3"], &["--treshold", "--threshold"]),
        (&["bench", "--threshold", "1"], &["--threshold", "'1'", "2 to 64"]),
        (&["bench", "--threshold", "65"], &["'65'", "2 to 64"]),
        (&["sweep", "--threshold", "9..=2"], &["--threshold", "9..=2", "SMALLEST..=LARGEST"]),
        (&["sweep", "--epsilon", "0.1,0.7"], &["--epsilon", "0 to 0.5"]),
        (&["sweep", "--shard", "3/2"], &["--shard", "3/2", "I/N"]),
        (&["bench", "--epsilon", "NaN"], &["--epsilon", "NaN", "0 to 0.5"]),
        (&["bench", "--threads", "0"], &["--threads", "'0'", "1 to 1024"]),
        (&["bench", "--threads", "-1"], &["-1"]),
        (&["bench", "--repeat", "0"], &["--repeat", "1 to 1000"]),
        (&["bench", "--size", "0x5"], &["--size", "0x5", "1 to 16384"]),
        (&["bench", "--traversal", "random"], &["--traversal", "random", "ordered, paper"]),
        (&["bench", "--simd", "mmx"], &["--simd", "mmx", "one of"]),
        (&["render", "-o", "x.png", "--simd", "mmx"], &["--simd", "mmx", "one of"]),
        (&["bench", "--container", "cone"], &["--container", "cone", "box, sphere, both"]),
        (&["bench", "--builder", "none"], &["--builder", "none", "aac"]),
        (&["bench", "--preset", "best"], &["--preset", "best", "aac-hq"]),
        (&["bench", "--builder", "binned-sah"], &["binned SAH", "box"]),
        (&["bench", "--plot", "x.jpg"], &["x.jpg", ".png or .svg"]),
        (&["render", "-o", "x.png", "--fov", "0"], &["--fov", "1 to 170"]),
        (&["render", "-o", "x.png", "--depth", "6..4"], &["--depth", "6..4"]),
        (&["render", "-o", "x.jpg"], &["x.jpg", ".png"]),
        (&["render", "-o", "x.png", "builtin:nothing"], &["nothing", "teapot"]),
        (&["render"], &["--output"]),
    ];
    for (args, parts) in cases {
        let (code, out, error) = run(args);
        assert_eq!(code, 2, "{args:?}: {error}");
        assert_eq!(out, "", "{args:?}");
        for part in parts {
            assert!(error.contains(part), "{args:?}: '{part}' is missing in: {error}");
        }
    }
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
    let (code, out, error) = run(&["bench", "no-such.obj", SMALL[0], SMALL[1], SMALL[2], "--json", "--repeat", "1"]);
    assert_eq!(code, 1);
    assert_eq!(out.lines().count(), 2);
    assert!(error.contains("no-such.obj") && error.contains("1 of 2 models"), "{error}");
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
    assert!(hits > 100 && depth.pixels().any(|pixel| pixel.0[0] == f32::INFINITY));
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
    ] {
        let mut args = vec![command];
        args.extend(SMALL);
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

/// A PNG has ink on white; an SVG has the names of the axes.
fn check_plot(path: &Path, command: &str) {
    if path.extension().is_some_and(|extension| extension == "png") {
        let picture = image::open(path).unwrap().to_rgb8();
        assert!(picture.width() > 1000 && picture.height() > 800);
        let ink = picture.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
        assert!(ink > 5_000 && ink < picture.len() / 6, "{command}: {ink} pixels of ink");
    } else {
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        let labels: &[&str] = match command {
            "scaling" => &["Threads", "Speed-up over one thread", "Parallel efficiency (%)"],
            "sweep" => &["Threshold δ (primitives)", "Build time (ms)", "Trace time (ms)", "Tests per ray"],
            _ => &["Build time (ms)", "Trace time (ms)", "Tests per ray"],
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
    for part in
        ["Build and trace time", "Intersection tests per ray", "the paper's teapot", "box:sph", "without BVH", "B/tri"]
    {
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
}

#[test]
fn info_tells_what_is_in_a_scene() {
    let (code, out, error) = run(&["info", "builtin:teapot:2", "--json"]);
    assert_eq!(code, 0, "{error}");
    let info: serde_json::Value = serde_json::from_str(&out).unwrap();
    for name in
        ["triangles", "nodes", "leaves", "max_depth", "sah_cost", "epo", "bytes_per_triangle", "findings", "warnings"]
    {
        assert!(info.get(name).is_some(), "{name}");
    }
    let text = run(&["info", "builtin:teapot:2"]).1;
    assert!(text.contains("SAH cost") && text.contains("findings"), "{text}");
}
