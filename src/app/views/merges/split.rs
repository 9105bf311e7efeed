//! "This split": the sides of the present split, and what the surface area heuristic makes of them.

use egui::{Label, RichText, Ui};

use crate::app::state::picture_cut::MergeStudy;
use crate::app::state::{AppState, Presented};
use crate::app::{format, theme};
use bvhscope_engine::construction::SplitTree;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// Shows the present split in sentences.
pub(super) fn show(ui: &mut Ui, state: &AppState, shown: &Presented, study: &MergeStudy, splits: &SplitTree) {
    let palette = theme::palette(ui);
    ui.spacing_mut().item_spacing.y = 3.0;
    let mut line = |text: String, color| {
        ui.add(Label::new(RichText::new(text).color(color)).wrap());
    };
    let step = state.model.cut.step(&study.merges).filter(|step| *step > 0);
    let Some((step, node)) = step.and_then(|step| Some((step, study.merges.made_at(step)?))) else {
        line("Choose a split in the plot to see its two sides".to_owned(), palette.dim);
        return;
    };
    let table = study.table.as_ref().unwrap_or(&shown.table);
    let triangles = |node: u32| u64::from(table.primitives(node));
    let sides: Vec<(u64, f64)> = table
        .children(node)
        .map(|side| {
            (triangles(side), f64::from(table.area_share(side) / table.area_share(node).max(f32::MIN_POSITIVE)))
        })
        .collect();
    let [number, name] = [step, node].map(|number| format::count(u64::from(number)));
    let all = format::counted(triangles(node), "triangle");
    let counts: Vec<String> = sides.iter().map(|(count, _)| format::count(*count)).collect();
    line(format!("Split {number}: node {name} of {all} into {}", counts.join(" and ")), palette.warm);
    let shares: Vec<String> = sides.iter().map(|(_, share)| format::percent(*share)).collect();
    line(format!("Its sides have {} of its area", shares.join(" and ")), palette.text);
    let tests = |count: u64| f64::from(INTERSECTION_COST) * count as f64;
    let cost = f64::from(TRAVERSAL_COST) + sides.iter().map(|(count, share)| share * tests(*count)).sum::<f64>();
    let [cost, leaf] = [cost, tests(triangles(node))].map(format::significant);
    line(
        format!(
            "By the SAH a ray in the node takes {cost} steps and tests with leaves as sides, {leaf} without the split"
        ),
        palette.text,
    );
    if splits.cuts() {
        let text = match splits.duplicates(node) {
            0 => "An object split: no triangle is on both sides".to_owned(),
            count => format!("A spatial split: {} on both sides", format::counted(u64::from(count), "triangle")),
        };
        line(text, palette.text);
    }
}
