//! Hidden and isolated nodes: undone, and carried from tree to tree.

use std::sync::Arc;

use crate::harness::{Window, app, presented, press, settle};
use bvhscope::accel::Accel;
use bvhscope::visibility::{NodeIdentity, TriangleSet};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use egui::{Key, Modifiers};

fn hidden(harness: &Window) -> Vec<u32> {
    let mut nodes: Vec<u32> = harness.state().state.selection.nodes.hidden.iter().copied().collect();
    nodes.sort_unstable();
    nodes
}

fn messages(harness: &Window) -> String {
    harness.state().state.messages.history.iter().map(|message| message.text.clone() + "\n").collect()
}

#[test]
fn hiding_and_isolating_are_undone() {
    let mut harness = app();
    let selected = |harness: &mut Window, node| {
        harness.state_mut().state.selection.nodes.selected = Some(node);
        settle(harness);
    };
    selected(&mut harness, 3);
    press(&mut harness, Modifiers::NONE, Key::H);
    selected(&mut harness, 4);
    press(&mut harness, Modifiers::NONE, Key::H);
    press(&mut harness, Modifiers::ALT, Key::H);
    assert_eq!(hidden(&harness), [0_u32; 0]);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(hidden(&harness), [3, 4], "showing all is undone");
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    let now = |harness: &Window| (hidden(harness), harness.state().state.selection.nodes.selected);
    assert_eq!(now(&harness), (vec![3], Some(4)), "the selection comes back, too");
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(now(&harness), (vec![], Some(3)));
    press(&mut harness, Modifiers::COMMAND, Key::Y);
    assert_eq!(hidden(&harness), [3]);
    selected(&mut harness, 2);
    bvhscope::app::commands::Action::IsolateSelected.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!((hidden(&harness), harness.state().state.selection.nodes.isolated), (vec![], Some(2)));
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!((hidden(&harness), harness.state().state.selection.nodes.isolated), (vec![3], None));
}

/// Of two hidden nodes the other tree has one. The other is hidden again where the first tree comes back.
#[test]
fn hidden_nodes_survive_another_tree_where_it_has_them() {
    let mut harness = app();
    let first = presented(&harness).accel;
    let settings = BuildSettings { builder: BuilderKind::BinnedSah, ..first.settings };
    let other = Accel::build(&first.scene, &settings, &CancelToken::new()).unwrap();
    let found = |node: &u32| NodeIdentity::of(&first, *node).unwrap().find(&other);
    let all = 1..first.tree.node_count() as u32;
    let in_both = all.clone().find(|node| found(node).is_some()).expect("the trees share a node");
    let in_first = all.clone().find(|node| found(node).is_none()).expect("the trees differ");
    let mut both = [in_both, in_first];
    both.sort_unstable();
    harness.state_mut().state.selection.nodes.hidden.extend(both);
    settle(&mut harness);
    let picture = presented(&harness).frame;

    harness.state_mut().state.wanted.build.builder = BuilderKind::BinnedSah;
    settle(&mut harness);
    assert_eq!(hidden(&harness), [found(&in_both).unwrap()]);
    assert!(messages(&harness).contains("1 hidden node is not in this tree"), "{}", messages(&harness));
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!((hidden(&harness), harness.state().state.wanted.build), (both.to_vec(), first.settings));
    let again = presented(&harness).frame;
    assert_eq!(again.primitive, picture.primitive, "the same triangles are left out");
    // Another way of tracing keeps the tree, and with it the nodes.
    harness.state_mut().state.wanted.threads = 1;
    settle(&mut harness);
    assert_eq!(hidden(&harness), both);
    press(&mut harness, Modifiers::ALT, Key::H);
    assert!(harness.state().state.selection.hidden.is_empty());
}

#[test]
fn a_new_model_shows_all_and_undo_does_not_hide_in_it() {
    let mut harness = app();
    harness.state_mut().state.selection.nodes.hidden.insert(1);
    settle(&mut harness);
    assert!(harness.state().state.undo.can_undo());
    let source = bvhscope::scene::SceneSource::Builtin { name: "teapot".to_owned(), size: Some(3) };
    harness.state_mut().state.wanted.source = source;
    settle(&mut harness);
    assert_eq!(hidden(&harness), [0_u32; 0]);
    assert!(!harness.state().state.undo.can_undo(), "hiding was the only step");
}

/// As "show me" of a finding does; in the next tree too, and until it is undone.
#[test]
fn triangles_shown_alone_leave_all_others_out() {
    let mut harness = app();
    let visible = |harness: &Window| {
        let mut all: Vec<u32> = presented(harness).frame.primitive.to_vec();
        all.sort_unstable();
        all.dedup();
        all.retain(|&triangle| triangle != u32::MAX);
        all
    };
    let before = visible(&harness);
    let alone = before[before.len() / 2];
    let mut only = TriangleSet::none(presented(&harness).accel.scene.triangles.len());
    only.insert(alone);
    harness.state_mut().state.selection.nodes.only = Some(Arc::new(only));
    settle(&mut harness);
    assert_eq!(visible(&harness), [alone]);
    let leaf = *presented(&harness).accel.path_to(alone).last().unwrap();
    let visibility = presented(&harness).table.visibility(&harness.state().state.selection.nodes).unwrap();
    assert!(!visibility.hides(leaf) && !visibility.hides(0), "what holds it is shown");
    let nodes = presented(&harness).accel.tree.node_count() as u32;
    assert!((0..nodes).any(|node| visibility.hides(node)), "nodes that lack it are hidden");

    harness.state_mut().state.wanted.build.builder = BuilderKind::BinnedSah;
    settle(&mut harness);
    assert_eq!(visible(&harness), [alone], "in another tree too");
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(visible(&harness), before, "undone");
}
