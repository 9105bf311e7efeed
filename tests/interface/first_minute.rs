//! The first minute: the tour, the glossary, the dialog about the program, menus in low windows, empty views.

use std::sync::Arc;

use crate::panel::{harness, present, press, sized, state};
use bvhscope::app::commands::{Action, Category};
use bvhscope::app::state::{AppState, HelpPage, Request, Severity, THUMBNAIL_SIZE, Thumbnail};
use bvhscope::catalog::terms;
use bvhscope::render::{HeatKind, Shading};
use bvhscope::scene::{Scene, SceneSource};
use bvhscope_engine::geometry::Triangle;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::Vec3;

fn first_start() -> AppState {
    let mut s = state(Shading::Lit);
    (s.preferences.greeted, s.preferences.toured) = (false, false);
    s
}

#[test]
fn the_tour_points_at_three_controls_and_covers_none_of_them() {
    let mut h = harness(first_start());
    let places = [
        (None, "Depth range", "Drag along this bar"),
        (Some(Role::Slider), "Threshold δ", "Drag the threshold"),
        (Some(Role::ComboBox), "Shading", "Choose a heat map"),
    ];
    for (index, (role, name, text)) in places.into_iter().enumerate() {
        assert_eq!(h.state().layout.tour, Some(index));
        let button = if index < 2 { "Next" } else { "Show the heat map" };
        let card = h.get_by_label_contains(text).rect().union(h.get_by_label(button).rect()).expand(10.0);
        let control = match role {
            Some(role) => h.get_by_role_and_label(role, name).rect(),
            None => h.get_by_label(name).rect(),
        };
        assert!(!card.intersects(control), "{name}: {card} covers {control}");
        assert!(h.ctx.content_rect().contains_rect(card));
        assert!(!h.state().preferences.toured, "a tour that was broken off comes back");
        if index == 0 {
            h.key_press(Key::Enter);
            h.run_steps(3);
        } else {
            press(&mut h, button);
        }
    }
    assert_eq!(h.state().layout.tour, None);
    assert_eq!(h.state().wanted.render.shading, Shading::Heat(HeatKind::Both));
    h.run_steps(3);
    assert!(h.query_by_label("Tour").is_none() && h.query_by_label("Got it").is_none());
}

#[test]
fn the_tour_points_at_nothing_that_is_scrolled_away() {
    let mut h = sized(first_start(), 1280.0, 400.0, 1.0);
    h.state_mut().layout.tour = Some(2);
    h.run_steps(3);
    let card = h.get_by_label_contains("Choose a heat map").rect();
    let panel = h.get_by_role_and_label(Role::Slider, "Threshold δ").rect();
    assert!(panel.left() - card.right() > 200.0, "{card} is beside the panel of {panel} instead of in the middle");
}

#[test]
fn the_tour_is_skipped_by_esc_and_does_not_come_back_by_itself() {
    let mut h = harness(first_start());
    assert_eq!(h.state().layout.tour, Some(0));
    h.key_press(Key::Escape);
    h.run_steps(3);
    assert!(h.state().layout.tour.is_none() && h.state().preferences.toured);
    let mut s = first_start();
    s.preferences = h.state().preferences.clone();
    let mut h = harness(s);
    assert_eq!(h.state().layout.tour, None);
    Action::Tour.perform(h.state_mut());
    h.run_steps(3);
    assert!(h.query_by_label("Tour").is_some(), "the menu starts it again");
}

#[test]
fn the_tour_waits_until_an_error_was_read() {
    let mut s = first_start();
    s.messages.notify(Severity::Error, "bunny.obj: no such file");
    let mut h = harness(s);
    assert!(h.query_by_label("Tour").is_none() && h.query_by_label_contains("no such file").is_some());
    h.state_mut().messages.open.clear();
    h.run_steps(3);
    assert!(h.query_by_label("Tour").is_some());
}

#[test]
fn the_start_page_shows_recent_models_before_the_built_in_ones() {
    let mut s = state(Shading::Lit);
    s.preferences.recent = vec!["/models/conference.obj".into()];
    s.layout.thumbnails.insert(
        SceneSource::File("/models/conference.obj".into()),
        Thumbnail { rgba: vec![[200, 90, 10, 255]; (THUMBNAIL_SIZE[0] * THUMBNAIL_SIZE[1]) as usize] },
    );
    s.layout.start_page_open = true;
    let mut h = harness(s);
    let (recent, builtin) = (h.get_by_label("conference.obj").rect(), h.get_by_label("Utah teapot").rect());
    assert!(recent.top() < builtin.top() && recent.size() == builtin.size());
    press(&mut h, "conference.obj");
    assert_eq!(h.state().activity.requests, [Request::Open(SceneSource::File("/models/conference.obj".into()))]);
}

#[test]
fn the_path_typed_before_is_replaced_by_typing() {
    let mut s = state(Shading::Lit);
    s.layout.path_field.text = "builtin:foliage".to_owned();
    let mut h = harness(s);
    h.key_press_modifiers(Modifiers::COMMAND, Key::N);
    h.run_steps(3);
    h.input_mut().events.push(egui::Event::Text("abc".to_owned()));
    h.run_steps(2);
    assert_eq!(h.state().layout.path_field.text, "abc");
}

#[test]
fn no_tooltip_lies_over_a_dialog_or_an_error() {
    let tip = "Groups of fewer triangles are clustered";
    let shows = |change: fn(&mut AppState)| {
        let mut h = harness(state(Shading::Lit));
        let at = h.get_by_role_and_label(Role::Slider, "Threshold δ").rect().center();
        h.hover_at(at);
        h.run_steps(60);
        let before = h.query_by_label_contains(tip).is_some();
        change(h.state_mut());
        h.run_steps(4);
        (before, h.query_by_label_contains(tip).is_some())
    };
    assert_eq!(shows(|_| {}), (true, true), "the pointer rests on the slider");
    assert_eq!(shows(|state| state.layout.start_page_open = true), (true, false));
}

#[test]
fn a_number_leads_to_its_term() {
    let mut h = harness(state(Shading::Lit));
    let tile = h.get_by(|node| node.value().is_some_and(|text| text.starts_with("SAH cost "))).rect();
    h.hover_at(tile.center());
    for pressed in [true, false] {
        let button = egui::PointerButton::Secondary;
        let event = egui::Event::PointerButton { pos: tile.center(), button, pressed, modifiers: Modifiers::NONE };
        h.input_mut().events.push(event);
        h.run_steps(2);
    }
    press(&mut h, "What is “SAH cost”?");
    let help = h.state().layout.help.clone().unwrap();
    assert_eq!((help.page, help.term), (HelpPage::Glossary, Some(terms::SAH_COST)));
    assert!(h.query_by_label(terms::SAH_COST.text).is_some());
}

#[test]
fn help_filters_both_pages() {
    let mut h = harness(state(Shading::Lit));
    h.key_press(Key::F1);
    h.run_steps(3);
    assert!(h.query_by_label("Undo").is_some());
    h.get_by_label("Filter").focus();
    h.run_steps(2);
    h.get_by_label("Filter").type_text("wheel");
    h.run_steps(3);
    assert!(h.query_by_label("Undo").is_none());
    assert!(h.query_by_label("Zoom to the point under the pointer").is_some());
    h.state_mut().layout.help.as_mut().unwrap().filter = "Karras".to_owned();
    press(&mut h, "Terms");
    assert!(h.query_by_label("EPO").is_some() && h.query_by_label("Cache line").is_none());
}

#[test]
fn the_dialog_about_the_program_copies_what_it_shows() {
    let mut s = state(Shading::Lit);
    (s.layout.graphics.adapter_name, s.layout.graphics.backend) = ("llvmpipe".to_owned(), "Vulkan".to_owned());
    s.layout.about_open = true;
    let mut h = harness(s);
    press(&mut h, "Copy");
    let [Request::Copy(text)] = &h.state().activity.requests[..] else { panic!("{:?}", h.state().activity.requests) };
    for part in
        [env!("CARGO_PKG_VERSION"), "llvmpipe, Vulkan", "SIMD level: ", "Threads: ", "Memory: ", "MIT or Apache"]
    {
        assert!(text.contains(part), "{part} is missing in {text}");
    }
}

#[test]
fn menus_stay_in_low_windows_and_tick_what_is_on() {
    for (width, height) in [(1280.0, 720.0), (640.0, 480.0)] {
        for category in Category::ALL {
            let mut h = sized(state(Shading::Lit), width, height, 1.0);
            press(&mut h, category.label());
            h.run_steps(4);
            let screen = h.ctx.content_rect();
            let items = h
                .root()
                .children_recursive()
                .filter(|node| [Role::MenuItem, Role::MenuItemCheckBox].contains(&node.accesskit_node().role()));
            let tops: Vec<f32> = items.map(|item| item.rect().right()).collect();
            assert!(!tops.is_empty() && tops.iter().all(|right| *right <= screen.right()), "{}", category.label());
        }
    }
    let mut h = sized(state(Shading::Lit), 640.0, 300.0, 1.0);
    press(&mut h, "View");
    let last = |h: &Harness<'static, AppState>| h.get_by_label("Right panel").rect();
    let below = last(&h).bottom();
    h.hover_at(egui::pos2(last(&h).left() + 100.0, 200.0));
    h.run_steps(2);
    for _ in 0..20 {
        h.input_mut().events.push(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Line,
            delta: egui::vec2(0.0, -20.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
            modifiers: Modifiers::NONE,
        });
        h.run_steps(4);
    }
    assert!(below > 300.0 && last(&h).bottom() <= 300.0, "{below} became {}", last(&h).bottom());
}

#[test]
fn a_fixed_heat_range_is_given_up_with_what_it_was_fitted_to() {
    let changes: [fn(&mut AppState); 3] = [
        |s| s.wanted.source = SceneSource::default_builtin(),
        |s| s.wanted.render.shading = Shading::Heat(HeatKind::Containers),
        |s| s.wanted.render.traversal = bvhscope_engine::tree::traverse::Traversal::Paper,
    ];
    for change in changes {
        let mut s = state(Shading::Heat(HeatKind::Both));
        s.wanted.render.heat_range = Some([0.0, 134.0]);
        let mut h = harness(s);
        h.state_mut().wanted.render.shading = Shading::Lit;
        h.run_steps(2);
        h.state_mut().wanted.render.shading = Shading::Heat(HeatKind::Both);
        h.run_steps(2);
        assert_eq!(h.state().wanted.render.heat_range, Some([0.0, 134.0]), "another mode in between keeps it");
        change(h.state_mut());
        h.run_steps(2);
        assert_eq!(h.state().wanted.render.heat_range, None);
        assert!(h.state().messages.history.back().is_some_and(|message| message.text.contains("heat range")));
    }
}

#[test]
fn a_model_without_surface_says_so() {
    let mut s = state(Shading::Lit);
    let point = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::X * 0.5 };
    let scene = Arc::new(Scene::from_triangles(SceneSource::File("line.obj".into()), vec![point]));
    s.wanted.camera.eye = Vec3::new(0.0, 3.0, 0.3);
    present(&mut s, &scene);
    let h = harness(s);
    let texts = h.output().shapes.iter().filter_map(|shape| match &shape.shape {
        egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
        _ => None,
    });
    let texts: Vec<String> = texts.collect();
    assert!(texts.iter().any(|text| text == "This model has no surface"), "{texts:?}");
    assert!(texts.iter().any(|text| text.ends_with("· 1 triangle")), "{texts:?}");
}
