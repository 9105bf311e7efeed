//! Hiding and isolating nodes, the section plane, and the way out where nothing is drawn.

use bvhscope::app::commands::{Action, SectionStep};
use bvhscope::render::Shading;
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;

use crate::harness::{Window, app, button, drag, presented, press, send, settle, two, viewport};

fn act(harness: &mut Window, action: Action) {
    action.perform(&mut harness.state_mut().state);
    settle(harness);
}

fn hits(harness: &Window) -> usize {
    presented(harness).frame.primitive.iter().filter(|&&triangle| triangle != u32::MAX).count()
}

fn counts(harness: &Window) -> (usize, usize) {
    harness.state().state.layout.graphics.overlay_counts()
}

#[test]
fn hiding_takes_the_subtree_its_triangles_and_its_containers() {
    let mut harness = app();
    let (hits_before, counts_before) = (hits(&harness), counts(&harness));
    let [first, second] = two(presented(&harness).table.children(0));
    harness.state_mut().state.selection.nodes.selected = Some(first);
    press(&mut harness, Modifiers::NONE, Key::H);
    assert_eq!(harness.state().state.selection.nodes.selected, None);
    assert!(hits(&harness) < hits_before, "triangles are missing in the picture");
    assert!(counts(&harness).1 < counts_before.1, "containers below are missing");
    let visibility = presented(&harness).table.visibility(&harness.state().state.selection.nodes).unwrap();
    assert!(presented(&harness).frame.primitive.iter().all(|&triangle| !visibility.triangles.contains(triangle)));

    harness.get_by_label("With triangles").click();
    settle(&mut harness);
    assert_eq!(hits(&harness), hits_before, "only the containers are hidden");
    act(&mut harness, Action::ToggleHideTriangles);
    press(&mut harness, Modifiers::ALT, Key::H);
    assert_eq!((hits(&harness), counts(&harness)), (hits_before, counts_before));

    harness.state_mut().state.selection.nodes.selected = Some(second);
    press(&mut harness, Modifiers::NONE, Key::I);
    let isolated = (hits(&harness), counts(&harness));
    press(&mut harness, Modifiers::ALT, Key::H);
    harness.state_mut().state.selection.nodes.selected = Some(first);
    press(&mut harness, Modifiers::NONE, Key::H);
    assert_eq!(hits(&harness), isolated.0, "isolating one child hides the other");
    press(&mut harness, Modifiers::ALT, Key::H);
    harness.state_mut().state.selection.nodes.selected = Some(second);
    press(&mut harness, Modifiers::SHIFT, Key::H);
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!((hits(&harness), harness.state().state.selection.nodes.selected), (isolated.0, None));
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!(hits(&harness), hits_before, "the second Esc shows all again");
}

#[test]
fn a_second_button_opens_the_menu_of_the_node() {
    let mut harness = app();
    let at = viewport(&harness).center() + vec2(-20.0, 10.0);
    let open = |harness: &mut Window| {
        harness.hover_at(at);
        harness.run_steps(1);
        for pressed in [true, false] {
            send(harness, button(at, PointerButton::Secondary, pressed));
        }
        harness.run_steps(3);
    };
    open(&mut harness);
    let node = harness.state().state.selection.nodes.selected.expect("the container under the pointer");
    let [_, last] = harness.state().state.drawn_depths();
    assert!(presented(&harness).table.depth(node) <= last, "as drawn");
    harness.get_by_label_contains("Select parent").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.selection.nodes.selected, presented(&harness).table.parent(node));
    assert!(harness.query_by_label_contains("Copy as text").is_none(), "the menu has closed");
    open(&mut harness);
    assert_eq!(
        harness.state().state.selection.nodes.selected,
        presented(&harness).table.parent(node),
        "what holds the triangle stays selected"
    );
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert!(harness.query_by_label_contains("Copy as text").is_none());
    // A drag with the same button pans.
    let camera = harness.state().state.wanted.camera;
    drag(&mut harness, PointerButton::Secondary, at, &[vec2(30.0, 0.0)]);
    assert!(harness.state().state.wanted.camera != camera && harness.state().state.layout.node_menu.is_none());
}

#[test]
fn the_section_plane_is_switched_dragged_flipped_and_snapped() {
    let mut harness = app();
    let whole = hits(&harness);
    press(&mut harness, Modifiers::NONE, Key::X);
    let plane = harness.state().state.wanted.render.section.unwrap();
    assert_eq!(plane.axis(), Some(0));
    assert!(hits(&harness) < whole);
    let handle = harness.get_by_label("Section plane").rect().center();
    drag(&mut harness, PointerButton::Primary, handle, &[vec2(20.0, 0.0), vec2(20.0, 0.0)]);
    let dragged = harness.state().state.wanted.render.section.unwrap();
    assert!(dragged.offset > plane.offset, "to the right along x: {} from {}", dragged.offset, plane.offset);
    assert_eq!(harness.state().state.wanted.camera, presented(&harness).frame.camera, "the camera stays");
    press(&mut harness, Modifiers::SHIFT, Key::X);
    assert_eq!(harness.state().state.wanted.render.section.unwrap().flipped, !dragged.flipped);
    act(&mut harness, Action::Section(SectionStep::Facing));
    assert_eq!(harness.state().state.wanted.render.section.unwrap().axis(), None);
    act(&mut harness, Action::Section(SectionStep::Snap));
    assert_eq!(harness.state().state.wanted.render.section.unwrap().axis(), Some(2), "seen from the front");
    press(&mut harness, Modifiers::CTRL, Key::Z);
    assert_eq!(harness.state().state.wanted.render.section.unwrap().axis(), None, "undone");
    harness.state_mut().state.wanted.render.shading = Shading::Lit;
    press(&mut harness, Modifiers::NONE, Key::X);
    assert_eq!(hits(&harness), whole);
}

#[test]
fn where_nothing_is_drawn_there_is_a_way_out() {
    let mut harness = app();
    let state = &mut harness.state_mut().state;
    state.wanted.overlay.leaves_only = true;
    state.wanted.overlay.depth = Some([0, 1]);
    settle(&mut harness);
    assert_eq!(counts(&harness), (0, 0));
    let [first, last] = presented(&harness).table.leaf_depths().unwrap();
    assert!(harness.query_by_label(&format!("Leaves start at depth {first}.")).is_some());
    harness.get_by_label("Show them").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.overlay.depth, Some([first, last]));
    assert!(counts(&harness).0 > 0 && harness.query_by_label("Show them").is_none());
    harness.state_mut().state.selection.nodes.hidden.insert(0);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("depths are hidden").is_some());
}
