//! Plots of trees: SAH cost and EPO against measured cost, and build time against quality. A click on a tree builds it.

use std::sync::Arc;

use egui::{self, Button, Color32, CursorIcon, Rect, Role, ScrollArea, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};

use super::state::{PlotKind, PlotsView, PlottedTree, TreeQuality, TreeSet};
use crate::app::state::paper::settings_of;
use crate::app::state::{AppState, Presented, SecondTree, TreeSide};
use crate::app::views::axes::{Axes, Lettering, rest};
use crate::app::views::parts;
use crate::app::widgets::table::{self, Column, Table, TableRow};
use crate::app::widgets::{Tip as _, empty_view};
use crate::app::{format, theme};
use crate::catalog::numbers::Direction;
use crate::catalog::numbers::rows::{BUILD_MS, EPO, MRAYS_PER_S, SAH_COST, TESTS_PER_ENTERING_RAY, WIDE_TRACE_MS};
use crate::lab::Measurement;
use crate::lab::plot::Axis;
use crate::lab::population::Population;
use crate::lab::prediction::{PredictedTree, Prediction, pareto_front};
use crate::lab::verdict::{Order, has_fastest};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};

/// Name and value of what predicts the cost of a tree, and how well it does.
pub(super) type Predictor = (&'static str, fn(&PredictedTree) -> f64, Option<f64>);

/// Size of what can be clicked of a tree in points.
const TARGET: f32 = 12.0;

/// A tree in a plot.
pub(super) struct Dot {
    /// The tree.
    pub(super) tree: PlottedTree,
    /// Its values across and up.
    pub(super) at: [f64; 2],
}

/// The trees of the presented scene to be plotted.
pub(super) fn plotted(view: &PlotsView, state: &AppState, shown: &Presented) -> Vec<PlottedTree> {
    let scene = &shown.accel.scene;
    let TreeSet::Measured(experiment) = view.set else {
        return view.session.plotted(state.model.derived.rays(scene));
    };
    let result = state.activity.measured.get(&experiment).filter(|result| Arc::ptr_eq(&result.scene, scene));
    let rows = result.into_iter().flat_map(|result| result.rows.iter());
    rows.filter_map(|row| tree_of(row, state.model.derived.population)).collect()
}

/// The tree of a row that the view "Paper" has measured, with what rays of `population` cost in it; `None` where none was built.
fn tree_of(row: &Measurement, population: Population) -> Option<PlottedTree> {
    let of_file = || BuildSettings::preset(Preset::Fast, row.container);
    let build = settings_of(row).filter(|build| build.builder != BuilderKind::None);
    let rays = row.populations.iter().find(|measured| measured.population == population);
    Some(PlottedTree {
        container: row.container,
        build: build.or_else(|| row.tree.as_ref().map(|_| of_file()))?,
        file: row.tree.as_ref().map(|path| (path.into(), row.builder.clone())),
        build_ms: row.values.known(BUILD_MS),
        is_built_once: row.repeat < 2 && row.tree.is_none(),
        speed: row.values.known(MRAYS_PER_S),
        rounds: [BUILD_MS, WIDE_TRACE_MS].map(|number| row.rounds_of(number).to_vec()),
        sah_cost: row.number(SAH_COST),
        tests: row.values.known(TESTS_PER_ENTERING_RAY),
        epo: row.values.known(EPO),
        cost: rays.filter(|rays| rays.root_hits > 0).map(|rays| rays.cost),
    })
}

/// The trees whose measured cost and both predictions are known, of the kind of container of the presented tree: those of boxes and
/// spheres do not compare.
pub(super) fn predicted(view: &PlotsView, state: &AppState, shown: &Presented) -> Vec<(PlottedTree, PredictedTree)> {
    let container = shown.accel.tree.container_kind();
    let trees = plotted(view, state, shown).into_iter().filter(|tree| tree.container == container);
    let known = trees.filter_map(|tree| {
        let (sah_cost, epo, cost) = (tree.sah_cost, tree.epo?, tree.cost?);
        Some((tree, PredictedTree { sah_cost, epo, cost }))
    });
    known.collect()
}

/// A plot of what one number predicts: its dots, its axes, and its title with the correlation.
pub(super) fn prediction_plot(
    trees: &[(PlottedTree, PredictedTree)],
    predictor: fn(&PredictedTree) -> f64,
    r: Option<f64>,
) -> (Vec<Dot>, [Axis; 2], String) {
    let dots: Vec<Dot> =
        trees.iter().map(|(tree, known)| Dot { tree: tree.clone(), at: [predictor(known), known.cost] }).collect();
    let axes = [0, 1].map(|axis| Axis::linear(dots.iter().map(|dot| dot.at[axis])));
    let title = match r {
        Some(r) => format!("r = {r:.3} over {}", format::counted(dots.len() as u64, "tree")),
        None => format::counted(dots.len() as u64, "tree"),
    };
    (dots, axes, title)
}

/// The trees of the plot of speed and quality, with its axes, and the indices of those that no other beats.
pub(super) fn speed_plot(view: &PlotsView, state: &AppState, shown: &Presented) -> (Vec<Dot>, [Axis; 2], Vec<usize>) {
    let quality = view.quality;
    let container = shown.accel.tree.container_kind();
    let dot = |tree: PlottedTree| {
        // Costs of boxes and of spheres do not compare: other rays enter their roots.
        let at = [tree.build_ms?, tree.quality(quality).filter(|_| tree.container == container)?];
        Some(Dot { tree, at })
    };
    let dots: Vec<Dot> = plotted(view, state, shown).into_iter().filter_map(dot).collect();
    let axes = [Axis::logarithmic(dots.iter().map(|dot| dot.at[0])), Axis::linear(dots.iter().map(|dot| dot.at[1]))];
    let front = pareto_front(&dots.iter().map(|dot| dot.at).collect::<Vec<_>>());
    (dots, axes, front)
}

/// Shows what SAH cost and EPO predict, side by side.
pub(super) fn show_predictions(ui: &mut Ui, view: &PlotsView, state: &mut AppState, shown: &Presented) {
    let trees = predicted(view, state, shown);
    if missing(ui, view, state, shown, trees.len()) {
        return;
    }
    let known: Vec<PredictedTree> = trees.iter().map(|(_, known)| *known).collect();
    let prediction = Prediction::of(&known);
    if let Some((alpha, r)) = prediction.both {
        let text = format!(
            "Both together predict best as {:.2} · SAH + {alpha:.2} · EPO: r = {r:.3} (Aila et al. 2013)",
            1.0 - alpha
        );
        ui.add(egui::Label::new(egui::RichText::new(text).color(theme::palette(ui).dim)).truncate());
    } else {
        ui.weak("From three different trees on there is a correlation: change the settings, or measure the builders");
    }
    unmeasured(ui, view, state, shown);
    let whole = rest(ui);
    let size = vec2((whole.x - 8.0) * 0.5, whole.y);
    ui.horizontal_top(|ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        let plots: [Predictor; 2] =
            [("SAH cost", |tree| tree.sah_cost, prediction.sah), ("EPO", |tree| tree.epo, prediction.epo)];
        for (label, predictor, r) in plots {
            let (dots, axes, title) = prediction_plot(&trees, predictor, r);
            plot(ui, state, shown, size, (&dots, axes, &[]), &title, [label, "Measured cost"]);
        }
    });
}

/// Shows build time against quality.
pub(super) fn show_speed(ui: &mut Ui, view: &PlotsView, state: &mut AppState, shown: &Presented) {
    let (dots, axes, front) = speed_plot(view, state, shown);
    if missing(ui, view, state, shown, dots.len()) {
        return;
    }
    if view.quality == TreeQuality::Cost {
        unmeasured(ui, view, state, shown);
    }
    let size = rest(ui);
    let title = format!("{}, {} on the front", format::counted(dots.len() as u64, "tree"), front.len());
    let labels = ["Build time (ms)", view.quality.label()];
    plot(ui, state, shown, size, (&dots, axes, &front), &title, labels);
}

/// Says which trees are left out because what rays cost in them is not known, and how to get it.
fn unmeasured(ui: &mut Ui, view: &PlotsView, state: &AppState, shown: &Presented) {
    let count = plotted(view, state, shown).iter().filter(|tree| tree.cost.is_none()).count();
    if count == 0 {
        return;
    }
    let trees = format::counted(count as u64, "tree");
    let [is, it] = if count == 1 { ["is", "it"] } else { ["are", "them"] };
    let text = match view.set {
        TreeSet::Session => format!(
            "{trees} {is} not plotted: no measured cost, because this view was closed or measured by other rays. “Trees: list” measures {it}"
        ),
        TreeSet::Measured(_) => format!("{trees} {is} not plotted: measured without these rays. Measure again"),
    };
    let tip = "The cost of a tree is counted while it is shown and this view is open; a closed view computes nothing";
    ui.add(egui::Label::new(egui::RichText::new(text).color(theme::palette(ui).dim)).truncate()).tip(tip);
}

/// Says why there is nothing to plot, where that is so.
fn missing(ui: &mut Ui, view: &PlotsView, state: &AppState, shown: &Presented, count: usize) -> bool {
    if count > 0 {
        return false;
    }
    let of_rays = parts::no_rays(state, shown);
    let needs_overlap =
        view.kind == PlotKind::Prediction || view.kind == PlotKind::Speed && view.quality == TreeQuality::Epo;
    let text = match (view.set, &state.activity.measure) {
        _ if needs_overlap && !shown.accel.has_epo() => parts::NO_OVERLAP,
        (TreeSet::Session, _) => of_rays.unwrap_or("Counting the visits"),
        (_, Some(_)) => "Measuring: the first trees appear after the first repetition",
        (_, None) => "These trees were not measured yet on this model",
    };
    empty_view(ui, text);
    true
}

/// One plot, with the line along `front`.
fn plot(
    ui: &mut Ui,
    state: &mut AppState,
    shown: &Presented,
    size: egui::Vec2,
    (dots, range, front): (&[Dot], [Axis; 2], &[usize]),
    title: &str,
    labels: [&str; 2],
) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = format!("Plot of {} over {}: {title}", labels[1], labels[0]);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    let palette = theme::palette(ui);
    let heading = format!("{} · {title}", labels[1]);
    let lettering = Lettering { heading: &heading, across: labels[0], ..Lettering::default() };
    let axes = Axes::paint(ui, rect, range, &lettering);
    let painter = axes.painter(ui);
    let line = front.iter().map(|&index| axes.at(dots[index].at)).collect();
    painter.add(Shape::line(line, Stroke::new(1.5, palette.accent)));
    let mut clicked = None;
    for (index, dot) in dots.iter().enumerate() {
        let at = axes.at(dot.at);
        let is_shown = dot.tree.is(&shown.accel);
        let fill = if is_shown { palette.warm } else { palette.accent };
        let radius = if is_shown { 5.0 } else { 3.5 };
        painter.circle(at, radius, fill.gamma_multiply(0.8), Stroke::new(1.0, Color32::from_black_alpha(90)));
        let target = Rect::from_center_size(at, vec2(TARGET, TARGET));
        let tree = ui.interact(target, response.id.with(index), Sense::CLICK);
        let text = text_of(state, &dot.tree);
        tree.widget_info(|| WidgetInfo::selected(Role::Button, true, is_shown, &text));
        if tree.hovered() || tree.has_focus() {
            painter.circle_stroke(at, 6.5, Stroke::new(1.5, palette.text));
        }
        let verb = if dot.tree.file.is_some() { "read" } else { "build" };
        let tip = format!("{text}\nClick to {verb} this tree");
        if tree.on_hover_cursor(CursorIcon::PointingHand).on_hover_text_at_pointer(tip).clicked() {
            clicked = Some(dot.tree.clone());
        }
    }
    if let Some(tree) = clicked {
        let side = state.edited_side();
        request(state, &tree, side);
    }
}

/// Builds or reads `tree` as the one on `side`; a second tree is added where there is none.
pub(super) fn request(state: &mut AppState, tree: &PlottedTree, side: TreeSide) {
    let build = if tree.file.is_none() { tree.build } else { *state.wanted.build_of(side) };
    match (side, &mut state.wanted.second) {
        (TreeSide::A, _) => state.wanted.build = build,
        (TreeSide::B, Some(second)) => second.build = build,
        (TreeSide::B, second) => *second = Some(SecondTree::new(build)),
    }
    state.wanted.set_tree_file(side, tree.file.as_ref().map(|(path, _)| path.clone()));
}

/// A tree as text: "AAC δ 6 ε 0.2, boxes: built in 12 ms, SAH cost 30, EPO 2, measured cost 24 by Primary rays".
fn text_of(state: &AppState, tree: &PlottedTree) -> String {
    let built = tree.build_ms.map(|ms| format!("built in {} ms", format::significant(ms)));
    let quality = |(quality, label, _)| Some(format!("{label} {}", format::significant(tree.quality(quality)?)));
    let numbers: Vec<String> = built.into_iter().chain(TreeQuality::ALL.into_iter().filter_map(quality)).collect();
    let mut text = format!("{}: {}", tree.name(), numbers.join(", "));
    if tree.cost.is_some() {
        text = format!("{text} by {}", state.model.derived.population.label().to_lowercase());
    }
    text
}

/// Title of the table.
const TITLE: &str = "Trees";

/// A reading: its name, its unit, and how it is read.
type Reading = (&'static str, &'static str, fn(&PlottedTree) -> Option<f64>);

/// The readings; of all but the speed less is better.
const READINGS: [Reading; 6] = [
    ("Build time", "ms", |tree| tree.build_ms),
    ("Speed", "Mray/s", |tree| tree.speed),
    ("SAH cost", "", |tree| Some(tree.sah_cost)),
    ("Tests", "entering ray", |tree| tree.tests),
    ("EPO", "", |tree| tree.epo),
    ("Measured cost", "chosen rays", |tree| tree.cost),
];

/// Shows the list.
pub(super) fn show_list(ui: &mut Ui, view: &mut PlotsView, state: &mut AppState, shown: &Presented) {
    let trees = plotted(view, state, shown);
    if trees.is_empty() {
        empty_view(ui, "These trees were not measured yet on this model");
        return;
    }
    ui.horizontal(|ui| buttons(ui, view, state, &trees));
    let is_one_kind = trees.iter().all(|tree| tree.container == trees[0].container);
    let cells: Vec<Vec<String>> = trees.iter().map(cells).collect();
    let order = if view.set == TreeSet::Session { Order::OneAfterOther } else { Order::InTurn };
    let reading = |(name, unit, _): Reading| {
        // Costs of boxes and of spheres do not compare; times and tests of the same rays do.
        let compares = is_one_kind || !matches!(name, "SAH cost" | "EPO" | "Measured cost");
        let better = if name == "Speed" { Direction::More } else { Direction::Less };
        let timed = ["Build time", "Speed"].iter().position(|timed| *timed == name);
        let has_best = timed.is_none_or(|at| {
            let rounds: Vec<&[f64]> = trees.iter().map(|tree| tree.rounds[at].as_slice()).collect();
            has_fastest(&rounds, order)
        });
        Column { name, unit, better: compares.then_some(better), has_best }
    };
    let name = Column { name: "Settings", unit: "", better: None, has_best: false };
    let row = |(tree, cells): (&PlottedTree, _)| TableRow {
        cells,
        is_remark: false,
        is_shown: tree.is(&shown.accel),
        // Behind the name.
        preliminary: tree.is_built_once.then_some(1),
    };
    let table = Table {
        title: TITLE,
        columns: std::iter::once(name).chain(READINGS.map(reading)).collect(),
        rows: trees.iter().zip(cells.iter().map(Vec::as_slice)).map(row).collect(),
        opens: Some("builds or reads its tree"),
    };
    let area = ScrollArea::both().id_salt("session trees").auto_shrink(false);
    let response = area.show(ui, |ui| table::show(ui, &table)).inner;
    if let Some(row) = response.copied {
        state.copy(cells[row].join("\t"), "Row copied");
    }
    if let Some(row) = response.opened {
        request(state, &trees[row], TreeSide::A);
    }
}

/// Name and readings of a tree.
fn cells(tree: &PlottedTree) -> Vec<String> {
    let reading = |(.., read): Reading| read(tree).map_or_else(|| "–".to_owned(), format::significant);
    std::iter::once(tree.name()).chain(READINGS.map(reading)).collect()
}

/// Buttons for the chosen tree, and for all.
fn buttons(ui: &mut Ui, view: &mut PlotsView, state: &mut AppState, trees: &[PlottedTree]) {
    let chosen = table::chosen(ui, TITLE).and_then(|row| trees.get(row));
    for (side, label, tip) in [
        (TreeSide::A, "Show", "Build or read the chosen tree, as a double click does"),
        (TreeSide::B, "Put into B", "Compare the tree on the screen with the chosen one, as the second tree"),
    ] {
        let button = ui.add_enabled(chosen.is_some(), Button::new(label)).tip(tip);
        if let Some(tree) = chosen.filter(|_| button.disabled_tip("Choose a row first").clicked()) {
            request(state, tree, side);
        }
    }
    if view.set != TreeSet::Session {
        return;
    }
    let scene = state.model.loaded.as_ref();
    let rays = scene.and_then(|scene| state.model.derived.rays(scene));
    let left = view.session.unmeasured(rays).count();
    if view.measures_all {
        ui.weak(format!("Measuring: {} left (Esc stops)", format::counted(left as u64, "tree")));
        return;
    }
    let label = if left > 0 { format!("Measure all {left}") } else { "Measure all".to_owned() };
    let tip = "Build each tree that lacks a reading again, several times, or read its file, and count the chosen rays: some seconds a tree, in the background";
    let button = ui.add_enabled(left > 0, Button::new(label)).tip(tip);
    if button.disabled_tip("All are measured").clicked() {
        view.measures_all = true;
        view.measured.resume();
    }
}
