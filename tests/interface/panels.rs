//! The panels without a window: widgets are found by their accessible names, operated, and the state is compared.

use std::path::PathBuf;

use crate::panel::{harness, present, press, sized, state, with_rows};
use bvhscope::app::commands::Action;
use bvhscope::app::state::paper::{Experiment, settings_of};
use bvhscope::app::state::{AppState, HelpPage, PickedTriangle, Request, Severity, Theme};
use bvhscope::render::{Exposure, HeatKind, Shading};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};

#[test]
fn the_paper_panel_names_its_widgets_and_fits_the_smallest_screen() {
    for experiment in Experiment::ALL {
        let mut s = state(Shading::Lit);
        with_rows(&mut s, experiment);
        let h = sized(s, 1024.0, 640.0, 2.0);
        let screen = h.ctx.content_rect();
        for label in ["Measure", "Save SVG", "Close dock", "Measured repeat", "Depth range"] {
            assert!(screen.contains_rect(h.get_by_label(label).rect()), "{label} lies outside");
        }
        let nameless = h.root().children_recursive().find(|node| {
            let node = node.accesskit_node();
            let acts = [Role::Button, Role::CheckBox, Role::SpinButton, Role::ComboBox].contains(&node.role());
            acts && node.label().or_else(|| node.value()).unwrap_or_default().trim().is_empty()
        });
        assert!(nameless.is_none(), "{}: {:?}", experiment.label(), nameless.map(|node| node.rect()));
    }
}

#[test]
fn the_paper_panel_switches_between_tables_and_plots() {
    let mut s = state(Shading::Lit);
    with_rows(&mut s, Experiment::Thresholds);
    let mut h = harness(s);
    assert!(h.query_by_label("Plot of Tests per entering ray").is_some());
    press(&mut h, "Tables");
    assert!(h.query_by_label("Plot of Tests per entering ray").is_none());
    assert_eq!(
        h.query_all_by_label_contains("δ 8").count(),
        6,
        "a row for the box and one for the sphere in each of three tables"
    );
    press(&mut h, "Close dock");
    assert_eq!(h.state().preferences.dock.open, None);
}

#[test]
fn tables_sort_and_a_double_click_builds_the_tree_of_a_row() {
    let mut s = state(Shading::Lit);
    with_rows(&mut s, Experiment::Builders);
    s.preferences.dock.height = 520.0;
    let result = s.activity.measured[&Experiment::Builders].clone();
    let mut h = harness(s);
    let table = &result.tables[0];
    let rows = |h: &Harness<'_, AppState>| {
        let items = h.query_all_by_role(Role::ListItem);
        let named = items.map(|node| (node.accesskit_node().label().unwrap_or_default(), node.rect()));
        let mut rows: Vec<_> =
            named.filter(|(name, _)| name.contains(", builder ") && name.contains(", SAH cost ")).collect();
        rows.sort_by(|a, b| a.1.top().total_cmp(&b.1.top()));
        // Those of the first table.
        rows.truncate(table.rows.len());
        rows
    };
    let number = |name: &str, column: &str| -> f64 {
        let rest = name.split(column).nth(1).expect("the column");
        rest.split(',').next().unwrap().trim().parse().expect("a number")
    };
    let costs =
        |h: &Harness<'_, AppState>| rows(h).iter().map(|(name, _)| number(name, ", SAH cost ")).collect::<Vec<_>>();
    assert!(!costs(&h).is_sorted(), "the fastest come first");
    // The column may lie beyond the edge of the dock.
    h.query_all_by_label("Sort by SAH cost").next().expect("a header").click_accesskit();
    h.run_steps(3);
    assert!(costs(&h).is_sorted(), "{:?}", costs(&h));
    // Another tree than the present one, in a row above the lower edge of the dock.
    let visible: Vec<_> = rows(&h).into_iter().filter(|(_, place)| place.bottom() < 600.0).collect();
    let present = h.state().wanted.build;
    let (build, place) = (0..table.rows.len())
        .find_map(|row| {
            let build = settings_of(&result.rows[table.sources[row]]).filter(|build| *build != present)?;
            let name = format!(", builder {}, container {},", table.rows[row][1], build.container.name());
            let (_, place) = visible.iter().find(|(text, _)| text.contains(&name))?;
            Some((build, *place))
        })
        .expect("another tree");
    let at = place.left_center() + egui::vec2(8.0, 0.0);
    h.hover_at(at);
    h.run_steps(1);
    for pressed in [true, false, true, false] {
        h.input_mut().events.push(crate::harness::button(at, egui::PointerButton::Primary, pressed));
    }
    h.run_steps(3);
    assert_eq!(h.state().wanted.build, build);
}

#[test]
fn presets_set_threshold_and_epsilon() {
    let mut h = harness(state(Shading::Lit));
    for preset in Preset::ALL.into_iter().rev() {
        choose(&mut h, "Preset", preset.label());
        let build = h.state().wanted.build;
        assert_eq!((build.threshold, build.epsilon), preset.parameters(), "{}", preset.label());
    }
}

#[test]
fn passes_are_toggled_and_disabled_for_spheres() {
    let mut h = harness(state(Shading::Lit));
    choose(&mut h, "Preset", Preset::Best.label());
    assert_eq!(h.state().wanted.build.optimize, Passes::FINISHED);
    let list = h.get_by_role_and_label(Role::ComboBox, "Passes");
    assert_eq!(list.accesskit_node().value().as_deref(), Some("Collapse, Restructure, Reinsert"));
    list.click();
    h.run_steps(4);
    h.get_by_role_and_label(Role::CheckBox, Pass::Split.label()).click();
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.optimize, Passes::FINISHED.with(Pass::Split));
    assert!(h.query_by_role_and_label(Role::Slider, "Rounds").is_none(), "nothing anneals");
    h.get_by_role_and_label(Role::CheckBox, Pass::Anneal.label()).click();
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.optimize, Passes::ALL);
    assert!(h.query_by_role_and_label(Role::Slider, "Rounds").is_some());
    for pass in Passes::ALL.iter() {
        h.get_by_role_and_label(Role::CheckBox, pass.label()).click();
        h.run_steps(3);
        assert_eq!(h.state().wanted.build.optimize, Passes::ALL.without(pass));
        h.get_by_role_and_label(Role::CheckBox, pass.label()).click();
        h.run_steps(3);
        assert_eq!(h.state().wanted.build.optimize, Passes::ALL);
    }
    h.get_by_role_and_label(Role::RadioButton, ContainerKind::Sphere.label()).click();
    h.run_steps(3);
    // The click beside the list has closed it.
    h.get_by_role_and_label(Role::ComboBox, "Passes").click();
    h.run_steps(4);
    for pass in Passes::ALL.iter() {
        let disabled = h.get_by_role_and_label(Role::CheckBox, pass.label()).accesskit_node().is_disabled();
        assert_eq!(disabled, pass.boxes_only(), "{}", pass.label());
    }
    assert_eq!(h.state().wanted.build.passes(), Passes::NONE.with(Pass::Collapse));
    choose(&mut h, "Preset", Preset::Fast.label());
    assert_eq!(h.state().wanted.build.optimize, Passes::NONE, "the paper's tree stays as it is");
}

#[test]
fn an_arrow_key_moves_the_focused_threshold() {
    let mut h = harness(state(Shading::Lit));
    let before = h.state().wanted.build.threshold;
    h.get_by_role_and_label(Role::Slider, "Threshold δ").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    let after = h.state().wanted.build.threshold;
    assert!(after > before, "{before} became {after}");
    h.key_press(Key::ArrowLeft);
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.threshold, before);
}

#[test]
fn reset_restores_the_tree_settings() {
    let mut s = state(Shading::Lit);
    s.wanted.build.threshold = 40;
    s.wanted.build.container = ContainerKind::Sphere;
    s.wanted.threads = 1;
    let mut h = harness(s);
    press(&mut h, "Reset tree settings");
    assert_eq!(h.state().wanted.build, BuildSettings::default());
    assert_eq!(h.state().wanted.threads, 0);
}

#[test]
fn the_radio_chooses_the_container() {
    let mut h = harness(state(Shading::Lit));
    let (oriented, boxes) = (ContainerKind::Oriented, ContainerKind::Aabb);
    for kind in [ContainerKind::Sphere, oriented, ContainerKind::Dop14, oriented, boxes] {
        h.get_by_role_and_label(Role::RadioButton, kind.label()).click();
        h.run_steps(3);
        let build = h.state().wanted.build;
        assert_eq!((build.tree_container(), build.container), (kind, if kind == oriented { boxes } else { kind }));
        assert_eq!(build.optimize.contains(Pass::Orient), kind == oriented);
    }
}

/// Opens a drop-down list and chooses a value.
fn choose(h: &mut Harness<'static, AppState>, list: &str, value: &str) {
    h.get_by_role_and_label(Role::ComboBox, list).click();
    h.run_steps(4);
    press(h, value);
}

#[test]
fn a_list_closes_by_return_and_by_a_press_beside_it() {
    let mut h = harness(state(Shading::Lit));
    let is_open = |h: &Harness<'static, AppState>| h.query_by_label(BuilderKind::Exact.label()).is_some();
    h.get_by_role_and_label(Role::ComboBox, "Builder").click();
    h.run_steps(4);
    assert!(is_open(&h));
    h.get_by_label(BuilderKind::Lbvh.label()).focus();
    h.run_steps(2);
    h.key_press(Key::Enter);
    h.run_steps(4);
    assert_eq!((h.state().wanted.build.builder, is_open(&h)), (BuilderKind::Lbvh, false));
    h.get_by_role_and_label(Role::ComboBox, "Builder").click();
    h.run_steps(4);
    assert!(is_open(&h));
    let pos = egui::pos2(500.0, 300.0);
    let press = egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed: true,
        modifiers: Modifiers::NONE,
    };
    h.input_mut().events.push(press);
    h.run_steps(4);
    assert!(!is_open(&h));
}

#[test]
fn unavailable_settings_are_disabled() {
    let mut s = state(Shading::Lit);
    s.wanted.build.container = ContainerKind::Sphere;
    let refused = BuildSettings { builder: BuilderKind::BinnedSah, ..s.wanted.build };
    assert!(refused.refusal(100).is_some());
    let mut h = harness(s);
    h.get_by_role_and_label(Role::ComboBox, "Builder").click();
    h.run_steps(4);
    assert!(h.get_by_label(BuilderKind::BinnedSah.label()).accesskit_node().is_disabled());
    assert!(!h.get_by_label(BuilderKind::Lbvh.label()).accesskit_node().is_disabled());
    press(&mut h, BuilderKind::Lbvh.label());
    assert_eq!(h.state().wanted.build.builder, BuilderKind::Lbvh);
}

#[test]
fn the_list_of_shadings_chooses_one() {
    let mut h = harness(state(Shading::Lit));
    // Below the settings of the tree, which take up most of the panel.
    h.get_by_role_and_label(Role::ComboBox, "Shading").scroll_to_me();
    h.run_steps(4);
    choose(&mut h, "Shading", Shading::Clusters.label());
    assert_eq!(h.state().wanted.render.shading, Shading::Clusters);
    assert!(h.query_by_role_and_label(Role::Slider, "Cluster depth").is_some());
}

#[test]
fn the_job_strip_counts_the_passes_that_a_mode_takes() {
    for (shading, text) in [(Shading::Heat(HeatKind::Both), "pass 1 of 1 "), (Shading::Lit, "pass 16 of 16 ")] {
        let mut s = state(shading);
        s.wanted.render.samples = 16;
        let scene = s.model.loaded.clone().unwrap();
        present(&mut s, &scene);
        let h = harness(s);
        assert!(h.query_by_label_contains(text).is_some(), "{}: no '{text}'", shading.label());
    }
}

#[test]
fn software_rendering_is_reported_once() {
    for (software, times) in [(true, 1), (false, 0)] {
        let mut state = state(Shading::Lit);
        state.layout.graphics.adapter_name = "llvmpipe".to_owned();
        state.layout.graphics.is_software = software;
        let harness = harness(state);
        assert_eq!(harness.query_all_by_label_contains("software rendering").count(), times);
    }
}

#[test]
fn arrow_keys_move_the_depth_range() {
    let mut h = harness(state(Shading::Lit));
    let before = h.state().wanted.overlay.depth;
    h.get_by_label("Depth range").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    assert_ne!(h.state().wanted.overlay.depth, before);
    let [from, to] = h.state().drawn_depths();
    assert!(from <= to);
}

#[test]
fn displaying_a_number_does_not_round_it() {
    let mut s = state(Shading::Lit);
    // Finer than the slider's last digit, and beyond the ends of the sliders.
    s.wanted.build.epsilon = 0.125;
    s.wanted.render.samples = 1000;
    s.wanted.threads = 700;
    let wanted = s.wanted.clone();
    let mut h = harness(s);
    assert_eq!(h.state().wanted, wanted);
    let shown = |h: &Harness<'static, AppState>, name: &str| h.get_by_label(name).accesskit_node().value();
    assert_eq!(shown(&h, "Reduction ε value").as_deref(), Some("0.125"));
    assert_eq!(shown(&h, "Threads value").as_deref(), Some("700"));
    h.get_by_role_and_label(Role::Slider, "Reduction ε").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    let epsilon = h.state().wanted.build.epsilon;
    assert!((epsilon * 100.0 - (epsilon * 100.0).round()).abs() < 1e-3 && epsilon > 0.125, "{epsilon}");
    assert_eq!(h.state().wanted.render, wanted.render);
}

#[test]
fn the_panels_keep_their_width() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.wanted.build.epsilon = 0.125;
    s.wanted.render.samples = 1000;
    s.wanted.threads = 1000;
    let mut h = harness(s);
    let before = h.get_by_role_and_label(Role::Slider, "Threshold δ").rect();
    h.run_steps(10);
    assert_eq!(h.get_by_role_and_label(Role::Slider, "Threshold δ").rect(), before);
}

#[test]
fn a_double_click_resets_a_slider() {
    let mut s = state(Shading::Lit);
    s.wanted.build.threshold = 40;
    let mut h = harness(s);
    let pos = h.get_by_role_and_label(Role::Slider, "Threshold δ").rect().center();
    h.hover_at(pos);
    h.run_steps(2);
    // In one frame, because a frame of the harness takes longer than a double click may.
    for pressed in [true, false, true, false] {
        let button = egui::PointerButton::Primary;
        let event = egui::Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        h.input_mut().events.push(event);
    }
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.threshold, BuildSettings::default().threshold);
}

#[test]
fn the_mouse_drags_a_range_of_depths() {
    let mut s = state(Shading::Lit);
    s.wanted.overlay.depth = Some([0, 0]);
    let max_depth = s.model.presented.as_ref().unwrap().accel.tree.max_depth();
    let mut h = harness(s);
    let bar = h.get_by_label("Depth range").rect();
    let at = |share: f32| egui::pos2(bar.left() + bar.width() * share, bar.center().y);
    h.drag_at(at(0.4));
    h.run_steps(2);
    h.hover_at(at(0.6));
    h.run_steps(2);
    h.drop_at(at(0.6));
    h.run_steps(2);
    let [from, to] = h.state().drawn_depths();
    assert!(from > 0 && from < to && to < max_depth, "{from} to {to} of {max_depth}");
    assert!((from as f32 / max_depth as f32 - 0.4).abs() < 0.15 && (to as f32 / max_depth as f32 - 0.6).abs() < 0.15);
}

#[test]
fn fit_fixes_the_heat_range_and_auto_frees_it() {
    let mut h = sized(state(Shading::Heat(HeatKind::Both)), 1280.0, 900.0, 1.0);
    assert_eq!(h.state().wanted.render.heat_range, None);
    press(&mut h, "Fit");
    let fitted = h.state().model.presented.as_ref().unwrap().frame.fitted_range(&CancelToken::new()).unwrap();
    assert_eq!(h.state().wanted.render.heat_range, Some(fitted));
    // The depth bar has another button of this name.
    let heat = h.get_all_by_label("Auto").min_by(|a, b| a.rect().top().total_cmp(&b.rect().top()));
    heat.unwrap().click();
    h.run_steps(3);
    assert_eq!(h.state().wanted.render.heat_range, None);
}

#[test]
fn the_mouse_drags_the_ends_of_the_heat_range() {
    let mut h = sized(state(Shading::Heat(HeatKind::Both)), 1280.0, 900.0, 1.0);
    let rect = h.get_by_label_contains("Histogram of tests").rect();
    let drag = |h: &mut Harness<'static, AppState>, from: f32, to: f32| {
        let at = |share: f32| egui::pos2(rect.left() + rect.width() * share, rect.center().y);
        h.drag_at(at(from));
        h.run_steps(2);
        h.hover_at(at(to));
        h.run_steps(2);
        h.drop_at(at(to));
        h.run_steps(2);
        h.state().wanted.render.heat_range.expect("a dragged range is fixed")
    };
    let [low, high] = drag(&mut h, 0.9, 0.5);
    let [same, lower] = drag(&mut h, 0.5, 0.4);
    assert!(lower < high && same == low, "{low} to {high} became {same} to {lower}");
    let [higher, same] = drag(&mut h, 0.02, 0.2);
    assert!(higher > low && same == lower, "{low} to {lower} became {higher} to {same}");
}

#[test]
fn every_shading_but_the_lit_one_has_a_legend() {
    for shading in Shading::ALL {
        let mut s = state(shading);
        s.selection.nodes.selected = Some(0);
        let h = harness(s);
        let picture = h.query_by_label_contains("Legend. Picture: ");
        assert_eq!(picture.is_some(), shading != Shading::Lit, "{}", shading.label());
        assert!(h.query_by_label_contains("selected, children, hovered").is_some());
    }
}

#[test]
fn messages_can_be_read_again() {
    let mut s = state(Shading::Lit);
    s.messages.notify(Severity::Error, "broken.obj:12: not a face");
    let mut h = harness(s);
    press(&mut h, "Close message");
    assert!(h.query_by_label("broken.obj:12: not a face").is_none());
    h.key_press(Key::F2);
    h.run_steps(3);
    assert!(h.query_by_label("broken.obj:12: not a face").is_some());
    press(&mut h, "Copy all");
    assert_eq!(h.state().activity.requests, [Request::Copy("Error: broken.obj:12: not a face".to_owned())]);
    h.key_press(Key::Escape);
    h.run_steps(3);
    assert!(!h.state().layout.messages_open);
}

#[test]
fn the_greeting_leads_to_the_start_page() {
    let mut s = state(Shading::Lit);
    s.preferences.greeted = false;
    let mut h = harness(s);
    press(&mut h, "Open a model…");
    assert!(h.state().layout.start_page_open && !h.state().preferences.greeted);
    assert!(h.query_by_label("Open a file…").is_some());
}

#[test]
fn messages_are_copied_and_closed_by_name() {
    let mut s = state(Shading::Lit);
    s.messages.notify(Severity::Error, "broken.obj:12: not a face");
    let mut h = harness(s);
    press(&mut h, "Copy message");
    assert_eq!(h.state().activity.requests, [Request::Copy("broken.obj:12: not a face".to_owned())]);
    press(&mut h, "Close message");
    assert!(h.state().messages.open.is_empty());
}

#[test]
fn every_widget_has_a_name() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.selection.nodes.selected = Some(5);
    s.selection.picked = Some(PickedTriangle { primitive: 17, path: vec![0, 1, 5] });
    s.preferences.greeted = false;
    s.messages.notify(Severity::Error, "broken.obj:12: not a face");
    let h = harness(s);
    let mut seen = 0;
    for node in h.root().children_recursive() {
        let node = node.accesskit_node();
        let acts = [
            Role::Button,
            Role::CheckBox,
            Role::RadioButton,
            Role::Slider,
            Role::SpinButton,
            Role::ComboBox,
            Role::TextInput,
        ];
        if acts.contains(&node.role()) {
            seen += 1;
            let name = node.label().or_else(|| node.value()).unwrap_or_default();
            assert!(!name.trim().is_empty(), "{:?} at {:?} has no name", node.role(), node.bounding_box());
        }
    }
    assert!(seen > 30, "{seen} widgets");
}

#[test]
fn zero_threads_read_as_all() {
    let h = harness(state(Shading::Lit));
    let number = h.get_by_label("Threads value");
    assert_eq!(number.accesskit_node().value().as_deref(), Some("all"));
}

/// The harness panics on characters that no font contains, so every text of these windows is covered.
#[test]
fn every_window_fits_the_smallest_screen() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.preferences.theme = Theme::Light;
    s.preferences.recent = vec![PathBuf::from("models/conference.obj")];
    s.layout.start_page_open = true;
    let mut h = sized(s, 1024.0, 640.0, 2.0);
    let screen = h.ctx.content_rect();
    for label in ["Open a file…", "conference.obj", "Depth range", "Reset tree settings", "File"] {
        assert!(screen.contains_rect(h.get_by_label(label).rect()), "{label} lies outside");
    }
    h.state_mut().layout.start_page_open = false;
    h.state_mut().layout.toggle_help(HelpPage::Shortcuts);
    h.run_steps(3);
    assert!(screen.contains_rect(h.get_by_label("Zoom to the point under the pointer").rect()));
    h.state_mut().layout.help = None;
    h.state_mut().layout.palette = Some("pre".to_owned());
    h.run_steps(3);
    assert!(screen.contains_rect(h.get_by_label("Command").rect()));
}

#[test]
fn the_exposure_is_locked_as_metered_and_metered_again() {
    let mut s = state(Shading::Lit);
    let shown = s.model.presented.as_mut().unwrap();
    std::sync::Arc::make_mut(&mut shown.frame).exposure_stops = 1.234;
    Action::LockExposure.perform(&mut s);
    assert_eq!(s.wanted.render.exposure, Exposure::Fixed(1.23));
    assert_eq!((Action::LockExposure.is_on(&s), Action::LockExposure.is_enabled(&s)), (Some(true), true));
    let mut h = harness(s);
    h.get_by_role_and_label(Role::Slider, "Stops").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    assert_eq!(h.state().wanted.render.exposure, Exposure::Fixed(1.3));
    Action::LockExposure.perform(h.state_mut());
    assert_eq!(h.state().wanted.render.exposure, Exposure::Auto);
    assert!(!Action::LockExposure.is_enabled(&state(Shading::Depth)));
}

/// The contents of a panel must not be wider than the panel, which would grow with them.
#[test]
fn the_side_panels_open_at_their_default_widths() {
    let harness = crate::harness::app();
    let rect = crate::harness::viewport(&harness);
    let widths = [rect.left(), 1100.0 - rect.right()];
    assert!((widths[0] - 248.0).abs() < 1.5 && (widths[1] - 288.0).abs() < 1.5, "{widths:?}");
}
