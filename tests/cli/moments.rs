//! Models that move: moments and films by `render`, and the clips that `info` lists.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Exit code, rows and stderr of `bvhscope` with `args` in `folder`.
fn run(folder: &Path, args: &[&str]) -> (i32, Vec<Value>, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder).args(args).output().unwrap();
    let rows = String::from_utf8(output.stdout).unwrap();
    let rows = rows.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    (output.status.code().unwrap(), rows, String::from_utf8(output.stderr).unwrap())
}

const COMMON: [&str; 7] = ["render", "builtin:walker:2000", "--size", "64x48", "--samples", "1", "--json"];

#[test]
fn a_moment_is_shown_and_stated() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let (code, rows, error) = run(folder.path(), &[&COMMON[..], args].concat());
        assert_eq!((code, rows.len()), (0, 1), "{args:?}: {error}");
        rows[0].clone()
    };
    let still = run(&["-o", "still.png"]);
    assert!(still.get("time_s").is_none() && still.get("clip").is_none());
    let walk = run(&["-o", "walk.png", "--time", "0.25"]);
    assert_eq!((&walk["time_s"], &walk["clip"]), (&0.25.into(), &"walk".into()));
    let jump = run(&["-o", "jump.png", "--time", "0.25", "--clip", "jump"]);
    assert_eq!(jump["clip"], "jump");
    assert_eq!(run(&["-o", "first.png", "--clip", "1"])["time_s"], 0.0);
    let costs = [&still, &walk, &jump].map(|row| row["sah_cost"].clone());
    assert!(costs[0] != costs[1] && costs[1] != costs[2] && costs[0] != costs[2], "{costs:?}");
    let pictures = ["still.png", "walk.png", "jump.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    // The command line of a row makes it again.
    let again: Vec<&str> = walk["command_line"].as_str().unwrap().split(' ').skip(1).collect();
    let (code, rows, error) = super::moments::run(folder.path(), &again);
    assert_eq!((code, rows[0]["sah_cost"].clone()), (0, costs[1].clone()), "{error}");
}

#[test]
fn a_tree_follows_to_the_moment_by_a_policy() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let (code, rows, error) = run(folder.path(), args);
        assert_eq!(code, 0, "{args:?}: {error}");
        rows
    };
    let render = |args: &[&str]| run(&[&COMMON[..], &["-o", "a.png"], args].concat())[0].clone();
    let animate = ["animate", "builtin:walker:2000", "--size", "64x48", "--frames", "3", "--json", "--policy"];
    for policy in ["refit", "rotate"] {
        let expected = run(&[&animate[..], &[policy]].concat());
        let shown = render(&["--time", "0.5", "--policy", policy, "--policy-frames", "3"]);
        assert_eq!((&shown["policy"], &shown["sah_cost"]), (&policy.into(), &expected[1]["sah_cost"]));
    }
    let rebuilt = render(&["--time", "0.5"]);
    assert!(rebuilt.get("policy").is_none());
    assert_eq!(rebuilt["sah_cost"], render(&["--time", "0.5", "--policy", "rebuild"])["sah_cost"]);
    // A film follows frame by frame.
    let film = [&COMMON[..], &["-o", "film.png", "--policy", "rotate", "--policy-frames", "3"]].concat();
    let film = run(&[&film[..], &["--frames", "0..0.5:0.5"]].concat());
    assert_eq!(
        film[1]["sah_cost"],
        render(&["--time", "0.5", "--policy", "rotate", "--policy-frames", "3"])["sah_cost"]
    );
    // Its tree is a file for other commands, which take the model at the same moment.
    let at = ["builtin:walker:2000", "--time", "0.5"];
    let refitted = [&at[..], &["--policy", "refit", "--policy-frames", "3"]].concat();
    let expected = render(&["--time", "0.5", "--policy", "refit", "--policy-frames", "3"]);
    run(&[&["tree", "-o", "refitted.bvh"], &refitted[..]].concat());
    let [own, read] = [&refitted[..], &[&at[..], &["--tree", "refitted.bvh"]].concat()]
        .map(|args| run(&[&["info", "--json"], args].concat())[0].clone());
    assert_eq!((&own["policy"], &own["time_s"], read.get("policy")), (&"refit".into(), &0.5.into(), None));
    let small = ["--size", "32x24", "--repeat", "1", "--json"];
    let diff = run(&[&["diff", "--b", "refitted.bvh"], &at[..], &small].concat())[0].clone();
    let bench = run(&[&["bench", "--tree", "refitted.bvh"], &at[..], &small].concat());
    for found in [&own, &read, &diff["b"], &bench[2]] {
        assert_eq!([&found["sah_cost"], &found["epo"]], [&expected["sah_cost"], &expected["epo"]], "{found}");
    }
    assert!(bench[2]["command_line"].as_str().unwrap().contains("--clip 0 --time 0.5"), "{}", bench[2]);
    let refused = [&COMMON[..], &["-o", "a.png", "--policy", "refit"]].concat();
    let (code, _, error) = super::moments::run(folder.path(), &refused);
    assert!(code == 2 && error.contains("--policy: the pose of the file follows nothing"), "{error}");
}

#[test]
fn a_film_has_a_picture_for_each_moment() {
    let folder = tempfile::tempdir().unwrap();
    let (code, rows, error) =
        run(folder.path(), &[&COMMON[..], &["--frames", "0..0.5:0.25", "-o", "film.gif"]].concat());
    assert_eq!(code, 0, "{error}");
    assert!(error.contains("wrote film.gif: 3 frames of 64×48 pixels"), "{error}");
    let times: Vec<&Value> = rows.iter().map(|row| &row["time_s"]).collect();
    assert_eq!(times, [&Value::from(0.0), &0.25.into(), &0.5.into()]);
    let file = std::fs::File::open(folder.path().join("film.gif")).unwrap();
    let mut decoder = gif::DecodeOptions::new().read_info(file).unwrap();
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [25; 3]);
    // An animated PNG has all colours of the pictures in a folder.
    let (code, _, error) = run(folder.path(), &[&COMMON[..], &["--frames", "0..0.5:0.25", "-o", "film.png"]].concat());
    assert!(code == 0 && error.contains("wrote film.png: 3 frames of 64×48 pixels"), "{error}");
    let file = std::io::BufReader::new(std::fs::File::open(folder.path().join("film.png")).unwrap());
    let mut film = png::Decoder::new(file).read_info().unwrap();
    assert_eq!(film.info().animation_control().map(|all| (all.num_frames, all.num_plays)), Some((3, 0)));
    let frames: Vec<Vec<u8>> = (0..3)
        .map(|_| {
            let mut pixels = vec![0; film.output_buffer_size().unwrap()];
            film.next_frame(&mut pixels).unwrap();
            let control = film.info().frame_control().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (250, 1000));
            pixels
        })
        .collect();
    let (code, _, error) = run(folder.path(), &[&COMMON[..], &["--frames", "0..0.5:0.25", "-o", "frames"]].concat());
    assert_eq!(code, 0, "{error}");
    let pictures: Vec<Vec<u8>> = (1..=3)
        .map(|number| std::fs::read(folder.path().join(format!("frames/frame-{number:04}.png"))).unwrap())
        .collect();
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    for (frame, picture) in frames.iter().zip(&pictures) {
        assert!(*frame == *image::load_from_memory(picture).unwrap().to_rgba8().as_raw());
    }
    assert_eq!(std::fs::read_dir(folder.path().join("frames")).unwrap().count(), 3);
}

#[test]
fn triangles_that_vanish_in_motion_are_warnings() {
    let folder = tempfile::tempdir().unwrap();
    // A triangle that a clip moves to 1e30 in its second of three frames; its first key is at half a second.
    let floats = |list: &[f32]| list.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let bytes = [
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        floats(&[0.5, 1.5, 2.5]),
        floats(&[0.0, 0.0, 0.0, 1e30, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ];
    let [corners, times, moves] = bytes.each_ref().map(Vec::len);
    std::fs::write(folder.path().join("a.bin"), bytes.concat()).unwrap();
    let document = serde_json::json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": "a.bin", "byteLength": corners + times + moves}],
        "bufferViews": [
            {"buffer": 0, "byteLength": corners}, {"buffer": 0, "byteOffset": corners, "byteLength": times},
            {"buffer": 0, "byteOffset": corners + times, "byteLength": moves}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3"}
        ],
        "animations": [{
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": 1, "output": 2, "interpolation": "STEP"}]
        }]
    });
    std::fs::write(folder.path().join("a.gltf"), document.to_string()).unwrap();
    let run = |line: &str| run(folder.path(), &line.split(' ').collect::<Vec<_>>());
    let lost = "1 triangle left out at this moment: coordinates that are not numbers or beyond 1e18";
    let render = "render a.gltf --size 16x16 --samples 1 --json --strict -o a.png";
    // Before its first key a clip stands still.
    for (time, expected) in [("0", 0), ("0.5", 0), ("1.5", 3), ("2.5", 0)] {
        let (code, rows, error) = run(&format!("{render} --time {time}"));
        assert_eq!(code, expected, "{time}: {error}");
        assert_eq!(rows[0]["warnings"].as_array().unwrap().iter().any(|text| text == lost), expected == 3, "{time}");
        assert_eq!(error.contains(&format!("at {time} s: {lost}")), expected == 3, "{time}: {error}");
    }
    let (code, _, error) = run("render a.gltf --size 16x16 --samples 1 --strict -o a.gif --frames 0.5..2.5:1");
    assert!(code == 3 && error.matches(lost).count() == 1, "{code}: {error}");
    let (code, rows, error) =
        run("animate a.gltf --frames 3 --policy refit,rebuild --size 16x16 --repeat 1 --json --strict");
    assert!(code == 3 && error.contains(&format!("at 1.5 s: {lost}")), "{code}: {error}");
    let of_frames: Vec<usize> = rows.iter().filter_map(|row| Some(row["warnings"].as_array()?.len())).collect();
    assert_eq!(of_frames, [0, 0, 1, 1, 0, 0]);
}

#[test]
fn clips_are_listed_and_wrong_ones_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, rows, _) = run(folder.path(), &["info", "builtin:walker:500", "--json"]);
    assert_eq!(rows[0]["clips"][1]["name"], "jump");
    assert_eq!(rows[0]["clips"][1]["end"], 1.5);
    let output = Command::cargo_bin("bvhscope").unwrap().args(["info", "builtin:walker:500"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("0 'walk' (0.000 to 1.000 s), 1 'jump' (0.000 to 1.500 s)"), "{text}");
    for (args, code, message) in [
        (&["builtin:walker:500", "--clip", "swim"][..], 1, "there are 0 'walk', 1 'jump'"),
        (&["builtin:cornell", "--time", "1"], 1, "so that it does not move: leave --time out"),
        (&["builtin:cornell", "--frames", "0..1"], 1, "so that it does not move: leave --frames out"),
        (&["builtin:walker:500", "--time", "-1"], 2, "--time -1: clip 'walk' lasts from 0.000 to 1.000 s"),
        (&["builtin:walker:500", "--time", "9"], 2, "--time 9: clip 'walk' lasts from 0.000 to 1.000 s"),
        (&["builtin:walker:500", "--frames", "0..3:1"], 2, "--frames 0..3: clip 'walk' lasts from 0.000 to 1.000 s"),
        (&["builtin:walker:500", "--time", "nan"], 2, "a time in seconds is expected"),
        (&["builtin:walker:500", "--frames", "0..1", "--time", "1"], 2, "cannot be used with"),
    ] {
        let (found, _, error) = run(folder.path(), &[&["render", "-o", "a.png"], args].concat());
        assert_eq!(found, code, "{args:?}: {error}");
        assert!(error.contains(message), "{args:?}: {error}");
    }
    let (found, _, error) =
        run(folder.path(), &["render", "builtin:walker:500", "--frames", "0..1:0.5", "-o", "a.jpg"]);
    assert!(found == 2 && error.contains("the film must end in .gif or .png, or be a folder"), "{error}");
}
