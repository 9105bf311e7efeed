//! The dock: its tabs, the outline of the tree, and findings.

use bvhscope::app::commands::{Action, shared_state};
use bvhscope::lab::population::Population;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

use crate::harness::{Window, app, app_of_size, presented, press, send, settle, two, viewport};

/// The row of a node in the outline, by the beginning of its name. The list beside it has rows of nodes too.
fn row<'a>(harness: &'a Window, start: &str) -> Option<egui_kittest::Node<'a>> {
    harness
        .query_all_by_role(Role::ListItem)
        .filter(|row| row.rect().left() < 100.0)
        .find(|row| row.accesskit_node().label().unwrap_or_default().starts_with(start))
}

#[test]
fn one_view_is_open_at_a_time() {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F9);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Nodes"));
    assert!(harness.query_by_label("Outline").is_some());
    harness.get_by_role_and_label(Role::Tab, "Paper").click();
    settle(&mut harness);
    assert!(harness.query_by_label("Outline").is_none() && harness.query_by_label("Measure").is_some());
    press(&mut harness, Modifiers::NONE, Key::F11);
    assert_eq!(harness.state().state.preferences.dock.open, None, "its key closes it again");
}

#[test]
fn the_outline_selects_and_follows() {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F9);
    row(&harness, "node 1, ").unwrap().click();
    settle(&mut harness);
    assert_eq!(harness.state().state.selection.nodes.selected, Some(1));

    let first = presented(&harness).table.children(1).start;
    assert!(row(&harness, &format!("node {first}, ")).is_none(), "folded");
    harness.get_by_label("Unfold node 1").click();
    settle(&mut harness);
    row(&harness, &format!("node {first}, ")).unwrap().hover();
    harness.run_steps(2);
    assert_eq!(harness.state().state.selection.nodes.hovered, Some(first), "what is pointed at lights up everywhere");

    let leaf = (0..presented(&harness).table.len() as u32).rev().find(|&node| presented(&harness).table.is_leaf(node));
    harness.state_mut().state.selection.nodes.selected = leaf;
    settle(&mut harness);
    let shown = row(&harness, &format!("leaf {}, ", leaf.unwrap()));
    assert!(shown.is_some(), "unfolded down to the selected leaf");
}

#[test]
fn findings_are_examined_when_asked_for() {
    let mut harness = app_of_size(vec2(1100.0, 1500.0));
    let known =
        |harness: &Window| harness.state().state.model.derived.findings.get(&presented(harness).accel, &()).cloned();
    assert!(known(&harness).is_none(), "nothing is examined while the section is folded");
    harness.get_by_label("Findings section").click();
    settle(&mut harness);
    let findings = known(&harness).unwrap();
    assert_eq!(harness.query_all_by_label_contains("Show me").count(), findings.len());
}

/// Every caption is true of what the program measures, whatever the machine.
#[test]
fn the_numbers_of_the_lessons_are_true() {
    let mut harness = app();
    let own = harness.state().state.wanted.clone();
    let mut wrong = Vec::new();
    for index in 0..harness.state().state.layout.lessons.len() {
        Action::Lesson(index).perform(&mut harness.state_mut().state);
        let lesson = harness.state().state.layout.lessons[index].clone();
        for (step, content) in lesson.steps.iter().enumerate() {
            settle(&mut harness);
            settle(&mut harness);
            let reading = harness.state().state.layout.lesson.as_ref().unwrap();
            let place = format!("{}, step {}: {}", lesson.title, step + 1, reading.caption());
            assert_eq!(reading.step, step);
            let (Some(now), before) = reading.numbers() else { panic!("{place}: nothing was measured") };
            assert!(!reading.caption().contains('…'), "{place}");
            assert!(!content.checks.is_empty(), "{place}: nothing is checked");
            let fails = content.checks.iter().filter(|check| check.holds(now, before) != Some(true));
            wrong.extend(fails.map(|check| format!("{place}: {}", check.text())));
            let range = harness.state().state.wanted.render.heat_range;
            assert_eq!(range, content.state.wanted.render.heat_range, "{place}: steps that share a range keep it");
            let [drawn, _] = <[usize; 2]>::from(harness.state().state.layout.graphics.overlay_counts());
            assert_eq!(drawn > 0, content.state.show_containers, "{place}: {drawn} containers are drawn");
            Action::LessonNext.perform(&mut harness.state_mut().state);
        }
        settle(&mut harness);
        assert!(harness.state().state.layout.lesson.is_none());
        assert_eq!(harness.state().state.wanted, own, "the reader's own settings come back");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_lesson_stands_below_the_picture_which_keeps_its_size() {
    let mut harness = app_of_size(vec2(1280.0, 800.0));
    harness.state_mut().state.preferences.dock.show("Nodes");
    Action::Lesson(0).perform(&mut harness.state_mut().state);
    let mut pictures = Vec::new();
    for _ in 0..harness.state().state.layout.lesson.as_ref().unwrap().lesson.steps.len() {
        settle(&mut harness);
        let picture = viewport(&harness);
        for label in ["Back", "What a tree saves"] {
            let place = harness.get_by_label(label).rect();
            assert!(!place.intersects(picture), "{label} at {place} covers the picture at {picture}");
        }
        pictures.push(picture);
        Action::LessonNext.perform(&mut harness.state_mut().state);
    }
    assert!(pictures.iter().all(|picture| picture == &pictures[0]), "{pictures:?}");
}

#[test]
fn a_copied_state_shows_the_same_in_another_window() {
    let mut harness = app();
    let state = &mut harness.state_mut().state;
    state.wanted.build.threshold = 17;
    state.wanted.camera.eye.x += 0.5;
    settle(&mut harness);
    let [first, second] = two(presented(&harness).table.children(0));
    let state = &mut harness.state_mut().state;
    state.select_node(first);
    state.selection.nodes.hidden.insert(second);
    state.preferences.dock.show("Nodes");
    let viewport_px = state.layout.viewport_px;
    state.take_ray(viewport_px.map(|side| side / 2));
    (state.model.derived.population, state.model.cut.left) = (Population::Bounce, Some(12));
    settle(&mut harness);
    let picture = harness.state().state.model.shared_picture();
    let (line, wanted) = (shared_state(&harness.state().state).line(), harness.state().state.wanted.clone());

    let mut other = app();
    send(&mut other, Event::Paste(line));
    settle(&mut other);
    let state = &other.state().state;
    assert_eq!(state.wanted, wanted);
    assert_eq!(state.preferences.dock.open.as_deref(), Some("Nodes"));
    assert_eq!(state.model.shared_picture(), picture, "the ray, the merge and the kind of rays");
    assert!(picture.ray.is_some());
    assert_eq!((state.selection.nodes.selected, state.selection.nodes.hidden.contains(&second)), (Some(first), true));

    send(&mut other, Event::Paste("rm -rf /".to_owned()));
    settle(&mut other);
    let state = &other.state().state;
    assert_eq!(state.wanted, wanted, "a line of something else changes nothing");
    assert!(state.messages.history.iter().any(|message| message.text.contains("no state of bvhscope")));
}
