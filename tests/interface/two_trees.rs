//! Two trees at one camera: the whole app adds, edits, swaps and removes the second one.

use std::sync::Arc;

use crate::harness::{Window, app, click, drag, pixel, presented, press, send, settle, viewport};
use bvhscope::app::commands::{Action, CompareStep};
use bvhscope::app::state::comparison::{Comparison, Verdict};
use bvhscope::app::state::{AppState, CompareView, Presented, TreeSide};
use bvhscope::catalog::numbers::rows::SAH_COST;
use bvhscope::overlay::{ColorBy, ColorScale};
use bvhscope::render::{HeatKind, Shading};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

fn state(harness: &mut Window) -> &mut AppState {
    &mut harness.state_mut().state
}

fn second(harness: &Window) -> Presented {
    harness.state().state.model.second.clone().unwrap()
}

fn perform(harness: &mut Window, step: CompareStep) {
    Action::Compare(step).perform(state(harness));
    settle(harness);
}

/// The app with LBVH as the second tree, in `view`.
fn with_second(view: CompareView) -> Window {
    let mut harness = app();
    press(&mut harness, Modifiers::COMMAND, Key::Num2);
    state(&mut harness).edited_build_mut().builder = BuilderKind::Lbvh;
    perform(&mut harness, CompareStep::View(view));
    harness
}

#[test]
fn a_second_tree_is_added_edited_swapped_and_removed() {
    let mut harness = app();
    let first = presented(&harness);
    assert!(harness.query_by_label("Tree A").is_none(), "one tree has no name");
    harness.get_by_label("Compare with a second tree").click();
    settle(&mut harness);
    assert_eq!(second(&harness).accel.settings, first.accel.settings, "B begins as A");
    assert_eq!(harness.state().state.edited_side(), TreeSide::B);

    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    let threshold = first.accel.settings.threshold;
    assert_eq!(second(&harness).accel.settings.threshold, threshold + 1, "keys change B");
    assert!(Arc::ptr_eq(&presented(&harness).accel, &first.accel), "A is not built again");
    assert!(Arc::ptr_eq(&presented(&harness).frame, &first.frame), "nor traced");

    harness.get_by_label("Tree A").click();
    settle(&mut harness);
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    let thresholds =
        |harness: &Window| [presented(harness), second(harness)].map(|shown| shown.accel.settings.threshold);
    assert_eq!(thresholds(&harness), [threshold + 2, threshold + 1]);
    let choose = |harness: &mut Window, what: &str| {
        harness.get_by_label("Both").click();
        settle(harness);
        harness.get_by_label(what).click();
        settle(harness);
    };
    choose(&mut harness, "Swap");
    assert_eq!(thresholds(&harness), [threshold + 1, threshold + 2]);
    choose(&mut harness, "Copy A to B");
    assert_eq!(thresholds(&harness), [threshold + 1; 2]);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(thresholds(&harness), [threshold + 1, threshold + 2], "undone");

    let tree = Arc::downgrade(&second(&harness).accel);
    choose(&mut harness, "Remove B");
    assert!(harness.state().state.model.second.is_none());
    assert_eq!(harness.state().state.edited_side(), TreeSide::A);
    // Memory is given back on a thread of its own.
    for _ in 0..500 {
        if tree.strong_count() == 0 {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("the second tree is still in memory");
}

#[test]
fn nothing_in_the_panel_moves_where_a_second_tree_or_oriented_boxes_appear() {
    let mut harness = app();
    let place = |harness: &Window| harness.get_by_role_and_label(Role::RadioButton, "Box").rect().top();
    let colors = |harness: &Window| harness.get_by_role_and_label(Role::ComboBox, "Colour by").rect().top();
    let before = [place(&harness), colors(&harness)];
    press(&mut harness, Modifiers::COMMAND, Key::Num2);
    assert_eq!([place(&harness), colors(&harness)], before);
    let build = &mut state(&mut harness).wanted.build;
    *build = build.for_container(ContainerKind::Oriented);
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.tree.container_kind(), ContainerKind::Oriented);
    assert_eq!([place(&harness), colors(&harness)], before);
}

#[test]
fn automatic_depths_count_the_containers_that_both_trees_have() {
    let mut harness = with_second(CompareView::Split);
    perform(&mut harness, CompareStep::OnlyCommon);
    for side in TreeSide::ALL {
        let state = &harness.state().state;
        let table = &state.shown_tree(side).unwrap().table;
        let survival = &state.survival().unwrap()[side as usize];
        let graphics = &state.layout.graphics;
        let shown = [&graphics.shown, &graphics.second_shown][side as usize].clone().unwrap();
        let [first, last] = table.drawn_depths(&state.overlay_of(table));
        let within = |node: &u32| (first..=last).contains(&table.depth(*node)) && survival.survives(*node);
        let expected = (0..table.len() as u32).filter(within).count();
        assert!(shown.nodes.len() == expected && (2..=200).contains(&expected), "{side:?}: {expected} of {shown:?}");
        assert!(shown.nodes.iter().all(|&node| survival.survives(node)));
    }
    let drawn = harness.state().state.layout.graphics.shown.clone().unwrap().nodes.len();
    assert!(harness.query_by_label_contains(&format!("· {drawn} containers")).is_some(), "the bar counts them too");
    // A level without any says why nothing is drawn, and how to go on.
    let counts = harness.state().state.survival().unwrap()[0].nodes_per_depth.clone();
    let empty = counts.iter().position(|&count| count == 0).expect("the trees differ at some level") as u32;
    state(&mut harness).wanted.overlay.depth = Some([empty; 2]);
    settle(&mut harness);
    assert!(harness.query_by_label("No container at these depths is in both trees.").is_some());
    assert!(harness.query_by_label_contains("Leaves start").is_none());
    harness.get_by_label("Choose other depths").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.overlay.depth, None);
    assert_eq!(harness.state().state.layout.graphics.shown.clone().unwrap().nodes.len(), drawn);
}

#[test]
fn a_difference_is_not_drowned_by_containers_unless_they_are_asked_for() {
    let mut harness = with_second(CompareView::Difference);
    let drawn = |harness: &Window| harness.state().state.layout.graphics.overlay_counts().0 > 0;
    assert!(!drawn(&harness));
    assert!(harness.query_by_label_contains("Containers are off over the difference").is_some());
    perform(&mut harness, CompareStep::View(CompareView::A));
    assert!(drawn(&harness), "they are on everywhere else");
    perform(&mut harness, CompareStep::View(CompareView::Difference));
    press(&mut harness, Modifiers::NONE, Key::B);
    assert!(drawn(&harness));
    press(&mut harness, Modifiers::NONE, Key::B);
    assert!(!drawn(&harness));
    perform(&mut harness, CompareStep::View(CompareView::Split));
    assert!(drawn(&harness));
}

#[test]
fn colours_tell_which_containers_the_other_tree_has() {
    let mut harness = with_second(CompareView::Split);
    state(&mut harness).wanted.overlay.color_by = ColorBy::Survival;
    settle(&mut harness);
    let state = &harness.state().state;
    let survival = state.survival().unwrap();
    let graphics = &state.layout.graphics;
    for (shown, survival) in [&graphics.shown, &graphics.second_shown].into_iter().zip(&**survival) {
        let shown = shown.as_ref().unwrap();
        let expected: Vec<f32> = shown.nodes.iter().map(|&node| f32::from(!survival.survives(node))).collect();
        assert_eq!((&shown.places, shown.colors), (&expected, ColorScale::Survival));
        assert_eq!(shown.span, [0.0, 1.0], "the root at least is in both");
    }
    assert!(harness.query_by_label_contains("Legend. Containers: in both trees?").is_some());
    // With one tree, those that its passes made.
    let mut harness = app();
    self::state(&mut harness).wanted.overlay.color_by = ColorBy::Survival;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Nothing to compare with").is_some());
    assert!(harness.query_by_label_contains("Legend. Containers: depth").is_some());
    self::state(&mut harness).wanted.build.builder = BuilderKind::Lbvh;
    self::state(&mut harness).wanted.build.optimize = Passes::NONE.with(Pass::Reinsert);
    self::state(&mut harness).wanted.overlay.depth = Some([0, 20]);
    settle(&mut harness);
    let shown = harness.state().state.layout.graphics.shown.clone().unwrap();
    assert_eq!((shown.span, shown.colors), ([0.0, 1.0], ColorScale::Survival));
    assert!(harness.query_by_label_contains("Legend. Containers: moved by the passes?: before them too").is_some());
}

#[test]
fn both_trees_are_traced_in_the_same_view() {
    let mut harness = with_second(CompareView::Split);
    for change in [0, 1, 2] {
        match change {
            0 => {}
            1 => state(&mut harness).wanted.camera.eye *= 1.2,
            _ => state(&mut harness).wanted.render.shading = Shading::Heat(HeatKind::Containers),
        }
        settle(&mut harness);
        let (a, b) = (presented(&harness), second(&harness));
        assert!(!Arc::ptr_eq(&a.accel, &b.accel) && b.accel.settings.builder == BuilderKind::Lbvh);
        assert_eq!((a.frame.camera, a.frame.settings), (b.frame.camera, b.frame.settings), "change {change}");
        assert_eq!([a.frame.coarseness, b.frame.coarseness], [1.0; 2]);
        assert_ne!(a.frame_id, b.frame_id);
        let wanted = &harness.state().state.wanted;
        assert_eq!((a.frame.camera, a.frame.settings.shading), (wanted.camera, wanted.render.shading));
    }
    assert!(harness.state().state.model.difference.is_none(), "it is not shown");
}

#[test]
fn the_difference_is_of_the_two_pictures_on_the_screen() {
    let mut harness = with_second(CompareView::Difference);
    for change in [0, 1, 2, 3] {
        match change {
            0 => {}
            1 => state(&mut harness).wanted.camera.eye *= 1.1,
            2 => state(&mut harness).wanted.build.threshold = 20,
            _ => state(&mut harness).wanted.second.as_mut().unwrap().build = BuildSettings::default(),
        }
        settle(&mut harness);
        let (a, b) = (presented(&harness), second(&harness));
        let map = harness.state().state.model.difference.clone().unwrap().map;
        assert!(Arc::ptr_eq(&map.frames[0], &a.frame) && Arc::ptr_eq(&map.frames[1], &b.frame), "change {change}");
        let expected: Vec<f32> = a.frame.values.iter().zip(&b.frame.values).map(|(a, b)| b - a).collect();
        assert_eq!(map.values, expected);
        assert!(a.frame.settings.shading == Shading::Heat(HeatKind::Both) && map.pixels[2] > 0);
    }
    let at = viewport(&harness).center();
    send(&mut harness, Event::PointerMoved(at));
    harness.run_steps(2);
    assert!(
        harness.query_by(|node| node.label().is_some_and(|label| label.contains("B − A: tests per pixel"))).is_some()
    );
    assert_eq!(harness.state().state.wanted.render.shading, Shading::Lit, "the shading comes back");
    perform(&mut harness, CompareStep::View(CompareView::B));
    assert_eq!(second(&harness).frame.settings.shading, Shading::Lit);
}

#[test]
fn numbers_of_both_trees_stand_side_by_side() {
    let mut harness = with_second(CompareView::Split);
    let (a, b) = (presented(&harness), second(&harness));
    let sah = [&a, &b].map(|shown| shown.accel.report.stats.sah_cost);
    assert!(sah[1] > sah[0], "LBVH is worse: {sah:?}");
    let compared = harness.state().state.model.compare(SAH_COST);
    let Comparison::Change { before, now, verdict: Verdict::Worse, .. } = compared else { panic!("{compared:?}") };
    assert_eq!([before, now].map(|cost| cost as f32), sah);
    let spoken = |name: &str| {
        let start = format!("{name} A ");
        let node = harness.get_by(|node| node.value().is_some_and(|text| text.starts_with(&start)));
        node.accesskit_node().value().unwrap()
    };
    let text = spoken("SAH cost");
    assert!(text.contains(", B ") && text.contains('+') && text.ends_with("worse"), "{text}");
    assert!(spoken("Nodes").contains("  B "), "{}", spoken("Nodes"));
    let survival = Arc::clone(harness.state().state.survival().unwrap());
    assert!(survival[0].nodes > 0 && survival[0].nodes < a.table.len());
    // The other way round as many: the same sets.
    assert_eq!(survival[0].nodes, survival[1].nodes);

    let drawn = |harness: &Window| harness.state().state.layout.graphics.shown.clone().unwrap().nodes.clone();
    let all = drawn(&harness);
    perform(&mut harness, CompareStep::OnlyCommon);
    let common: Vec<u32> = all.into_iter().filter(|&node| survival[0].survives(node)).collect();
    assert_eq!(drawn(&harness), common);
}

#[test]
fn the_seam_follows_mouse_and_keys() {
    let mut harness = with_second(CompareView::Split);
    let rect = viewport(&harness);
    let seam = |harness: &Window| harness.state().state.wanted.second.unwrap().seam;
    let camera = harness.state().state.wanted.camera;
    drag(&mut harness, PointerButton::Primary, rect.center(), &[vec2(rect.width() * 0.05, 0.0); 4]);
    assert!((seam(&harness) - 0.7).abs() < 0.01, "{}", seam(&harness));
    assert_eq!(harness.state().state.wanted.camera, camera, "the camera stays");
    let before = seam(&harness);
    press(&mut harness, Modifiers::NONE, Key::ArrowLeft);
    assert!((seam(&harness) - (before - 0.02)).abs() < 1e-4, "{}", seam(&harness));
    press(&mut harness, Modifiers::NONE, Key::Num2);
    assert_eq!(harness.state().state.wanted.second.unwrap().view, CompareView::Difference, "the next view");
}

#[test]
fn a_second_tree_that_cannot_be_built_leaves_the_first() {
    let mut harness = with_second(CompareView::Split);
    let before = second(&harness);
    state(&mut harness).wanted.second.as_mut().unwrap().build = BuildSettings {
        builder: BuilderKind::BinnedSah,
        container: bvhscope_engine::tree::ContainerKind::Sphere,
        ..BuildSettings::default()
    };
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.second.unwrap().build, before.accel.settings, "it goes back");
    let told =
        harness.state().state.messages.history.iter().any(|message| message.text.contains("Tree B cannot be built"));
    assert!(told);
}

/// The triangle that the second picture shows at a place of the window.
fn triangle_of_second(harness: &Window, at: egui::Pos2) -> u32 {
    let [x, y] = pixel(harness, at);
    let frame = second(harness).frame;
    frame.primitive[frame.index_of(x, y)]
}

#[test]
fn the_pointer_is_in_the_tree_whose_picture_it_is_over() {
    let mut harness = with_second(CompareView::Split);
    state(&mut harness).wanted.render.shading = Shading::Heat(HeatKind::Both);
    // Down to the leaves, of which both trees have some.
    state(&mut harness).wanted.overlay.depth = Some([4, 40]);
    settle(&mut harness);
    let survival = Arc::clone(harness.state().state.survival().unwrap());
    let center = viewport(&harness).center();
    let mut common = 0;
    // Not at the seam, which is a control.
    for step in 4..15 {
        let at = center + vec2(6.0 * step as f32, 2.0 * step as f32);
        harness.hover_at(at);
        harness.run_steps(3);
        let (a, b) = (presented(&harness), second(&harness));
        let selection = harness.state().state.selection.clone();
        let [x, y] = pixel(&harness, at);
        let hover = selection.hover.expect("over the picture");
        assert_eq!(hover.value, Some(b.frame.values[b.frame.index_of(x, y)]), "the tests of B");
        let path = b.accel.path_to(triangle_of_second(&harness, at));
        let [first, last] = b.table.drawn_depths(&harness.state().state.wanted.overlay);
        let drawn = path.iter().take(last as usize + 1).skip(first as usize).last();
        assert_eq!(selection.second.hovered.as_ref(), drawn, "the deepest container that is drawn of B");
        let Some(node) = selection.second.hovered else { continue };
        // The same triangles are lit up in A, where it has such a node.
        match selection.nodes.hovered {
            Some(same) => assert_eq!(a.table.triangles_below(same), b.table.triangles_below(node)),
            None => assert!(!survival[1].survives(node)),
        }
        common += usize::from(selection.nodes.hovered.is_some());
    }
    assert!(common > 0, "no node was of both trees");
    let at = center - vec2(30.0, 0.0);
    harness.hover_at(at);
    harness.run_steps(3);
    let selection = &harness.state().state.selection;
    let a = presented(&harness);
    let node = selection.nodes.hovered.expect("a container of A");
    let [x, y] = pixel(&harness, at);
    assert!(a.accel.path_to(a.frame.primitive[a.frame.index_of(x, y)]).contains(&node));
    assert_eq!(selection.second.hovered.is_some(), survival[0].survives(node));
}

#[test]
fn a_node_of_the_second_tree_is_selected_walked_from_and_kept() {
    let mut harness = with_second(CompareView::Split);
    let at = viewport(&harness).center() + vec2(30.0, 10.0);
    let triangle = triangle_of_second(&harness, at);
    click(&mut harness, at);
    let b = second(&harness);
    let path = b.accel.path_to(triangle);
    let selected = |harness: &Window| harness.state().state.selection.second.selected;
    assert_eq!(selected(&harness), path.last().copied());
    let of_a = presented(&harness).accel.path_to(triangle).last().copied();
    assert_eq!(harness.state().state.selection.nodes.selected, of_a, "A's leaf of the same triangle");
    assert!(harness.query_by_label("leaf of B").is_some(), "the panel says whose node it is");

    for up in (1..path.len()).rev().take(3) {
        press(&mut harness, Modifiers::ALT, Key::ArrowUp);
        assert_eq!(selected(&harness), Some(path[up - 1]), "Alt+Up walks in B");
    }
    press(&mut harness, Modifiers::ALT, Key::ArrowDown);
    let node = path[path.len() - 3];
    assert_eq!(selected(&harness), Some(node), "and down to the triangle again");
    let before = harness.state().state.wanted.camera;
    press(&mut harness, Modifiers::NONE, Key::F);
    assert_ne!(harness.state().state.wanted.camera, before, "it is framed");

    // Another builder of A leaves what is selected in B; the same tree built again has it too.
    state(&mut harness).wanted.build.threshold = 17;
    settle(&mut harness);
    assert_eq!((selected(&harness), harness.state().state.selection.side), (Some(node), TreeSide::B));
    state(&mut harness).wanted.second.as_mut().unwrap().build.builder = BuilderKind::BinnedSah;
    settle(&mut harness);
    let other = second(&harness);
    let found = selected(&harness).expect("the same node or the triangle's leaf");
    assert!(other.accel.path_to(triangle).contains(&found));

    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!(selected(&harness), None);
    assert!(harness.state().state.selection.nodes.selected.is_none());

    // A node selected in another view is of A, and lights up in B where B has it.
    state(&mut harness).select_node(0);
    settle(&mut harness);
    assert_eq!((selected(&harness), harness.state().state.selection.side), (Some(0), TreeSide::A));
    perform(&mut harness, CompareStep::Toggle);
    assert_eq!(selected(&harness), None, "there is no second tree");
}
