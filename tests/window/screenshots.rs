//! Screenshots of the real window: the sheet with three models, both themes and four modes of each, and the tour of the laboratory.
//! `make screenshots` takes them again.

use std::path::{Path, PathBuf};

use bvhscope::app::state::{CompareView, Preferences, SecondTree, SharedPicture, SharedState, Theme, Wanted};
use bvhscope::lab::ray::RayMethod;
use bvhscope::render::{HeatKind, RayKind, Shading};
use bvhscope::scene::SceneSource;
use bvhscope_engine::construction::Cut;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::traverse::Traversal;
use image::codecs::png::{CompressionType, FilterType as RowFilter, PngEncoder};
use image::imageops::{FilterType, crop_imm, resize};
use image::{ImageEncoder as _, RgbImage};

use crate::desktop::{Desktop, SAMPLES};
use crate::screen::{Screenshot, VIEWPORT, Window};

/// Names in those of the pictures, the model, and the theme.
const WINDOWS: [(&str, &str, Theme); 4] = [
    ("teapot-dark", "builtin:teapot", Theme::Dark),
    ("teapot-light", "builtin:teapot", Theme::Light),
    ("sphereflake-dark", "builtin:sphereflake", Theme::Dark),
    ("terrain-light", "builtin:terrain:20000", Theme::Light),
];
/// Names of the modes and the key that leads to each from the one before; the second is reached by a click on the model.
const MODES: [(&str, &str); 4] = [("boxes", "alt+1"), ("selected", ""), ("clusters", "alt+5"), ("heat", "alt+6")];
/// The screenshots are kept at half the size of the window.
const KEPT: [u32; 2] = [640, 400];
/// Edge in kept pixels of the squares whose mean colours are compared: fonts and drivers differ in single pixels.
const CELL: u32 = 8;
/// How far the mean colour of a square may differ, of 255: digits of times and rates do.
const TOLERANCE: i32 = 28;
/// Part of the squares that may differ by more.
const DIFFERENT: f64 = 0.03;

/// A folder or file in assets/screenshots.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/screenshots").join(name)
}

pub fn image_of(screen: &Screenshot) -> RgbImage {
    let height = screen.pixels.len() / screen.width;
    let bytes = screen.pixels.iter().flat_map(|pixel| pixel.to_be_bytes().into_iter().skip(1)).collect();
    RgbImage::from_raw(screen.width as u32, height as u32, bytes).unwrap()
}

fn kept(screen: &Screenshot) -> RgbImage {
    resize(&image_of(screen), KEPT[0], KEPT[1], FilterType::Triangle)
}

/// Saves a picture as the smaller of two files: plain areas compress better without filters, gradients with them.
pub fn save(image: &RgbImage, file: &Path) {
    let encoded = [RowFilter::NoFilter, RowFilter::Adaptive].map(|filter| {
        let mut bytes = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, filter);
        encoder.write_image(image, image.width(), image.height(), image::ExtendedColorType::Rgb8).unwrap();
        bytes
    });
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(file, encoded.iter().min_by_key(|bytes| bytes.len()).unwrap()).unwrap();
}

/// True where pictures are taken again instead of compared.
pub fn is_updating() -> bool {
    std::env::var_os("UPDATE_SCREENSHOTS").is_some()
}

/// The difference between a picture and the one kept in `file`, if any. With `UPDATE_SCREENSHOTS` it replaces that one.
fn complaint(image: &RgbImage, file: &Path) -> Option<String> {
    if is_updating() {
        save(image, file);
    }
    let expected = image::open(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let part = difference(image, &expected.to_rgb8());
    if part <= DIFFERENT {
        return None;
    }
    let seen = std::env::temp_dir().join(format!("bvhscope-{}", file.file_name().unwrap().display()));
    image.save(&seen).unwrap();
    Some(format!("{:.1} % of {} differs from {}", part * 100.0, seen.display(), file.display()))
}

/// Part of the squares of two screenshots that differ.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let [across, down] = [a.width() / CELL, a.height() / CELL];
    let mean = |image: &RgbImage, x: u32, y: u32| {
        let mut sum = [0_i32; 3];
        for pixel in (0..CELL * CELL).map(|place| image.get_pixel(x * CELL + place % CELL, y * CELL + place / CELL)) {
            sum.iter_mut().zip(pixel.0).for_each(|(sum, channel)| *sum += i32::from(channel));
        }
        sum.map(|sum| sum / (CELL * CELL) as i32)
    };
    let differs = |x: u32, y: u32| {
        let (a, b) = (mean(a, x, y), mean(b, x, y));
        a.iter().zip(b).any(|(a, b)| (a - b).abs() > TOLERANCE)
    };
    let cells = (0..down).flat_map(|y| (0..across).map(move |x| (x, y)));
    cells.filter(|&(x, y)| differs(x, y)).count() as f64 / f64::from(across * down)
}

/// The window of one model in one theme, in all modes.
fn shots(source: &str, theme: Theme) -> Vec<RgbImage> {
    let desktop = Desktop::new();
    let preferences = Preferences { theme, greeted: true, toured: true, ..Preferences::default() };
    // Settings of another model, so that the window chooses the camera.
    let wanted = Wanted::new(SceneSource::parse("builtin:cornell".as_ref()).unwrap());
    desktop.write_settings(&serde_json::json!({ "wanted": wanted, "preferences": preferences }).to_string());
    let mut window = Window::open_on(desktop, &[source]);
    let mut before = window.at_rest();
    let mut taken = Vec::new();
    for (mode, key) in MODES {
        match mode {
            "boxes" => {}
            "selected" => {
                window.desktop.xdotool(&["mousemove", "640", "380", "click", "1"]);
                // On a loaded machine the next move may arrive within the same frame, and a click is where the pointer is at its end.
                window.once(|screen| screen.changed(&before, VIEWPORT) > 0.002);
            }
            _ => {
                // Clear the selection, and move the pointer off the model.
                window.key("Escape");
                window.program.unread_lines();
                window.key(key);
                if mode == "heat" {
                    // Its only sample; until then the picture is coarse.
                    window.program.wait_for("picture at full resolution, 1 samples a pixel");
                }
            }
        }
        window.move_to([1279, 799]);
        let screen =
            window.once_complete(mode != "heat", |screen| mode == "boxes" || screen.changed(&before, VIEWPORT) > 0.002);
        taken.push(kept(&screen));
        before = screen;
    }
    taken
}

#[test]
fn the_window_looks_as_the_sheet_shows_it() {
    let mut different = Vec::new();
    for (name, source, theme) in WINDOWS {
        for (image, (mode, _)) in shots(source, theme).iter().zip(MODES) {
            different.extend(complaint(image, &folder("sheet").join(format!("{name}-{mode}.png"))));
        }
    }
    assert!(different.is_empty(), "{}\n'make screenshots' takes all again", different.join("\n"));
}

/// Size of the window in the tour of the laboratory, and height of what is kept of it: without the line of speeds.
const TOUR: [u32; 2] = [1080, 640];
const TOUR_KEPT: u32 = 608;

/// The states of the tour, by the name of their picture.
fn tour() -> Vec<(&'static str, SharedState)> {
    let plain = || {
        let wanted = Wanted::new(SceneSource::parse("builtin:teapot".as_ref()).unwrap());
        SharedState { wanted, ..SharedState::default() }
    };
    let dock = |view: &str| SharedState { dock: Some(view.to_owned()), ..plain() };
    let shaded = |shading: Shading| {
        let mut state = SharedState { show_containers: false, ..plain() };
        state.wanted.render.shading = shading;
        state
    };
    let mut merges = dock("Merges");
    merges.picture.clusters_left = Some(60);
    let mut cut = dock("Merges");
    cut.wanted.render.shading = Shading::Clusters;
    cut.picture.cut = Some(Cut::Primitives(200));
    let mut ray = dock("Ray");
    let start = serde_json::json!({ "ray": { "origin": [-6.0, 3.4, 3.0], "direction": [1.0, -0.27, -0.42] } });
    let method = RayMethod::Binary(Traversal::Ordered);
    let shared = serde_json::json!({ "start": start, "kind": RayKind::Primary, "method": method, "step": 40 });
    ray.picture = SharedPicture { ray: Some(serde_json::from_value(shared).unwrap()), ..SharedPicture::default() };
    let mut copies = dock("Copies");
    copies.wanted.source = SceneSource::parse("builtin:forest:60".as_ref()).unwrap();
    let mut difference = plain();
    let build = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
    difference.wanted.second = Some(SecondTree { view: CompareView::Difference, ..SecondTree::new(build) });
    difference.show_containers = false;
    let mut split = difference.clone();
    split.wanted.second = Some(SecondTree { view: CompareView::Split, ..SecondTree::new(build) });
    split.show_containers = true;
    vec![
        ("merges", merges),
        ("cut", cut),
        ("icicle", dock("Icicle")),
        ("ray", ray),
        ("nodes", dock("Nodes")),
        ("plots", dock("Plots")),
        ("layouts", dock("Layouts")),
        ("copies", copies),
        ("whole-ray", shaded(Shading::Heat(HeatKind::WholeRay))),
        ("split", split),
        ("difference", difference),
    ]
}

/// The names of the pictures of the tour.
pub fn tour_names() -> impl Iterator<Item = &'static str> {
    tour().into_iter().map(|(name, _)| name)
}

#[test]
fn the_laboratory_looks_as_the_tour_shows_it() {
    let mut different = Vec::new();
    for (name, mut state) in tour() {
        // A state takes the place of flags.
        state.wanted.render.samples = *SAMPLES;
        let desktop = Desktop::with_screen(&format!("{}x{}x24", TOUR[0], TOUR[1]));
        let preferences =
            Preferences { greeted: true, toured: true, left_open: false, right_open: false, ..Preferences::default() };
        let wanted = Wanted::new(SceneSource::parse("builtin:cornell".as_ref()).unwrap());
        desktop.write_settings(&serde_json::json!({ "wanted": wanted, "preferences": preferences }).to_string());
        // The form matters to models with copies alone.
        let mut window = Window::open_on(desktop, &["--instances", "two-level", "--state", &state.line()]);
        let [width, height] = TOUR.map(|side| side.to_string());
        window.desktop.xdotool(&["windowsize", "--sync", &window.id, &width, &height]);
        window.move_to([TOUR[0] as i32 - 1, TOUR[1] as i32 - 1]);
        window.program.wait_for("picture at full resolution");
        let all_samples = state.wanted.traced().wanted_samples() > 1;
        let screen = window.once_complete(all_samples, |_| true);
        let image = crop_imm(&image_of(&screen), 0, 0, TOUR[0], TOUR_KEPT).to_image();
        different.extend(complaint(&image, &folder("lab").join(format!("{name}.png"))));
    }
    assert!(different.is_empty(), "{}\n'make screenshots' takes all again", different.join("\n"));
}

/// The comparison lets digits pass and nothing else.
#[test]
fn screenshots_of_different_windows_differ() {
    let image = |text_x: u32, panel: u8| {
        RgbImage::from_fn(KEPT[0], KEPT[1], |x, y| {
            let digit = y / 8 == 5 && (text_x..text_x + 30).contains(&x) && x % 3 == 0;
            image::Rgb(if digit {
                [255; 3]
            } else if x < 120 {
                [panel; 3]
            } else {
                [90; 3]
            })
        })
    };
    assert_eq!(difference(&image(20, 30), &image(20, 30)), 0.0);
    assert!(difference(&image(20, 30), &image(40, 30)) < DIFFERENT, "other digits");
    assert!(difference(&image(20, 30), &image(20, 90)) > DIFFERENT, "a panel in another colour");
}
