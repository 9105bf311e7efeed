//! The pictures that README and the pages of the documentation show: each is taken by `make screenshots`, and nothing else is kept.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bvhscope::app::state::{Preferences, SharedState, Wanted};
use bvhscope::scene::SceneSource;

use crate::desktop::Desktop;
use crate::screen::{Screenshot, Window};
use crate::screenshots::{folder, image_of, is_updating, save, tour_names};
use crate::support::models;
use crate::support::process::PATIENCE;

const BUNNY: &str = "bunny/bunny.obj";
/// Pictures by the command `render`: name, model and flags.
const RENDERED: [(&str, &str, &[&str]); 6] = [
    ("boxes-depth-3", BUNNY, &["--overlay", "box", "--depth", "3"]),
    ("boxes-depth-8", BUNNY, &["--overlay", "box", "--depth", "7..8"]),
    ("spheres", BUNNY, &["--container", "sphere", "--overlay", "sphere", "--depth", "6..7"]),
    ("clusters", BUNNY, &["--shading", "clusters"]),
    ("heat", BUNNY, &["--shading", "heat", "--legend", "off"]),
    ("sponza", "sponza-crytek/sponza.obj", &[]),
];
/// Screenshots of the window besides those of the tour.
const WINDOWS: [&str; 2] = ["window", "motion"];
/// The dock below the viewport, where the view Motion draws its curves.
const DOCK: [usize; 4] = [0, 470, 1280, 660];
/// How long a part of the window stays the same once nothing more is measured: a repeated build takes two seconds at most.
const STILL: Duration = Duration::from_secs(5);
/// Number of colours in the dock from which curves are drawn there.
const CURVE_COLORS: usize = 1000;

/// Renders each of [`RENDERED`] by the program.
fn render_all(models: &Path) {
    let temporary = tempfile::tempdir().unwrap();
    for (name, model, flags) in RENDERED {
        let taken = temporary.path().join(format!("{name}.png"));
        let status = std::process::Command::new(crate::desktop::PROGRAM)
            .args(["render", models.join(model).to_str().unwrap(), "--size", "640x480", "-o"])
            .arg(&taken)
            .args(flags)
            .status();
        assert!(status.unwrap().success(), "{name} could not be rendered");
        save(&image::open(&taken).unwrap().to_rgb8(), &folder("").join(format!("{name}.png")));
    }
}

/// The screen once `is_there` holds and neither picture nor panels have changed for [`STILL`].
fn still(window: &mut Window, is_there: impl Fn(&Screenshot) -> bool) -> Screenshot {
    let everything = [0, 0, 1280, 800];
    let give_up = Instant::now() + PATIENCE;
    let mut before = window.at_rest();
    let mut since = Instant::now();
    while since.elapsed() < STILL || !is_there(&before) {
        std::thread::sleep(Duration::from_millis(500));
        let screen = window.screenshot();
        if screen.changed(&before, everything) > 0.0 {
            since = Instant::now();
        }
        before = screen;
        assert!(Instant::now() < give_up, "the window never comes to rest");
    }
    before
}

/// The window at 1280×800 with these arguments, as it is for a user who has seen the tour.
fn window(arguments: &[&str]) -> Window {
    let desktop = Desktop::new();
    let preferences = Preferences { greeted: true, toured: true, ..Preferences::default() };
    // Settings of another model, so that the window chooses the camera.
    let wanted = Wanted::new(SceneSource::parse("builtin:cornell".as_ref()).unwrap());
    desktop.write_settings(&serde_json::json!({ "wanted": wanted, "preferences": preferences }).to_string());
    let window = Window::open_on(desktop, arguments);
    window.move_to([1279, 799]);
    window
}

/// Takes the screenshots named in [`WINDOWS`].
fn take_windows(models: &Path) {
    let save_as = |name: &str, screen: &Screenshot| save(&image_of(screen), &folder("").join(format!("{name}.png")));
    let mut bunny = window(&[models.join(BUNNY).to_str().unwrap()]);
    save_as("window", &still(&mut bunny, |_| true));
    drop(bunny);
    let wanted = Wanted::new(SceneSource::parse("builtin:walker".as_ref()).unwrap());
    let state = SharedState { wanted, dock: Some("Motion".to_owned()), ..SharedState::default() };
    let mut motion = window(&["--state", &state.line()]);
    save_as("motion", &still(&mut motion, |screen| screen.colors(DOCK) > CURVE_COLORS));
}

/// The names of all pictures that the command takes for documents, below assets/screenshots.
fn taken() -> BTreeSet<String> {
    let rendered = RENDERED.iter().map(|(name, ..)| format!("{name}.png"));
    let windows = WINDOWS.iter().map(|name| format!("{name}.png"));
    rendered.chain(windows).chain(tour_names().map(|name| format!("lab/{name}.png"))).collect()
}

/// The names of the pictures below assets/screenshots that the documents show.
fn shown() -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = std::fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = pages.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    let mut names = BTreeSet::new();
    for page in pages.chain([root.join("README.md")]) {
        let text = std::fs::read_to_string(&page).unwrap();
        let rest = text.split("assets/screenshots/").skip(1).filter_map(|rest| rest.split([')', '`', '"']).next());
        names.extend(rest.filter(|name| name.ends_with(".png")).map(str::to_owned));
    }
    names
}

/// The files in assets/screenshots and its folder `lab`; those of `sheet` are for tests alone.
fn kept() -> BTreeSet<String> {
    let files = |prefix: &str| -> Vec<String> {
        let entries = std::fs::read_dir(folder(prefix)).unwrap().map(|entry| entry.unwrap().path());
        let files = entries.filter(|path: &PathBuf| path.is_file());
        files.map(|path| format!("{prefix}{}", path.file_name().unwrap().display())).collect()
    };
    files("").into_iter().chain(files("lab/")).collect()
}

#[test]
fn every_picture_of_the_documents_is_taken_by_the_command_and_no_other_is_kept() {
    if is_updating() {
        let models = models().expect("make screenshots needs the models: name their folder by BVHSCOPE_MODELS");
        let models = std::path::absolute(models).unwrap();
        render_all(&models);
        take_windows(&models);
    }
    assert_eq!(shown(), taken(), "pictures that README.md and docs show, and those that the command takes");
    assert_eq!(kept(), taken(), "files in assets/screenshots, and those that the command takes");
}
