//! The view "Plots" and the kinds of rays by which visits are measured.

use crate::harness::{Window, app, copied, double_click, presented, press, settle};
use crate::panel;
use bvhscope::app::state::paper::Experiment;
use bvhscope::app::state::{AppState, Request};
use bvhscope::app::views::plots::{PlotKind, PlotsView, TreeQuality, TreeSet};
use bvhscope::lab::plot::{PlotFormat, draw};
use bvhscope::lab::population::Population;
use bvhscope::lab::visit_scatter::VisitScatter;
use bvhscope::render::{Light, Shading};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, Rect, pos2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

fn open() -> Window {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F10);
    settle(&mut harness);
    harness
}

fn state(harness: &mut Window) -> &mut AppState {
    &mut harness.state_mut().state
}

fn scatter(harness: &Window) -> std::sync::Arc<VisitScatter> {
    let accel = presented(harness).accel;
    harness.state().state.views.get::<PlotsView>().scatter.of_tree(&accel).expect("measured").clone()
}

/// The trees in the plots, by their accessible names.
fn trees(harness: &Window) -> Vec<(String, Rect)> {
    let nodes = harness.query_all_by_role(Role::Button);
    let named = nodes.map(|node| (node.accesskit_node().label().unwrap_or_default(), node.rect()));
    named.filter(|(name, _)| name.contains(": built in ")).collect()
}

/// Where a place of the scatter, from the left and from below, is on the screen: the root at its upper right is at 1, 1.
fn at(harness: &Window, place: [f64; 2]) -> Pos2 {
    let rect = harness.get_by_label_contains("Plot of measured").rect();
    let plot = Rect::from_min_max(rect.min + egui::vec2(46.0, 18.0), rect.max - egui::vec2(10.0, 30.0));
    pos2(plot.left() + plot.width() * place[0] as f32, plot.bottom() - plot.height() * place[1] as f32)
}

#[test]
fn its_key_opens_and_closes_it_and_only_an_open_one_measures() {
    let mut harness = app();
    let accel = presented(&harness).accel;
    assert!(harness.state().state.model.derived.visits.of_tree(&accel).is_none());
    press(&mut harness, Modifiers::NONE, Key::F10);
    settle(&mut harness);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Plots"));
    assert!(scatter(&harness).shown > 50);
    assert!(harness.query_by_label_contains("rays enter the root").is_some(), "the counts are on the screen");
    press(&mut harness, Modifiers::NONE, Key::F10);
    assert_eq!(harness.state().state.preferences.dock.open, None);
}

#[test]
fn a_node_in_the_scatter_lights_up_is_selected_and_framed() {
    let mut harness = open();
    let found = scatter(&harness);
    let worst = found.worst[0];
    let place = at(&harness, found.place(&worst).expect("in the plot"));
    harness.hover_at(place);
    harness.run_steps(3);
    assert_eq!(harness.state().state.selection.nodes.hovered, Some(worst.node));
    let before = harness.state().state.wanted.camera;
    double_click(&mut harness, place);
    assert_eq!(harness.state().state.selection.nodes.selected, Some(worst.node));
    assert_ne!(harness.state().state.wanted.camera, before, "looked at");
    harness.hover_at(at(&harness, [0.02, 0.9]));
    harness.run_steps(3);
    assert_eq!(harness.state().state.selection.nodes.hovered, None, "nothing is there");
}

#[test]
fn the_kind_of_rays_is_chosen_once_for_all_views() {
    let mut harness = open();
    let primary = scatter(&harness).sums.clone();
    assert_eq!(primary.population, Population::Primary);
    let mut seen = vec![primary.cost];
    for population in [Population::Shadow, Population::AmbientOcclusion, Population::Bounce, Population::Random] {
        harness.get_by_role_and_label(Role::ComboBox, "Rays").click();
        harness.run_steps(2);
        harness.get_by_role_and_label(Role::Button, population.label()).click();
        settle(&mut harness);
        let sums = scatter(&harness).sums.clone();
        assert_eq!(sums.population, population);
        assert!(!seen.contains(&sums.cost) && sums.root_hits > 0, "{population:?}");
        seen.push(sums.cost);
    }
    let accel = presented(&harness).accel;
    let random = seen[4] / f64::from(accel.report.stats.sah_cost);
    assert!((random - 1.0).abs() < 0.05, "{random}");

    harness.get_by_role_and_label(Role::Tab, "Nodes").click();
    settle(&mut harness);
    assert_eq!(
        harness.get_by_role_and_label(Role::ComboBox, "Rays").accesskit_node().value().as_deref(),
        Some("Random lines")
    );
    let visits = harness.state().state.model.derived.known_visits(&accel).expect("measured").0;
    assert_eq!(f64::from(visits.root_hits()), f64::from(visits.rays), "those lines go through the root");
}

#[test]
fn a_view_without_shadow_rays_says_why() {
    let mut harness = open();
    state(&mut harness).wanted.render.light = Light::Headlight;
    settle(&mut harness);
    harness.get_by_label("Measure this view").click();
    state(&mut harness).model.derived.population = Population::Shadow;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("The headlight is at the eye").is_some());
}

#[test]
fn trees_of_the_session_are_plotted_and_built_again_by_a_click() {
    let mut harness = open();
    for threshold in [4, 20, 40] {
        state(&mut harness).wanted.build.threshold = threshold;
        settle(&mut harness);
    }
    harness.get_by_label(PlotKind::Speed.label()).click();
    settle(&mut harness);
    let plotted = trees(&harness);
    assert_eq!(plotted.len(), 4, "{plotted:?}");
    assert!(plotted.iter().all(|(name, _)| name.contains("measured cost") && name.contains("by primary")));
    let (name, rect) = plotted.into_iter().find(|(name, _)| name.contains("δ 20 ")).expect("a tree of threshold 20");
    let before = presented(&harness).accel.report.stats.clone();
    harness.hover_at(rect.center());
    harness.run_steps(2);
    harness.get_by_label(&name).click();
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.build.threshold, 20);
    assert_ne!(presented(&harness).accel.report.stats, before);
    assert_eq!(trees(&harness).len(), 4, "the same tree is no new one");

    harness.get_by_label(PlotKind::Prediction.label()).click();
    settle(&mut harness);
    assert_eq!(trees(&harness).len(), 2 * 4, "each in both plots");
    assert!(harness.query_by_label_contains("Plot of Measured cost over SAH cost: r = ").is_some());
    assert!(harness.query_by_label_contains("Plot of Measured cost over EPO: ").is_some());

    let text = copied(&mut harness, "Copy");
    assert_eq!(text.lines().count(), 5, "{text}");
    assert!(text.lines().all(|line| line.split('\t').count() == 7), "{text}");
}

/// The rows of the list of trees, from above.
fn rows(harness: &Window) -> Vec<(String, Rect)> {
    let rows = harness.query_all_by_role(Role::ListItem);
    let named = rows.map(|row| (row.accesskit_node().label().unwrap_or_default(), row.rect()));
    let mut rows: Vec<_> = named.filter(|(name, _)| name.contains(", SAH cost ")).collect();
    rows.sort_by(|a, b| a.1.top().total_cmp(&b.1.top()));
    rows
}

#[test]
fn the_list_of_trees_measures_sorts_shows_and_compares() {
    let mut harness = app();
    for threshold in [20, 4] {
        state(&mut harness).wanted.build.threshold = threshold;
        settle(&mut harness);
    }
    state(&mut harness).views.get_mut::<PlotsView>().kind = PlotKind::List;
    press(&mut harness, Modifiers::NONE, Key::F10);
    settle(&mut harness);
    assert_eq!(rows(&harness).len(), 3);
    assert!(rows(&harness)[0].0.contains("Tests – entering ray"), "{:?}", rows(&harness));
    harness.get_by_label("Measure all 3").click();
    settle(&mut harness);
    let measured = rows(&harness);
    assert!(measured.iter().all(|(name, _)| !name.contains('–')), "{measured:?}");
    assert!(!harness.state().state.views.get::<PlotsView>().measures_all);
    let accel = presented(&harness).accel;
    let rays = harness.state().state.model.derived.rays(&accel.scene);
    let trees = harness.state().state.views.get::<PlotsView>().session.plotted(rays);
    let shown = trees.iter().find(|tree| tree.is(&accel)).expect("listed");
    let cost = scatter(&harness).sums.cost;
    assert!((shown.cost.expect("measured") - cost).abs() < 1e-9, "as where it is shown");

    harness.get_by_label("Sort by SAH cost").click();
    settle(&mut harness);
    let cost = |name: &str| trees.iter().find(|tree| name.starts_with(&tree.name())).expect("a tree").sah_cost;
    let costs = |harness: &Window| rows(harness).iter().map(|(name, _)| cost(name)).collect::<Vec<_>>();
    assert!(costs(&harness).is_sorted(), "{:?}", costs(&harness));
    harness.get_by_label("Sort by SAH cost").click();
    settle(&mut harness);
    assert!(costs(&harness).is_sorted_by(|a, b| a >= b), "the other way round");

    let place = |harness: &Window, part: &str| {
        rows(harness).into_iter().find(|(name, _)| name.contains(part)).expect("a row").1.center()
    };
    let at = place(&harness, "δ 20 ");
    crate::harness::click(&mut harness, at);
    harness.get_by_label("Put into B").click();
    settle(&mut harness);
    let threshold = |shown: &bvhscope::app::state::Presented| shown.accel.settings.threshold;
    assert_eq!(harness.state().state.model.second.as_ref().map(threshold), Some(20));
    assert_eq!(threshold(&presented(&harness)), 4);
    let at = place(&harness, "δ 6 ");
    double_click(&mut harness, at);
    settle(&mut harness);
    assert_eq!(threshold(&presented(&harness)), 6);
}

#[test]
fn trees_without_a_measured_cost_are_named_with_the_way_to_one() {
    let mut harness = app();
    for threshold in [4, 20] {
        state(&mut harness).wanted.build.threshold = threshold;
        settle(&mut harness);
    }
    press(&mut harness, Modifiers::NONE, Key::F10);
    for kind in [PlotKind::Speed, PlotKind::Prediction] {
        state(&mut harness).views.get_mut::<PlotsView>().kind = kind;
        settle(&mut harness);
        assert!(harness.query_by_label_contains("2 trees are not plotted: no measured cost").is_some(), "{kind:?}");
    }
    state(&mut harness).wanted.build.threshold = 4;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("1 tree is not plotted").is_some(), "showing one measures it");
    state(&mut harness).views.get_mut::<PlotsView>().kind = PlotKind::Speed;
    state(&mut harness).views.get_mut::<PlotsView>().quality = TreeQuality::SahCost;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("not plotted").is_none(), "the SAH cost of all is known");
}

#[test]
fn nodes_that_no_ray_visits_are_on_a_line_of_their_own() {
    let mut harness = open();
    state(&mut harness).model.derived.population = Population::Bounce;
    settle(&mut harness);
    let found = scatter(&harness);
    assert!(found.never > 0);
    let text = format!("{} never visited", bvhscope::app::format::counted(found.never as u64, "node"));
    assert!(harness.query_by_label_contains(&text).is_some(), "{text}");
    let never = found.cells.iter().map(|cell| cell.first).find(|node| node.measured == 0).expect("a node");
    harness.hover_at(at(&harness, found.place(&never).expect("in the plot")));
    harness.run_steps(3);
    let hovered = harness.state().state.selection.nodes.hovered.expect("a node lights up");
    let accel = presented(&harness).accel;
    let visits = harness.state().state.model.derived.known_visits(&accel).expect("measured").0;
    assert_eq!(visits.counts[hovered as usize], 0);
}

#[test]
fn builders_that_were_measured_are_plotted_with_their_front() {
    let mut harness = open();
    let plan = &mut state(&mut harness).preferences.paper;
    (plan.side_px, plan.repeat) = (256, 1);
    let plots = state(&mut harness).views.get_mut::<PlotsView>();
    (plots.kind, plots.set) = (PlotKind::Speed, TreeSet::Measured(Experiment::Builders));
    settle(&mut harness);
    assert!(harness.query_by_label_contains("were not measured yet").is_some());
    harness.get_by_label("Measure builders").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Plots"), "the view stays");
    let all = trees(&harness).len();
    let rows = &harness.state().state.activity.measured[&Experiment::Builders].rows;
    let of_boxes = rows.iter().filter(|row| row.container == ContainerKind::Aabb).count();
    assert!(all > 10 && all == of_boxes, "{all} of {of_boxes}: costs of other containers do not compare");
    assert!(harness.query_by_label_contains(" on the front").is_some());
    state(&mut harness).views.get_mut::<PlotsView>().quality = TreeQuality::SahCost;
    state(&mut harness).model.derived.population = Population::Random;
    state(&mut harness).views.get_mut::<PlotsView>().kind = PlotKind::Prediction;
    settle(&mut harness);
    let title = harness.get_by_label_contains("over SAH cost: r = ").accesskit_node().label().unwrap_or_default();
    let r: f64 = title.split_whitespace().skip_while(|word| *word != "=").nth(1).unwrap().parse().unwrap();
    assert!(r > 0.98, "the SAH predicts random lines: {title}");
}

#[test]
fn what_is_plotted_is_saved_as_a_picture() {
    let mut state = panel::state(Shading::Lit);
    panel::with_rows(&mut state, Experiment::Builders);
    state.preferences.dock.show("Plots");
    let plots = state.views.get_mut::<PlotsView>();
    (plots.kind, plots.set) = (PlotKind::Prediction, TreeSet::Measured(Experiment::Builders));
    let mut harness = panel::sized(state, 1280.0, 900.0, 1.0);
    panel::press(&mut harness, "PNG");
    let requests = &harness.state().activity.requests;
    let Some(Request::SavePlots(stem, plots)) = requests.iter().find(|r| matches!(r, Request::SavePlots(..))) else {
        panic!("{requests:?}")
    };
    assert!(stem.ends_with("-prediction"), "{stem}");
    let titles: Vec<&str> = plots.charts.iter().map(|plot| plot.title.as_str()).collect();
    assert!(titles.len() == 2 && titles.iter().all(|title| title.contains(" tree")), "{titles:?}");
    let picture = image::load_from_memory(&draw(plots, PlotFormat::Png, &CancelToken::new()).unwrap()).unwrap();
    assert_eq!(picture.width(), 1280);
}
