//! Numbers, model names and measuring conditions as text.

use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{BUILD_MS, TRACE_MS};
use crate::catalog::reading::disturbed;
use crate::catalog::settings::Setting;
use crate::lab::measurement::{Measurement, ModelView};
use crate::lab::verdict::Factor;
pub use crate::text::number;
use crate::text::{count, counted};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

pub(super) fn threads(count: usize) -> String {
    format!("{count} {}", if count == 1 { "thread" } else { "threads" })
}

/// Picture size, traversal and repetitions of the rows, in one phrase.
pub(super) fn conditions(rows: &[Measurement]) -> String {
    let Some(row) = rows.first() else { return "nothing was measured".to_owned() };
    let repeats = || rows.iter().filter(|row| row.builder != "none").map(|row| row.repeat);
    let (min, max) = (repeats().min().unwrap_or(1), repeats().max().unwrap_or(1));
    let medians = match (min, max) {
        (1, 1) => "measured once".to_owned(),
        _ if min == max => format!("medians of {max}"),
        _ => format!("medians of {min} to {max}"),
    };
    let Measurement { width_px, height_px, traversal, .. } = row;
    // Of several the names of models state it.
    let is_one = rows.iter().all(|other| other.view().camera == row.view().camera) && !row.view().camera.is_empty();
    let camera = if is_one { format!(", camera {}", row.view().camera) } else { String::new() };
    if row.command == "animate" {
        return format!(
            "rays of a view of {width_px}×{height_px} pixels{camera}, {traversal} traversal, ray times {medians}"
        );
    }
    format!("{width_px}×{height_px} primary rays{camera}, {traversal} traversal, {medians}")
}

/// [`conditions`] with the number of threads if it is the same for all rows.
pub fn conditions_and_threads(rows: &[Measurement]) -> String {
    let same = rows.first().filter(|first| rows.iter().all(|row| row.threads == first.threads));
    match same {
        Some(row) => format!("{}, {}", conditions(rows), threads(row.threads)),
        None => conditions(rows),
    }
}

/// Distance of the quartiles of a time of `row`, as a percentage of the median.
pub(super) fn spread(row: &Measurement, time: &Number) -> String {
    spread_share(row, time).map_or_else(|| "–".to_owned(), |share| format!("{:.0}", share * 100.0))
}

/// Distance of the quartiles over the median; `None` where nothing was repeated.
fn spread_share(row: &Measurement, time: &Number) -> Option<f64> {
    let median = row.number(time);
    let [lower, upper] = row.values.spread(time).filter(|_| !median.is_nan())?;
    Some(if median > 0.0 { (upper - lower) / median } else { 0.0 })
}

/// A setting of `row`; a dash where its build does not use it.
pub(super) fn setting(row: &Measurement, setting: &Setting) -> String {
    row.settings.text(setting).unwrap_or_else(|| "–".to_owned())
}

/// Spread of a time over its median, from which on the program was not alone.
const UNSTEADY: f64 = 0.3;

/// The meaning of a spread, and advice where times of `rows` vary much.
pub(super) fn spread_note(rows: &[Measurement]) -> String {
    let times = rows.iter().flat_map(|row| [BUILD_MS, TRACE_MS].map(|time| spread_share(row, time).unwrap_or(0.0)));
    let most = times.fold(0.0, f64::max);
    let advice = if most > UNSTEADY {
        let percent = count((most * 100.0).round() as u64);
        format!(
            " Times vary by up to {percent} %: other programs may be running. More repetitions (--repeat) steady medians."
        )
    } else {
        String::new()
    };
    let rounds = || rows.iter().flat_map(|row| row.rounds.values());
    let disturbed: usize = rounds().map(|rounds| disturbed(rounds)).sum();
    let all: usize = rounds().map(Vec::len).sum();
    let disturbed = if disturbed > 0 {
        format!(
            " {} of {} times were disturbed: further than five scaled median deviations from their median.",
            count(disturbed as u64),
            count(all as u64)
        )
    } else {
        String::new()
    };
    format!("Spread: distance of the quartiles of the rounds, over the median.{disturbed}{advice}")
}

/// " (1 of 9 disturbed)"; empty where no round was.
pub(super) fn disturbed_text(rounds: &[f64]) -> String {
    match disturbed(rounds) {
        0 => String::new(),
        some => format!(" ({some} of {} disturbed)", rounds.len()),
    }
}

/// A factor with its interval: "× 0.38, 0.37 to 0.40 over 9 rounds"; "× 1.02, not decided (0.98 to 1.05 over 9 rounds)".
pub(super) fn factor_text(factor: &Factor) -> String {
    let median = ratio(factor.median);
    let of = counted(factor.count as u64, "rounds");
    let interval = factor.interval.map(|[least, most]| format!("{} to {} over {of}", ratio(least), ratio(most)));
    match (factor.decided(), interval) {
        (Some(_), Some(interval)) => format!("× {median}, {interval}"),
        (_, Some(interval)) => format!("× {median}, not decided ({interval})"),
        (_, None) => format!("× {median}, not decided: {of} are too few"),
    }
}

/// A factor with three digits: one of 1.004 shall not look like none.
pub(super) fn ratio(factor: f64) -> String {
    if factor < 10.0 { format!("{factor:.3}") } else { number(factor) }
}

/// The meaning of intervals and of "not decided".
pub(super) const INTERVALS: &str = "Intervals hold with 99 %, by the sign test over rounds in which both were measured in turn; of fewer than 8 rounds by the rank-sum \
     test, and beyond a factor of 1.1 alone. Not decided: the interval allows both directions.";

pub(super) const TRACE: &str = "Trace, binary tree: rays one by one, as in the paper. Speed in Mray/s: in packets through the \
                                wide tree, as pictures are traced.";
pub(super) const TESTS: &str = "Tests: each container and each primitive that a ray is tested against, two containers for each interior node that is visited. \
     Entering: of the rays that enter the scene's box, the axis-aligned one around all triangles; all others of all rays.";
pub(super) const COSTS_DO_NOT_COMPARE: &str =
    "Costs are relative to the root's surface, so those of different containers do not compare.";

/// The constants of the SAH cost, for these rows.
pub(super) fn costs(rows: &[Measurement]) -> String {
    format!(
        "SAH cost with container test {} for each interior node, primitive test {INTERSECTION_COST} for each triangle of a leaf, over \
         the root's area.",
        container_test(rows)
    )
}

/// Cost of a container test in these rows: "1 (1.5 of 14-DOPs and oriented boxes)".
pub(super) fn container_test(rows: &[Measurement]) -> String {
    let costs_more =
        |kind: &ContainerKind| kind.traversal_cost() > TRAVERSAL_COST && rows.iter().any(|row| row.container == *kind);
    let others: Vec<ContainerKind> = ContainerKind::WITH_ORIENTED.into_iter().filter(costs_more).collect();
    let Some(cost) = others.first().map(|kind| kind.traversal_cost()) else { return TRAVERSAL_COST.to_string() };
    let names: Vec<&str> = others.iter().map(|kind| kind.plural()).collect();
    format!("{TRAVERSAL_COST} ({cost} of {})", names.join(" and "))
}

/// Display name of a model among `views`: its file name, with the folder if another model has the same file name, and with its camera
/// if there are several.
pub fn name_among(ModelView { model, camera }: ModelView<'_>, views: &[ModelView<'_>]) -> String {
    let mut name = short(model);
    let shared = views.iter().any(|other| other.model != model && short(other.model) == name);
    let folder = std::path::Path::new(model).parent().and_then(|folder| folder.file_name());
    if let Some(folder) = folder.filter(|_| shared) {
        name = format!("{}/{name}", folder.to_string_lossy());
    }
    if views.iter().any(|other| other.camera != camera) && !camera.is_empty() {
        name = format!("{name}, {camera}");
    }
    name
}

/// The name of a model without its folders, as the window shows it: `bunny.obj`, `teapot 3`.
pub fn short(model: &str) -> String {
    if let Some(builtin) = model.strip_prefix("builtin:") {
        return builtin.replacen(':', " ", 1);
    }
    std::path::Path::new(model).file_name().map_or_else(|| model.to_owned(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    #[test]
    fn spreads_are_relative_to_the_median() {
        let of = |median: f64, times| {
            let mut row = sample().with(BUILD_MS, median);
            row.values.set_spread(BUILD_MS, times);
            spread(&row, BUILD_MS)
        };
        assert_eq!(of(50.0, Some([40.0, 75.0])), "70");
        assert_eq!(of(0.0, Some([0.0, 1.0])), "0");
        let row = |slowest: f64| {
            let mut row = sample().with(BUILD_MS, 50.0);
            row.values.set_spread(BUILD_MS, Some([40.0, slowest]));
            spread_note(&[sample(), row])
        };
        assert!(row(75.0).contains(" vary by up to 70 %"), "{}", row(75.0));
        assert!(!row(50.0).contains("vary"), "{}", row(50.0));
        assert_eq!(of(50.0, None), "–");
    }

    #[test]
    fn conditions_say_how_often_was_measured() {
        let row = |repeat| Measurement { repeat, ..sample() };
        let of = |rows: &[Measurement]| conditions(rows).rsplit(", ").next().map(str::to_owned);
        assert_eq!(of(&[row(1), row(1)]).as_deref(), Some("measured once"));
        assert_eq!(of(&[row(4), row(4)]).as_deref(), Some("medians of 4"));
        assert_eq!(of(&[row(4), row(2)]).as_deref(), Some("medians of 2 to 4"));
        // A run without tree is measured once, whatever is asked for.
        let without = Measurement { builder: "none".to_owned(), ..row(1) };
        assert_eq!(of(&[row(4), without]).as_deref(), Some("medians of 4"));
        assert_eq!(conditions(&[]), "nothing was measured");
    }
}
