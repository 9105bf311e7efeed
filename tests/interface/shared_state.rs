//! The line that Ctrl+L copies, pasted over another window.

use std::sync::Arc;

use bvhscope::app::commands::{Action, shared_state};
use bvhscope::app::state::SharedState;
use bvhscope::app::state::paper::Experiment;
use bvhscope::app::state::picture_cut::CutKind;
use bvhscope::app::views::icicle::IcicleView;
use bvhscope::app::views::nodes::NodesView;
use bvhscope::scene::Instancing;
use bvhscope::visibility::TriangleSet;
use bvhscope_engine::construction::Cut;
use egui::{Event, Key, Modifiers};

use crate::harness::{Window, app, app_of_copies, presented, send, settle};

/// The line that the window copies.
fn line(harness: &mut Window) -> String {
    let (key, modifiers) = (Key::L, Modifiers::COMMAND);
    send(harness, Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
    for _ in 0..4 {
        for command in &harness.output().platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                return text.clone();
            }
        }
        harness.run_steps(1);
    }
    panic!("nothing is copied")
}

/// Another window in which the line was pasted.
fn pasted(line: &str) -> Window {
    let mut harness = app();
    send(&mut harness, Event::Paste(line.to_owned()));
    settle(&mut harness);
    harness
}

#[test]
fn zoom_unfolded_nodes_and_experiment_are_shown_in_the_other_window() {
    let mut first = app();
    let shown = presented(&first);
    let state = &mut first.state_mut().state;
    state.views.get_mut::<IcicleView>().zoom_in_tree(&shown.accel, 2);
    state.views.get_mut::<NodesView>().outline.unfold(&shown.accel, &shown.table, [0, 1, 2].into());
    state.preferences.paper.choose(Experiment::Threads);
    (state.preferences.paper.repeat, state.preferences.paper.side_px) = (5, 256);
    settle(&mut first);
    let line = line(&mut first);
    let second = pasted(&line);
    let state = &second.state().state;
    assert_eq!(state.views.get::<IcicleView>().top(), 2);
    assert_eq!(state.views.get::<NodesView>().outline.unfolded(&presented(&second).accel), [0, 1, 2].into());
    assert_eq!(shared_state(state), shared_state(&first.state().state), "{line}");
}

/// Flat, the other window would show the same triangles in a tree with other nodes.
#[test]
fn copies_have_the_same_form_and_unfolded_ones_in_the_other_window() {
    let mut first = app_of_copies();
    first.state_mut().state.wanted.unfolded = [3, 4, 11].into_iter().collect();
    settle(&mut first);
    let node = presented(&first).accel.node_of_copy(11).expect("the root of its mesh");
    first.state_mut().state.select_node(node);
    settle(&mut first);
    let line = line(&mut first);
    let second = pasted(&line);
    let (own, other) = (presented(&first).accel.clone(), presented(&second).accel.clone());
    assert!(other.scene.copies.is_some());
    assert_eq!((&other.tree, &other.scene.unfolded.ranges), (&own.tree, &own.scene.unfolded.ranges));
    assert_eq!(second.state().state.selection.nodes.selected, Some(node));
    assert_eq!(shared_state(&second.state().state), shared_state(&first.state().state), "{line}");
    // Over the same model in the other form, too.
    Action::ShowCopies(Instancing::Flat).perform(&mut first.state_mut().state);
    settle(&mut first);
    assert!(presented(&first).accel.scene.copies.is_none());
    send(&mut first, Event::Paste(line));
    settle(&mut first);
    assert_eq!(presented(&first).accel.scene.unfolded.ranges, other.scene.unfolded.ranges);
    assert_eq!(first.state().state.selection.nodes.selected, Some(node));
}

#[test]
fn triangles_that_are_shown_alone_are_so_in_the_other_window() {
    let mut first = app();
    let count = presented(&first).accel.scene.triangles.len();
    let only = TriangleSet::from_ranges(&[[5, 9], [40, 40]], count);
    first.state_mut().state.selection.nodes.only = Some(Arc::new(only.clone()));
    first.state_mut().state.wanted.overlay.hide_triangles = true;
    settle(&mut first);
    let line = line(&mut first);
    let mut second = pasted(&line);
    let state = &second.state().state;
    assert_eq!(state.selection.nodes.only.as_deref(), Some(&only));
    assert_eq!(state.hidden_triangles().expect("all others").len(), count - 6);
    let seen = |harness: &Window| presented(harness).frame.primitive.clone();
    assert!(seen(&second).iter().all(|&hit| hit == u32::MAX || only.contains(hit)));
    assert_eq!(seen(&second), seen(&first));

    // The line of a window without shows all again.
    let all = self::line(&mut app());
    send(&mut second, Event::Paste(all));
    settle(&mut second);
    assert!(second.state().state.selection.nodes.only.is_none());
}

#[test]
fn a_cut_is_shown_in_the_other_window() {
    let mut first = app();
    first.state_mut().state.preferences.dock.show("Merges");
    let merges = &mut first.state_mut().state.model.cut;
    (merges.cut_kind, merges.cut_triangles) = (CutKind::Triangles, 33);
    settle(&mut first);
    let line = line(&mut first);
    assert_eq!(SharedState::parse(&line).unwrap().picture.cut, Some(Cut::Primitives(33)));
    let second = pasted(&line);
    let state = &second.state().state;
    assert_eq!(state.model.cut.wanted_cut(), Some(Cut::Primitives(33)));
    let nodes =
        |harness: &Window| harness.state().state.layout.graphics.standing.clone().expect("clusters").nodes.clone();
    assert_eq!(nodes(&second), nodes(&first));
}
