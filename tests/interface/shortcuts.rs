//! Shortcuts and the command palette without a window: each action does what its name says.

use std::collections::HashSet;
use std::fmt::Write as _;

use crate::panel::{harness, state};
use bvhscope::app::commands;
use bvhscope::app::commands::{Action, shortcut_text};
use bvhscope::app::state::{AppState, HoveredPixel};
use bvhscope::render::Shading;
use bvhscope_engine::settings::{BuilderKind, Pass};
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;

#[test]
fn a_key_switches_containers() {
    let mut h = harness(state(Shading::Lit));
    assert!(h.state().preferences.show_containers);
    h.key_press(Key::B);
    h.run_steps(2);
    assert!(!h.state().preferences.show_containers);
}

#[test]
fn the_palette_finds_and_performs() {
    let mut h = harness(state(Shading::Lit));
    h.key_press_modifiers(Modifiers::COMMAND, Key::P);
    h.run_steps(4);
    assert_eq!(h.state().layout.palette.as_deref(), Some(""));
    h.get_by_label("Command").type_text("leaves");
    h.run_steps(4);
    assert_eq!(h.state().layout.palette.as_deref(), Some("leaves"));
    h.key_press(Key::Enter);
    h.run_steps(4);
    assert_eq!(h.state().layout.palette, None);
    assert!(h.state().wanted.overlay.leaves_only);
}

#[test]
fn the_palette_ranks_beginnings_of_words_first() {
    let found = commands::search(commands::entries().to_vec(), "orth");
    assert_eq!(found[0].action, Action::ToggleOrthographic);
    assert!(commands::search(commands::entries().to_vec(), "zzzzqq").is_empty());
}

#[test]
fn the_palette_has_the_choices_of_the_panels() {
    let mut state = state(Shading::Lit);
    for (query, label) in [
        ("survival", "Colour by survival"),
        ("orient", "Pass: Orient"),
        ("reinsert", "Pass: Reinsert"),
        ("show 14", "Show 14-DOPs"),
        ("samples 16", "Samples: 16"),
        ("paper", "Traversal: paper"),
        ("policy refit", "Policy: Refit"),
    ] {
        let found = commands::search(commands::entries().to_vec(), query);
        let entry = found.iter().find(|entry| entry.label == label).unwrap_or_else(|| panic!("{query}: no {label}"));
        if entry.action.is_enabled(&state) {
            entry.action.perform(&mut state);
            assert_eq!(entry.action.is_on(&state), Some(true), "{label}");
        } else {
            assert_eq!(label, "Policy: Refit", "the model stands still");
        }
    }
    let passes = state.wanted.build.optimize;
    assert!(passes.contains(Pass::Orient) && passes.contains(Pass::Reinsert), "{passes:?}");
    assert_eq!(state.wanted.render.samples, 16);
}

#[test]
fn a_key_that_does_nothing_says_why() {
    let mut s = state(Shading::Lit);
    s.wanted.build.builder = BuilderKind::Lbvh;
    let mut h = harness(s);
    h.key_press(Key::CloseBracket);
    h.run_steps(2);
    let texts: Vec<&str> = h.state().messages.open.iter().map(|message| message.text.as_str()).collect();
    assert_eq!(texts, ["This builder has no threshold"]);
}

#[test]
fn every_action_is_named_and_no_key_means_two() {
    let mut keys = HashSet::new();
    let mut labels = HashSet::new();
    for entry in commands::entries() {
        assert!(!entry.label.is_empty() && !entry.description.is_empty(), "{:?}", entry.action);
        assert!(labels.insert(&entry.label), "{} stands for two actions", entry.label);
        for key in &entry.shortcuts {
            assert!(keys.insert(shortcut_text(key)), "{} means two actions", shortcut_text(key));
        }
    }
    assert!(keys.len() > 20);
}

#[test]
fn a_submenu_stands_once_in_its_menu() {
    let mut submenus = HashSet::new();
    let place = |entry: &commands::Entry| (entry.category, entry.group, entry.submenu);
    for run in commands::entries().chunk_by(|a, b| place(a) == place(b)) {
        let (category, _, name) = place(&run[0]);
        assert!(name.is_empty() || submenus.insert((category, name)), "{name} stands twice in {}", category.label());
    }
    assert!(submenus.len() > 10, "{submenus:?}");
}

/// `UPDATE_KEYS=1 cargo test --test interface keys` writes the page again.
#[test]
fn the_page_of_keys_is_up_to_date() {
    let mut page = "# Keys and mouse\n\nIn the window `F1` lists them, and `Ctrl+P` finds any command by typing. The keys of a\ncommand stand beside it in its menu.\n".to_owned();
    for (heading, rows) in commands::keys() {
        write!(page, "\n## {heading}\n\n| keys | effect |\n|---|---|\n").unwrap();
        for (keys, effect) in rows {
            writeln!(page, "| {keys} | {effect} |").unwrap();
        }
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/keys.md");
    if std::env::var_os("UPDATE_KEYS").is_some() {
        std::fs::write(path, &page).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == page, "docs/keys.md is out of date: UPDATE_KEYS=1 writes it again");
}

#[test]
fn arrows_turn_the_camera_only_while_the_viewport_has_the_focus() {
    let mut h = harness(state(Shading::Lit));
    let eye = |h: &Harness<'static, AppState>| h.state().wanted.camera.eye;
    let before = eye(&h);
    h.key_press(Key::ArrowRight);
    h.run_steps(2);
    assert_eq!(eye(&h), before);
    h.state_mut().layout.viewport_focused = true;
    h.key_press(Key::ArrowRight);
    h.run_steps(2);
    assert_ne!(eye(&h), before);
    h.key_press(Key::ArrowLeft);
    h.run_steps(2);
    assert!(eye(&h).distance(before) < 1e-4);
}

#[test]
fn a_key_zooms_to_the_hovered_point() {
    let mut h = harness(state(Shading::Lit));
    let target = h.state().wanted.camera.target;
    h.key_press(Key::Plus);
    h.run_steps(2);
    assert_eq!(h.state().wanted.camera.target, target, "without a pointer it zooms to the target");
    let hover = HoveredPixel { x_px: 200, y_px: 400, primitive: None, distance: f32::INFINITY, value: None };
    h.state_mut().selection.hover = Some(hover);
    let distance = h.state().wanted.camera.distance();
    h.key_press(Key::Plus);
    h.run_steps(2);
    let camera = h.state().wanted.camera;
    assert!(camera.distance() < distance && camera.target.distance(target) > 1e-3);
    h.key_press(Key::Minus);
    h.run_steps(2);
    assert!(h.state().wanted.camera.target.distance(target) < 1e-3, "the other key goes back");
}

#[test]
fn threshold_keys_leave_other_builders_alone() {
    let mut s = state(Shading::Lit);
    s.wanted.build.builder = BuilderKind::Lbvh;
    let build = s.wanted.build;
    let mut h = harness(s);
    h.key_press(Key::CloseBracket);
    h.run_steps(2);
    assert_eq!(h.state().wanted.build, build);
    assert!(!Action::LowerThreshold.is_enabled(h.state()));
    h.state_mut().wanted.build.builder = BuilderKind::Aac;
    h.key_press(Key::CloseBracket);
    h.run_steps(2);
    assert_eq!(h.state().wanted.build.threshold, build.threshold + 1);
}
