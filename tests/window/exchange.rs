//! Exchange of the window with other programs: a file chosen in the desktop's dialog, measured rows, plots.

use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::desktop::{Desktop, PROGRAM};
use crate::screen::Window;
use crate::support::process::{PATIENCE, wait_until};

/// Buttons of the view "Paper" at 1280×800.
const MEASURE: [i32; 2] = [782, 471];
const SAVE_CSV: [i32; 2] = [972, 471];
const SAVE_PNG: [i32; 2] = [1080, 471];

fn click(window: &Window, at: [i32; 2]) {
    window.move_to(at);
    // A button must have seen the pointer before it is pressed.
    std::thread::sleep(Duration::from_millis(300));
    window.desktop.xdotool(&["click", "1"]);
}

/// The first file in the program's folder with this extension. Its button is pressed again and again, because it does nothing
/// before the measurement is done.
fn saved(window: &Window, extension: &str, button: [i32; 2]) -> PathBuf {
    let give_up = Instant::now() + PATIENCE;
    loop {
        let mut entries = std::fs::read_dir(window.desktop.home()).unwrap().map(|entry| entry.unwrap().path());
        if let Some(path) = entries.find(|path| path.extension().is_some_and(|found| found == extension)) {
            return path;
        }
        assert!(Instant::now() < give_up, "no file with the extension {extension}");
        click(window, button);
        std::thread::sleep(Duration::from_secs(1));
    }
}

/// Puts a program in the place of zenity, which shows the dialogs of desktops without a portal: it chooses `path`. Returns the file
/// to which it writes its arguments.
fn choose(desktop: &Desktop, path: &Path) -> PathBuf {
    std::fs::create_dir(desktop.programs()).unwrap();
    let dialog = desktop.programs().join("zenity");
    let asked = desktop.home().join("asked");
    let script = format!("#!/bin/sh\nprintf '%s\\n' \"$@\" > '{}'\necho '{}'\n", asked.display(), path.display());
    std::fs::write(&dialog, script).unwrap();
    std::fs::set_permissions(&dialog, std::fs::Permissions::from_mode(0o755)).unwrap();
    asked
}

#[test]
fn the_file_chosen_in_the_desktops_dialog_is_opened() {
    let desktop = Desktop::new();
    let model = desktop.home().join("three triangles.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n").unwrap();
    let asked = choose(&desktop, &model);

    let mut window = Window::open_on(desktop, &["builtin:teapot:2"]);
    window.at_rest();
    window.key("ctrl+o");
    let line = window.program.wait_for("presented three triangles.obj");
    assert!(line.contains("3 triangles"), "{line}");
    let asked = std::fs::read_to_string(asked).unwrap();
    for expected in ["--file-selection", "*.obj", "*.glb"] {
        assert!(asked.contains(expected), "the dialog is not told {expected}: {asked}");
    }
}

/// The rows that the window measured and saved, as Python reads them, beside what a command prints.
#[test]
fn measured_rows_and_plots_are_files_for_other_programs() {
    let mut window = Window::open(&["builtin:teapot:2"]);
    window.at_rest();
    let before = window.screenshot();
    window.key("F11");
    wait_until(|| window.screenshot().changed(&before, [10, 432, 1240, 480]) > 0.05);
    let empty = window.screenshot();
    wait_until(|| {
        click(&window, MEASURE);
        std::thread::sleep(Duration::from_secs(1));
        window.screenshot().changed(&empty, [10, 510, 700, 620]) > 0.01
    });
    let rows = saved(&window, "csv", SAVE_CSV);
    let read = "import csv,sys\nfor r in csv.DictReader(open(sys.argv[1])): print(r['container'],r['triangles'],r['sah_cost'])";
    let read = window.desktop.run("/usr/bin/python3", &["-c", read, rows.to_str().unwrap()]);
    let read = String::from_utf8(read).unwrap();
    for container in ["box", "sphere"] {
        let info = window.desktop.run(PROGRAM, &["info", "builtin:teapot:2", "--container", container, "--json"]);
        let info: serde_json::Value = serde_json::from_slice(&info).unwrap();
        let line = read.lines().find(|line| line.starts_with(container)).unwrap_or_else(|| panic!("{read}"));
        let numbers: Vec<f64> = line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect();
        assert_eq!(numbers[0], info["triangles"].as_f64().unwrap());
        assert!((numbers[1] / info["sah_cost"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{line}: {info}");
    }
    let plot = saved(&window, "png", SAVE_PNG);
    let plot = image::open(plot).unwrap().to_rgb8();
    let colors: std::collections::HashSet<_> = plot.pixels().collect();
    assert!(plot.width() >= 400 && colors.len() > 8, "{} pixels wide, {} colours", plot.width(), colors.len());
    window.key("ctrl+q");
    wait_until(|| !window.program.is_running());
}

/// A tree that a script in Python has built, chosen in the dialog, saved for another program, and followed when a third one writes it
/// anew.
#[test]
fn trees_are_files_of_other_programs() {
    const MODEL: &str = "builtin:teapot:2";
    let desktop = Desktop::new();
    let home = desktop.home().to_owned();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let tree = home.join("mine.bvh");
    let triangles = home.join("triangles.f32");
    desktop.run(PROGRAM, &["info", MODEL, "--triangles", triangles.to_str().unwrap()]);
    let script = repository.join("examples/tree_file/median_split.py");
    let mut builder = desktop.command("/usr/bin/python3");
    builder.env("PYTHONPATH", repository.join("assets")).arg(script).args([&triangles, &tree]);
    assert!(builder.status().unwrap().success());
    let asked = choose(&desktop, &tree);

    let mut window = Window::open_on(desktop, &[MODEL]);
    window.at_rest();
    let nodes = |window: &Window, tree: &Path| {
        let info = window.desktop.run(PROGRAM, &["info", MODEL, "--tree", tree.to_str().unwrap(), "--json"]);
        let info: serde_json::Value = serde_json::from_slice(&info).unwrap();
        (format!("{} nodes", info["nodes"]), info)
    };
    let (shown, of_python) = nodes(&window, &tree);
    window.key("ctrl+shift+o");
    window.program.wait_for(&shown);
    assert!(std::fs::read_to_string(asked).unwrap().contains("*.bvh"));

    window.key("ctrl+shift+s");
    let is_saved = |path: &PathBuf| path.extension().is_some_and(|found| found == "bvh") && *path != tree;
    let mut saved = None;
    wait_until(|| {
        let entries = std::fs::read_dir(&home).unwrap().map(|entry| entry.unwrap().path());
        saved = entries.into_iter().find(is_saved);
        saved.is_some()
    });
    let (_, of_window) = nodes(&window, &saved.unwrap());
    let number = |info: &serde_json::Value, name: &str| info[name].as_f64().unwrap_or_else(|| panic!("{name}: {info}"));
    for name in ["nodes", "leaves", "max_depth", "sah_cost", "epo"] {
        assert_eq!(number(&of_window, name), number(&of_python, name), "{name}");
    }

    let anew = home.join("anew");
    window
        .desktop
        .run(PROGRAM, &["tree", MODEL, "--builder", "lbvh", "-o", anew.with_extension("bvh").to_str().unwrap()]);
    std::fs::rename(anew.with_extension("bvh"), &tree).unwrap();
    let (now, _) = nodes(&window, &tree);
    assert_ne!(now, shown);
    window.program.wait_for(&now);
    window.key("ctrl+q");
    wait_until(|| !window.program.is_running());
}
