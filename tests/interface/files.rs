//! Opening files without a dialog, copying without a clipboard, and the hint while a file hovers.

use std::path::PathBuf;

use crate::panel::{harness, press, state};
use bvhscope::app::state::{AppState, FolderEntry, Listing, Request, Severity};
use bvhscope::render::Shading;
use bvhscope::scene::SceneSource;
use egui::{HoveredFile, Key};
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
