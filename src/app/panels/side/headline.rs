//! The headline of the left panel: four numbers that say whether the tree is good, each with its difference from the tree before.

use std::time::Duration;

use egui::{self, Align2, Color32, CornerRadius, FontId, Rect, Role, Sense, Ui, WidgetInfo, vec2};

use bvhscope_engine::settings::{BuildSettings, Pass};
use bvhscope_engine::tree::statistics::INTERSECTION_COST;

use crate::accel::Accel;
use crate::app::state::comparison::Comparison;
use crate::app::state::{AppState, PROGRESS_DELAY, Presented};
use crate::app::widgets::{Tip as _, copies, difference, tip_with_hint};
use crate::app::{format, theme};
use crate::catalog::numbers::rows::{BUILD_MS, MRAYS_PER_S, SAH_COST, TESTS_PER_ENTERING_RAY};
use crate::catalog::numbers::{Number, millions_per_second};
use crate::catalog::reading::{EnteringReading, Times};
use crate::catalog::terms::{self, Term};

/// Height of a tile in points.
const TILE_HEIGHT: f32 = 52.0;
/// Gap between two tiles in points.
const GAP: f32 = 6.0;
/// Font size of the numbers in points.
const NUMBER_SIZE: f32 = 17.0;
/// Font size of the numbers of two trees side by side in points.
const PAIR_SIZE: f32 = 14.0;

/// One of the four numbers.
struct Tile {
    quantity: &'static Number,
    name: &'static str,
    number: String,
    /// The number of the second tree, where there is one.
    second: Option<String>,
    unit: &'static str,
    /// Shown below the number where no difference is.
    remark: Option<String>,
    tip: String,
    term: &'static Term,
}

/// Shows the tiles, two in a row.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let shown = state.model.presented.clone();
    let stale = title(ui, state, shown.as_ref());
    ui.add_space(2.0);
    let tiles = tiles(state, shown.as_ref());
    let width = (ui.available_width() - GAP) * 0.5;
    ui.spacing_mut().item_spacing = vec2(GAP, GAP);
    for pair in tiles.chunks(2) {
        ui.horizontal(|ui| {
            for tile in pair {
                let comparison = state.model.compare(tile.quantity);
                show_tile(ui, state, tile, comparison, (width, stale));
            }
        });
    }
}

/// The line above the tiles: which tree the numbers are of. Returns whether that is not the wanted one.
fn title(ui: &mut Ui, state: &AppState, shown: Option<&Presented>) -> bool {
    let palette = theme::palette(ui);
    let jobs = &state.activity;
    let is_late = |job: &crate::app::state::JobStatus| job.since.elapsed() >= PROGRESS_DELAY;
    let stale = shown.is_some() && jobs.load.as_ref().or(jobs.build.as_ref()).is_some_and(is_late);
    let text = match shown {
        None => "No tree yet".to_owned(),
        Some(_) if stale && jobs.load.is_some() => "Of the model before the one that loads".to_owned(),
        Some(shown) if stale && is_before_annealing(state, shown) => format!("{}, before it is annealed", shown.name()),
        Some(_) if stale => "Of the tree before".to_owned(),
        Some(shown) => shown.name(),
    };
    let color = if stale { palette.warning } else { palette.dim };
    let second = state.model.second.as_ref().map(Presented::name);
    let text = if second.is_some() { format!("A: {text}") } else { text };
    let label = ui.add(egui::Label::new(egui::RichText::new(text).small().color(color)).wrap());
    if let Some(second) = second {
        let text = egui::RichText::new(format!("B: {second}")).small().color(palette.dim);
        ui.add(egui::Label::new(text).wrap()).tip("The second tree, which the first is compared with");
    }
    label.tip(if stale {
        "What is shown stays until the new tree has a picture"
    } else {
        "The tree that picture and numbers are of"
    });
    stale
}

/// True if the wanted tree is the shown one after annealing: a new model is shown before that.
fn is_before_annealing(state: &AppState, shown: &Presented) -> bool {
    let wanted = &state.wanted.build;
    let optimize = wanted.optimize.without(Pass::Anneal);
    optimize != wanted.optimize && shown.accel.settings == BuildSettings { optimize, ..*wanted }
}

/// The time of a whole build, of which the number is the median, or of the only one; `None` where it is not known.
fn build_times(shown: &Presented) -> Option<Times> {
    shown.accel.reading().build
}

/// Both clocks of a build: the binary tree, whose time is the number, and all that rays need.
fn build_tip(shown: Option<&Presented>, second: Option<&Presented>) -> String {
    let ready = shown.and_then(|shown| shown.accel.reading().ready_ms);
    let ready = ready.map_or_else(String::new, |ready| {
        format!(". Ready to trace, with the wide tree that rays go through: {}", format::duration(milliseconds(ready)))
    });
    if let Some(shown) = shown.filter(|shown| shown.accel.is_followed()) {
        let policy = shown.accel.follow.policy.label();
        return format!(
            "Wall-clock time of changing the tree of the moment before by the policy {policy}{ready}. Lower is better"
        );
    }
    let of = match shown.and_then(reused_stages) {
        Some(text) => format!("the sum of the stages that ran. {text}: it is not the time of a whole build"),
        None if shown.is_some_and(|shown| shown.accel.whole_builds().is_some()) => {
            "the median of whole builds, repeated at rest".to_owned()
        }
        None => "built once; repeated once all is at rest".to_owned(),
    };
    let of_tree = |(name, shown): (&str, Option<&Presented>)| {
        let times = shown?.accel.whole_builds()?.times;
        let [lower, upper] = times.spread?.map(|ms| format::duration(milliseconds(ms)));
        Some(format!("\n{name}half of them from {lower} to {upper}, {}", times.count_text("builds")))
    };
    let names = if second.is_some() { ["A: ", "B: "] } else { [""; 2] };
    let spreads: String = names.into_iter().zip([shown, second]).filter_map(of_tree).collect();
    format!("Wall-clock time of the binary tree: {of}{ready}. Lower is better{spreads}")
}

fn milliseconds(ms: f64) -> Duration {
    Duration::from_secs_f64(ms.max(0.0) / 1e3)
}

/// The quartiles of the speed at rest; `None` until it is measured.
fn speed_spread(shown: &Presented) -> Option<[String; 2]> {
    let readings = shown.accel.at_rest()?;
    let [lower, upper] = readings.traces.spread?;
    Some([upper, lower].map(|ms| format::significant(millions_per_second(readings.rays, ms))))
}

/// How the speed was measured, with the spread of each tree.
fn speed_tip(first: Option<&Presented>, second: Option<&Presented>) -> String {
    let of_tree = |(name, shown): (&str, Option<&Presented>)| {
        let readings = shown?.accel.at_rest()?;
        let [least, most] = speed_spread(shown?)?;
        Some(format!(
            "\n{name}half of the rounds from {least} to {most} Mray/s, {}",
            readings.traces.count_text("rounds")
        ))
    };
    let names = if second.is_some() { ["A: ", "B: "] } else { [""; 2] };
    let spreads: String = names.into_iter().zip([first, second]).filter_map(of_tree).collect();
    format!(
        "Primary rays per second through the wide tree, in millions, without shading, in a view of 1024×1024 pixels from the model's default camera: the median of rounds at rest, two trees in turn. Higher is better{spreads}"
    )
}

/// The line below the build time: lower and upper quartile of the repetitions, or the number of reused stages.
fn build_remark(shown: &Presented) -> Option<String> {
    let spread = shown.accel.whole_builds().and_then(|builds| builds.times.spread);
    let spread = spread.map(|ends| {
        let [fastest, slowest] = ends.map(|ms| format::duration(milliseconds(ms)));
        format!("{fastest} to {slowest}")
    });
    spread.or_else(|| reused_stages(shown))
}

/// How many stages of its build came from an earlier one; `None` where all ran, and where whole builds were measured.
fn reused_stages(shown: &Presented) -> Option<String> {
    let count = shown.accel.reused_stages().len() as u64;
    (count > 0).then(|| format!("{} reused", format::counted(count, "stage")))
}

/// The tests of a ray, estimated until they are counted.
fn tests_text(accel: &Accel) -> String {
    let text = |counts: EnteringReading| format::significant(f64::from(counts.tests));
    match (accel.entering(), accel.entering_estimate()) {
        (Some(counts), _) => text(counts),
        (None, Some(estimate)) => format!("≈ {}", text(estimate)),
        (None, None) => "…".to_owned(),
    }
}

#[expect(clippy::too_many_lines, reason = "a list of tiles")]
fn tiles(state: &AppState, shown: Option<&Presented>) -> [Tile; 4] {
    let report = shown.map(|shown| &shown.accel.report);
    let times = shown.map(build_times);
    let (build, unit) = match times {
        None => ("…".to_owned(), ""),
        Some(None) => ("–".to_owned(), ""),
        Some(Some(times)) => format::duration_parts(milliseconds(times.ms)),
    };
    let sah = report.map(|report| format::significant(f64::from(report.stats.sah_cost)));
    let speed = shown.and_then(|shown| shown.numbers().value(MRAYS_PER_S)).map(format::significant);
    let unknown = || "…".to_owned();
    let other = state.model.second.as_ref();
    let of_second = |quantity: &'static Number| {
        other.map(|other| other.numbers().value(quantity).map_or_else(unknown, format::significant))
    };
    let tests = |shown: &Presented| tests_text(&shown.accel);
    // Both times in the unit of the first.
    let second_build = other.zip(times.flatten()).map(|(other, first)| {
        let scale = format::duration_scale(milliseconds(first.ms));
        build_times(other).map_or_else(|| "–".to_owned(), |times| format::significant(times.ms / 1e3 * scale))
    });
    [
        Tile {
            quantity: BUILD_MS,
            name: if shown.is_some_and(|shown| shown.accel.is_followed()) { "Update time" } else { "Build time" },
            number: build,
            second: second_build,
            unit,
            remark: shown.and_then(build_remark),
            tip: build_tip(shown, other),
            term: terms::BUILD_TIME,
        },
        Tile {
            quantity: SAH_COST,
            name: "SAH cost",
            number: sah.unwrap_or_else(unknown),
            second: of_second(SAH_COST),
            unit: "",
            remark: None,
            tip: format!(
                "Expected cost of a ray by the surface area heuristic: container test {}, triangle test {INTERSECTION_COST}, over the root's area. Lower is better",
                state.container_kind().traversal_cost()
            ),
            term: terms::SAH_COST,
        },
        Tile {
            quantity: TESTS_PER_ENTERING_RAY,
            name: "Tests per ray",
            number: shown.map_or_else(unknown, tests),
            second: other.map(tests),
            unit: "",
            remark: None,
            tip: "Container and triangle tests of a primary ray that enters the scene's box, on average, in a view of 1024×1024 pixels from the model's default camera: the same in every window; at first an estimate by fewer rays. Section Trace has the mean of this picture. Lower is better"
                .to_owned(),
            term: terms::TESTS_PER_RAY,
        },
        Tile {
            quantity: MRAYS_PER_S,
            name: "Speed",
            number: speed.unwrap_or_else(unknown),
            second: of_second(MRAYS_PER_S),
            unit: "Mray/s",
            remark: shown.and_then(speed_spread).map(|[least, most]| format!("{least} to {most}")),
            tip: speed_tip(shown, other),
            term: terms::MRAYS_PER_SECOND,
        },
    ]
}

fn show_tile(ui: &mut Ui, state: &mut AppState, tile: &Tile, comparison: Comparison, (width, stale): (f32, bool)) {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, TILE_HEIGHT), Sense::click());
    let text = match &tile.second {
        Some(second) => format!("A {} {unit}, B {second} {unit}", tile.number, unit = tile.unit),
        None => format!("{} {}", tile.number, tile.unit),
    };
    let text = text.trim();
    let two_trees = tile.second.is_some();
    let remark = || tile.remark.clone().map(|remark| (remark, palette.dim));
    let line = difference::line(comparison, two_trees, &palette).or_else(remark).filter(|_| !stale);
    let spoken = line.as_ref().map_or_else(String::new, |(line, _)| format!(", {line}"));
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {text}{spoken}", tile.name)));
    let fill =
        if response.hovered() { ui.visuals().widgets.inactive.weak_bg_fill } else { ui.visuals().faint_bg_color };
    ui.painter().rect_filled(rect, CornerRadius::same(4), fill);
    let inside = rect.shrink2(vec2(8.0, 4.0));
    let small = FontId::proportional(theme::HEADING_SIZE);
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let color = if stale { palette.dim } else { palette.text };
    if let Some(second) = &tile.second {
        let name = format!("{}  {}", tile.name, tile.unit);
        painter.text(inside.left_top(), Align2::LEFT_TOP, name.trim(), small.clone(), palette.dim);
        pair(&painter, inside, [&tile.number, second], color, palette.dim);
    } else {
        painter.text(inside.left_top(), Align2::LEFT_TOP, tile.name, small.clone(), palette.dim);
        number(&painter, inside, tile, color, palette.dim);
    }
    if let Some((line, color)) = line {
        let text = painter.text(inside.left_bottom(), Align2::LEFT_BOTTOM, line, small, color);
        if two_trees {
            difference::paint_arrow(&painter, text.right_center() + vec2(9.0, 0.0), comparison, &palette);
        }
    }
    copies(state, &response, tile.name, (&tile.number, text), Some(tile.term));
    let unit = tile.unit;
    let before = difference::sentence(comparison, two_trees, |value| {
        if tile.quantity == BUILD_MS {
            format::duration(milliseconds(value))
        } else {
            format!("{} {unit}", format::significant(value)).trim().to_owned()
        }
    });
    let tip = before.map_or_else(|| tile.tip.clone(), |before| format!("{}\n{before}", tile.tip));
    response.tip(tip_with_hint(&tip));
}

/// Paints the numbers of two trees, each behind its letter, in the middle of the tile.
fn pair(painter: &egui::Painter, inside: Rect, numbers: [&str; 2], color: Color32, dim: Color32) {
    let half = inside.width() * 0.5;
    for (side, number, shift) in [("A", numbers[0], 0.0), ("B", numbers[1], half)] {
        let at = inside.left_center() + vec2(shift, -0.5);
        let letter = painter.text(at, Align2::LEFT_CENTER, side, FontId::proportional(theme::HEADING_SIZE), dim);
        let size = if number.chars().count() > 4 { PAIR_SIZE - 2.0 } else { PAIR_SIZE };
        let at = letter.right_center() + vec2(3.0, 0.0);
        painter.text(at, Align2::LEFT_CENTER, number, FontId::proportional(size), color);
    }
}

/// Paints the number with its unit behind it, in the middle of the tile.
fn number(painter: &egui::Painter, inside: Rect, tile: &Tile, color: Color32, dim: Color32) {
    let font = FontId::proportional(NUMBER_SIZE);
    let at = inside.left_center() + vec2(0.0, -0.5);
    let number = painter.text(at, Align2::LEFT_CENTER, &tile.number, font, color);
    let unit = number.right_bottom() + vec2(3.0, -2.0);
    painter.text(unit, Align2::LEFT_BOTTOM, tile.unit, FontId::proportional(theme::HEADING_SIZE), dim);
}
