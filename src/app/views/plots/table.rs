//! Plots for other programs: as tab-separated text, and as plots to be drawn into a file.

use std::fmt::Write as _;

use super::nodes;
use super::state::{PlotKind, PlotsView};
use super::trees::{Dot, Predictor, plotted, predicted, prediction_plot, speed_plot};
use crate::accel::node_values::NodeValues;
use crate::app::format;
use crate::app::state::{AppState, Presented};
use crate::lab::plot::{Chart, Curve, Figure, Look, Point};
use crate::lab::prediction::Prediction;
use crate::lab::visit_scatter::{LEAST_SHOWN, ScatterNode, node_in};

/// Most nodes in a table, the first of the tree, which are the largest.
const MOST_ROWS: usize = 100_000;

/// The part of the plot's file name behind its model.
pub(super) const fn stem(view: &PlotsView) -> &'static str {
    match view.kind {
        PlotKind::Nodes => "visits",
        PlotKind::Prediction => "prediction",
        PlotKind::Speed => "speed",
        PlotKind::List => "trees",
    }
}

/// The plotted values as tab-separated text, and a note that they were copied.
pub(super) fn tsv(view: &PlotsView, state: &AppState, shown: &Presented) -> (String, String) {
    if view.kind == PlotKind::Nodes {
        let (text, count) = nodes_tsv(state, shown);
        return (text, format!("{} copied", format::counted(count as u64, "node")));
    }
    let mut text = String::from("Tree\tBuild time (ms)\tSAH cost\tTests per entering ray\tEPO\tMeasured cost\tRays\n");
    let trees = plotted(view, state, shown);
    let cell = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    for tree in &trees {
        let rays = if tree.cost.is_some() { state.model.derived.population.name() } else { "" };
        let [sah_cost, tests, epo, cost] = [Some(tree.sah_cost), tree.tests, tree.epo, tree.cost].map(cell);
        let build_ms = cell(tree.build_ms);
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{}\t{build_ms}\t{sah_cost}\t{tests}\t{epo}\t{cost}\t{rays}", tree.name());
    }
    (text, format!("{} copied", format::counted(trees.len() as u64, "tree")))
}

/// The nodes of the scatter as text, and their number.
fn nodes_tsv(state: &AppState, shown: &Presented) -> (String, usize) {
    let visits = state.model.derived.known_visits(&shown.accel);
    let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
    let mut text = String::from("Node\tKind\tPredicted visits\tMeasured visits\n");
    let all = (0..shown.table.len() as u32).filter_map(|node| node_in(&values, node));
    let mut count = 0;
    for ScatterNode { node, predicted, measured } in all.filter(|node| node.predicted >= LEAST_SHOWN).take(MOST_ROWS) {
        let kind = if shown.table.is_leaf(node) { "leaf" } else { "interior" };
        let _ = writeln!(text, "{node}\t{kind}\t{predicted}\t{measured}");
        count += 1;
    }
    (text, count)
}

/// The plots as a figure.
pub(super) fn figure(view: &PlotsView, state: &AppState, shown: &Presented) -> Figure {
    let charts = match view.kind {
        PlotKind::Nodes => node_chart(view, shown).into_iter().collect(),
        PlotKind::Prediction => {
            let trees = predicted(view, state, shown);
            let prediction = Prediction::of(&trees.iter().map(|(_, known)| *known).collect::<Vec<_>>());
            let plots: [Predictor; 2] =
                [("SAH cost", |tree| tree.sah_cost, prediction.sah), ("EPO", |tree| tree.epo, prediction.epo)];
            let chart = |(label, predictor, r): Predictor| {
                let (dots, axes, title) = prediction_plot(&trees, predictor, r);
                let rays = state.model.derived.population.label().to_lowercase();
                let labels = [label.to_owned(), format!("Measured cost ({rays})")];
                Chart {
                    title,
                    labels,
                    axes,
                    curves: vec![curve("trees", 0, Look::Dots, points(&dots))],
                    rows: Vec::new(),
                }
            };
            plots.map(chart).into()
        }
        PlotKind::List => Vec::new(),
        PlotKind::Speed => {
            let (dots, axes, front) = speed_plot(view, state, shown);
            let line = front.iter().map(|&index| dots[index].at);
            vec![Chart {
                title: String::new(),
                labels: ["Build time (ms)".to_owned(), view.quality.label().to_owned()],
                axes,
                curves: vec![curve("trees", 0, Look::Dots, points(&dots)), curve("not beaten", 1, Look::Line, line)],
                rows: Vec::new(),
            }]
        }
    };
    let scene = &shown.accel.scene;
    let note = format!("{}, {}.", scene.source.label(), format::counted(scene.triangle_count(), "triangle"));
    Figure { notes: vec![note], charts }
}

fn node_chart(view: &PlotsView, shown: &Presented) -> Option<Chart> {
    let scatter = view.scatter.of_tree(&shown.accel)?;
    let drawn = |node: &ScatterNode| [node.predicted, f64::from(node.measured)];
    let equal = [1.0, scatter.axes[0].high].map(|end| [end; 2]);
    Some(Chart {
        title: scatter.sums.population.label().to_owned(),
        labels: nodes::LABELS.map(str::to_owned),
        axes: scatter.axes,
        curves: vec![
            curve("nodes", 0, Look::Dots, scatter.cells.iter().map(|cell| drawn(&cell.first))),
            curve("the worst", 1, Look::Rings, scatter.worst.iter().map(drawn)),
            curve("as predicted", 2, Look::Line, equal),
        ],
        rows: Vec::new(),
    })
}

fn points(dots: &[Dot]) -> impl Iterator<Item = [f64; 2]> {
    dots.iter().map(|dot| dot.at)
}

fn curve(name: &str, color: usize, look: Look, points: impl IntoIterator<Item = [f64; 2]>) -> Curve {
    Curve { name: name.to_owned(), color, look, points: points.into_iter().map(Point::of).collect() }
}
