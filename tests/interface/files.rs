//! Opening files without a dialog, copying without a clipboard, and the hint while a file hovers.

use std::path::PathBuf;

use crate::harness::{presented, settle};
use crate::panel::{harness, press, state};
use crate::recorded_screen;
use bvhscope::app::state::{AppState, FolderEntry, Listing, Request, Severity};
use bvhscope::render::{HeatKind, Shading};
use bvhscope::scene::SceneSource;
use egui::{HoveredFile, Key, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;

fn start_page() -> Harness<'static, AppState> {
    let mut s = state(Shading::Lit);
    s.layout.start_page_open = true;
    s.layout.path_field.wants_focus = true;
    harness(s)
}

/// Types a text and gives the field the entries of a folder.
fn typed(text: &str) -> Harness<'static, AppState> {
    let mut h = start_page();
    h.get_by_label("Path").type_text(text);
    h.run_steps(3);
    let folder = h.state().layout.path_field.requested.clone().unwrap();
    assert!(h.state().activity.requests.contains(&Request::ListFolder(folder.clone())));
    let entry = |name: &str, is_folder| FolderEntry { name: name.to_owned(), is_folder };
    let entries = vec![entry("box", true), entry("bunny.obj", false), entry("bunny.ply", false)];
    h.state_mut().layout.path_field.listing = Some(Listing { folder, entries });
    h.state_mut().activity.requests.clear();
    h.run_steps(2);
    h
}

fn key(h: &mut Harness<AppState>, key: Key) {
    h.key_press(key);
    h.run_steps(3);
}

fn opened(path: &str) -> Vec<Request> {
    vec![Request::Open(SceneSource::File(PathBuf::from(path)))]
}

#[test]
fn a_typed_path_is_completed_and_opened() {
    let mut h = typed("/data/bun");
    assert!(h.query_by_label("bunny.ply").is_some() && h.query_by_label("box/").is_none());
    key(&mut h, Key::Tab);
    assert_eq!(h.state().layout.path_field.text, "/data/bunny.");
    h.get_by_label("Path").type_text("p");
    h.run_steps(3);
    key(&mut h, Key::Tab);
    key(&mut h, Key::Enter);
    assert_eq!(h.state().activity.requests, opened("/data/bunny.ply"));
    assert!(!h.state().layout.start_page_open);
}

#[test]
fn arrow_keys_and_clicks_choose_what_is_offered() {
    let mut h = typed("/data/b");
    key(&mut h, Key::ArrowDown);
    key(&mut h, Key::ArrowDown);
    key(&mut h, Key::Enter);
    assert_eq!(h.state().activity.requests, opened("/data/bunny.obj"));
    let mut h = typed("/data/b");
    press(&mut h, "box/");
    assert_eq!(h.state().layout.path_field.text, "/data/box/", "a folder is entered");
    assert!(h.state().layout.start_page_open);
}

#[test]
fn copying_without_a_clipboard_says_so() {
    for (fault, severity) in [(None, Severity::Info), (Some("no display".to_owned()), Severity::Warning)] {
        let mut s = state(Shading::Lit);
        s.layout.clipboard_fault = fault.clone();
        let mut h = harness(s);
        h.key_press_modifiers(egui::Modifiers::COMMAND, Key::I);
        h.run_steps(2);
        let message = h.state().messages.history.back().unwrap();
        assert_eq!(message.severity, severity);
        assert_eq!(message.text.contains("no display"), fault.is_some(), "{}", message.text);
    }
}

#[test]
fn a_hovering_file_is_named_before_it_is_dropped() {
    // Painted text has no accessible name, so only the areas that change are compared.
    let mut h = harness(state(Shading::Lit));
    let shapes = |h: &Harness<'static, AppState>| {
        let texts = h.output().shapes.iter().filter_map(|shape| match &shape.shape {
            egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
            _ => None,
        });
        texts.collect::<Vec<_>>().join("\n")
    };
    assert!(!shapes(&h).contains("Drop to open"));
    let hovered = |name: &str| HoveredFile { path: Some(PathBuf::from(name)), ..HoveredFile::default() };
    h.input_mut().hovered_files = vec![hovered("/a/notes.txt"), hovered("/a/bunny.obj")];
    h.step();
    let text = shapes(&h);
    assert!(text.contains("Drop to open bunny.obj") && text.contains("of 2 files"), "{text}");
    h.input_mut().hovered_files = vec![hovered("/a/notes.txt")];
    h.step();
    assert!(shapes(&h).contains("Its name is not one of a model"));
}

#[test]
fn a_screenshot_has_the_scale_of_its_colors_below() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("roof.obj");
    std::fs::write(&model, "v 0 0 0\nv 2 0 0\nv 1 1 1\nv 1 1 -1\nf 1 2 3\nf 2 1 4\n").unwrap();
    let mut harness = recorded_screen::open(SceneSource::File(model), vec2(1100.0, 760.0), 1.0, true);
    let state = &mut harness.state_mut().state;
    state.wanted.render.shading = Shading::Heat(HeatKind::Both);
    state.preferences.show_containers = false;
    settle(&mut harness);
    harness.state_mut().state.activity.requests.push(Request::Screenshot);
    harness.run_steps(2);
    let file = folder.path().join("roof-001.png");
    let written = || std::fs::read(&file).ok();
    let bytes = (0..500).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(20));
        written()
    });
    let picture = image::load_from_memory(&bytes.expect("a screenshot is written")).unwrap().to_rgb8();
    let [width, height] = harness.state().state.layout.viewport_px;
    let settings = presented(&harness).frame.settings;
    let keys = bvhscope::legend::of_picture(&presented(&harness).frame, true, None);
    assert_eq!(keys.len(), 1);
    let with_scale = height + bvhscope::legend::height_px(width, 1);
    assert_eq!(picture.dimensions(), (width, with_scale));
    // The colours of the scale, from its lowest to its highest, in the row through the middle of its bar.
    let row = height + 25;
    let at = |x: u32| picture.get_pixel(x, row).0;
    for (x, place) in [(16, 0.0), (width / 2, 0.5), (width - 16, 1.0)] {
        let expected = settings.value_color(place);
        assert!(at(x).iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 12), "{x}: {:?} {expected:?}", at(x));
    }
}
