//! The notes over the charts of a figure: the models, how they were measured, and how to read the charts.

use super::chart::{Chart, Look};
use crate::lab::measurement::{Measurement, ModelView, model_views};
use crate::lab::report_table::{conditions_and_threads, name_among};
use crate::text::{count, cut};

/// Most characters that name machines.
const MAX_MACHINES: usize = 160;
/// Most models that are named one by one.
const MAX_NAMED: usize = 3;

/// The notes over `charts` of `rows`.
pub fn notes(rows: &[Measurement], charts: &[Chart]) -> Vec<String> {
    let mut notes = vec![format!("{}. {}.", scenes(rows), capitalized(&conditions_and_threads(rows)))];
    notes.extend(machines(rows));
    let has_spread = |look: &dyn Fn(Look) -> bool| {
        let curves = charts.iter().flat_map(|chart| chart.curves.iter().map(move |curve| (chart, curve)));
        curves
            .filter(|(_, curve)| look(curve.look))
            .any(|(chart, curve)| curve.points.iter().any(|point| chart.whisker(point).is_some()))
    };
    // Thin lines without markers are predictions of speed-up, and policies of many frames.
    let has_predictions = rows.iter().any(|row| row.predicted_scaling.is_some());
    if has_spread(&|look| look != Look::Line || !has_predictions) {
        notes.push("Thin lines run between the quartiles of the rounds.".to_owned());
    }
    if has_spread(&|look| look == Look::Line && has_predictions) {
        notes.push("Thin lines of predictions run from the worst to the best case.".to_owned());
    }
    let spans_containers = rows.iter().any(|row| row.container != rows[0].container);
    if spans_containers && charts.iter().any(|chart| chart.labels.iter().any(|label| label.starts_with("SAH cost"))) {
        notes.push("SAH costs of different containers do not compare.".to_owned());
    }
    notes
}

/// The machines that the rows were measured on, with the version of the program; none of rows that do not name theirs.
fn machines(rows: &[Measurement]) -> Option<String> {
    let mut names: Vec<String> = Vec::new();
    for conditions in rows.iter().filter_map(|row| row.conditions.as_ref()) {
        let name = format!("{}, bvhscope {}", conditions.machine, conditions.version);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    (!names.is_empty()).then(|| format!("On {}.", cut(&names.join("; "), MAX_MACHINES)))
}

/// The models with their sizes.
fn scenes(rows: &[Measurement]) -> String {
    let models = model_views(rows);
    if models.len() > MAX_NAMED {
        return format!("{} models", models.len());
    }
    // Several are named in the legend.
    let is_one_kind = rows.iter().all(|row| row.container == rows[0].container);
    let containers = if is_one_kind { format!(", {}", rows[0].container.plural()) } else { String::new() };
    let scene = |model: &ModelView<'_>| {
        let row = rows.iter().find(|row| row.view() == *model);
        let triangles = row.map_or(0, |row| row.triangles);
        let clip = row.and_then(|row| Some(format!(", {}{containers}", row.motion.as_ref()?.clip_text())));
        format!("{}, {} triangles{}", name_among(*model, &models), count(triangles as u64), clip.unwrap_or_default())
    };
    models.iter().map(scene).collect::<Vec<_>>().join("; ")
}

fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}
