//! What is plotted, for other programs: as tab-separated text, and as plots to be drawn into a file.

use std::fmt::Write as _;

use super::nodes;
use super::trees::{Dot, Predictor, plotted, predicted, prediction_plot, speed_plot};
use crate::app::format;
use crate::app::state::lab::PlotKind;
use crate::app::state::{AppState, Presented};
use crate::lab::node_values::NodeValues;
use crate::lab::plot::{Scatter, ScatterSeries, SeriesLook};
use crate::lab::prediction::Prediction;
use crate::lab::visit_scatter::{LEAST_SHOWN, ScatterNode, node_in};

/// Most nodes in a table, the first of the tree, which are the largest.
const MOST_ROWS: usize = 100_000;

/// What the file of the plot is called after its model.
pub(super) const fn stem(state: &AppState) -> &'static str {
    match state.lab.plots.kind {
        PlotKind::Nodes => "visits",
        PlotKind::Prediction => "prediction",
        PlotKind::Speed => "speed",
    }
}

/// What is plotted as tab-separated text, and a note that it was copied.
pub(super) fn tsv(state: &AppState, shown: &Presented) -> (String, String) {
    if state.lab.plots.kind == PlotKind::Nodes {
        let (text, count) = nodes_tsv(state, shown);
        return (text, format!("{} copied", format::counted(count as u64, "node")));
    }
    let mut text = String::from("Tree\tBuild time (ms)\tSAH cost\tEPO\tMeasured cost\tRays\n");
    let trees = plotted(state, shown);
    let cell = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    for tree in &trees {
        let rays = if tree.cost.is_some() { state.lab.population.name() } else { "" };
        let [sah_cost, epo, cost] = [Some(tree.sah_cost), tree.epo, tree.cost].map(cell);
        let build_ms = cell(tree.build_ms);
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{}\t{build_ms}\t{sah_cost}\t{epo}\t{cost}\t{rays}", tree.name());
    }
    (text, format!("{} copied", format::counted(trees.len() as u64, "tree")))
}

/// The nodes of the scatter as text, and their number.
fn nodes_tsv(state: &AppState, shown: &Presented) -> (String, usize) {
    let visits = state.lab.known_visits(&shown.accel);
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

/// What is plotted, to be drawn into a file.
pub(super) fn scatters(state: &AppState, shown: &Presented) -> Vec<Scatter> {
    match state.lab.plots.kind {
        PlotKind::Nodes => node_scatter(state, shown).into_iter().collect(),
        PlotKind::Prediction => {
            let trees = predicted(state, shown);
            let prediction = Prediction::of(&trees.iter().map(|(_, known)| *known).collect::<Vec<_>>());
            let plots: [Predictor; 2] =
                [("SAH cost", |tree| tree.sah_cost, prediction.sah), ("EPO", |tree| tree.epo, prediction.epo)];
            let scatter = |(label, predictor, r): Predictor| {
                let (dots, axes, title) = prediction_plot(&trees, predictor, r);
                let cost = format!("Measured cost ({})", state.lab.population.name());
                let labels = [label.to_owned(), cost];
                Scatter { title, labels, axes, series: vec![series("trees", SeriesLook::Dots, points(&dots))] }
            };
            plots.map(scatter).into()
        }
        PlotKind::Speed => {
            let (dots, axes, front) = speed_plot(state, shown);
            let line = front.iter().map(|&index| dots[index].at).collect();
            vec![Scatter {
                title: shown.accel.scene.source.label(),
                labels: ["Build time (ms)".to_owned(), state.lab.plots.quality.label().to_owned()],
                axes,
                series: vec![
                    series("trees", SeriesLook::Dots, points(&dots)),
                    series("not beaten", SeriesLook::Line, line),
                ],
            }]
        }
    }
}

fn node_scatter(state: &AppState, shown: &Presented) -> Option<Scatter> {
    let scatter = state.lab.plots.scatter.of_tree(&shown.accel)?;
    let drawn = |node: &ScatterNode| [node.predicted, f64::from(node.measured)];
    let nodes = scatter.cells.iter().map(|cell| drawn(&cell.first)).collect();
    let equal = [1.0, scatter.axes[0].high].map(|end| [end; 2]);
    Some(Scatter {
        title: format!("{}, {} rays", shown.accel.scene.source.label(), scatter.sums.population.name()),
        labels: nodes::LABELS.map(str::to_owned),
        axes: scatter.axes,
        series: vec![
            series("nodes", SeriesLook::Dots, nodes),
            series("the worst", SeriesLook::Rings, scatter.worst.iter().map(drawn).collect()),
            series("as predicted", SeriesLook::Line, equal.to_vec()),
        ],
    })
}

fn points(dots: &[Dot]) -> Vec<[f64; 2]> {
    dots.iter().map(|dot| dot.at).collect()
}

fn series(name: &str, look: SeriesLook, points: Vec<[f64; 2]>) -> ScatterSeries {
    ScatterSeries { name: name.to_owned(), look, points }
}
