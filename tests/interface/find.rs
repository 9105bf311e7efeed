//! Going to a node or triangle by its number, and back to views before.

use crate::harness::{Window, app, camera, drag, presented, press, settle, viewport};
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;

/// Types a number into the field that Ctrl+G opens.
fn go_to(harness: &mut Window, text: &str) {
    press(harness, Modifiers::COMMAND, Key::G);
    harness.get_by_label("Number").type_text(text);
    settle(harness);
    press(harness, Modifiers::NONE, Key::Enter);
}

#[test]
fn numbers_lead_to_nodes_and_triangles() {
    let mut harness = app();
    let before = camera(&harness);
    go_to(&mut harness, "node 12");
    assert_eq!(harness.state().state.selection.nodes.selected, Some(12));
    assert_ne!(camera(&harness), before, "it is framed");
    assert!(harness.query_by_label("Number").is_none(), "the field is closed");
    go_to(&mut harness, "t45");
    let picked = harness.state().state.selection.picked.clone().expect("picked");
    assert_eq!(picked.primitive, 45);
    assert_eq!(harness.state().state.selection.nodes.selected, picked.path.last().copied());

    let (nodes, threshold) = (presented(&harness).table.len(), harness.state().state.wanted.build.threshold);
    go_to(&mut harness, &nodes.to_string());
    let last = bvhscope::text::count(nodes as u64 - 1);
    let fault = format!("Out of range: nodes 0 to {last}, triangles 0 to ");
    assert!(harness.query_by_label_contains(&fault).is_some(), "{fault}");
    // Keys are those of the field.
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    assert_eq!(harness.state().state.wanted.build.threshold, threshold);
    assert_eq!(harness.state().state.selection.picked, Some(picked));
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert!(harness.query_by_label("Number").is_none());
}

#[test]
fn backspace_goes_back_to_views_before() {
    let mut harness = app();
    let first = camera(&harness);
    let from = viewport(&harness).center();
    drag(&mut harness, PointerButton::Primary, from, &[vec2(30.0, 0.0), vec2(30.0, 9.0), vec2(-9.0, 9.0)]);
    let dragged = camera(&harness);
    press(&mut harness, Modifiers::NONE, Key::Num7);
    let top = camera(&harness);
    assert!(first != dragged && dragged != top);
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(camera(&harness), dragged);
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(camera(&harness), first, "the drag was one move");
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(camera(&harness), first);
    press(&mut harness, Modifiers::SHIFT, Key::Backspace);
    press(&mut harness, Modifiers::SHIFT, Key::Backspace);
    assert_eq!(camera(&harness), top);
    // Settings have an undo of their own.
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(camera(&harness), dragged);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(camera(&harness), dragged);
    // A text field keeps the key.
    press(&mut harness, Modifiers::COMMAND, Key::P);
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(camera(&harness), dragged);
}
