//! Sections "Scene", "Build", "Tree" and "Trace": the statistics of the left panel below its headline. For three
//! seconds after a new tree, a row shows the value of the tree before.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use egui::{self, CornerRadius, Id, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::accel::FileTree;
use crate::app::panels::side::findings;
use crate::app::state::comparison::{Comparison, Verdict};
use crate::app::state::{AppState, Derived, Presented};
use crate::app::widgets::{Header, Statistic, Tip as _, section, statistic, value_text};
use crate::app::{format, theme};
use crate::budget::format_bytes;
use crate::catalog::numbers::rows::EPO;
use crate::catalog::numbers::{Direction, NUMBERS, Number, Section};
use crate::catalog::terms;
use crate::scene::Scene;
use bvhscope_engine::query::closed::Edges;
use bvhscope_engine::settings::BuilderKind;

/// Height of the curve of annealing in points.
const CURVE_HEIGHT: f32 = 44.0;

/// Shows the sections.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    // At the moment that is shown, once it is.
    let shown = state.model.presented.as_ref().map(|shown| &shown.accel.scene);
    let scene = state
        .model
        .loaded
        .as_ref()
        .map(|loaded| Arc::clone(shown.filter(|shown| shown.is_same_model(loaded)).unwrap_or(loaded)));
    section(ui, "SCENE", Header::default(), |ui| match &scene {
        Some(scene) => scene_rows(ui, state, scene),
        None => nothing_yet(ui, "No model loaded yet"),
    });
    let Some(shown) = state.model.presented.clone() else {
        section(ui, "BUILD", Header::default(), |ui| {
            nothing_yet(ui, "No tree built yet");
            annealing_now(ui, state);
        });
        return;
    };
    let build = shown.accel.reading().build;
    let summary = build.map_or_else(String::new, |times| format::duration(Duration::from_secs_f64(times.ms / 1e3)));
    section(ui, "BUILD", Header { summary: &summary, ..Header::default() }, |ui| {
        annealing_now(ui, state);
        match &shown.accel.file {
            Some(file) => file_rows(ui, state, file),
            None => build_rows(ui, state, &shown),
        }
    });
    section(ui, "TREE", Header::default(), |ui| tree_rows(ui, state, &shown));
    let (number, unit) = format::duration_parts(shown.frame.stats.trace_time);
    let summary = format!("{number} {unit}");
    section(ui, "TRACE", Header { summary: &summary, ..Header::default() }, |ui| trace_rows(ui, state, &shown));
    findings::show(ui, state, &shown);
    findings::memory(ui, state, &shown);
}

fn nothing_yet(ui: &mut Ui, text: &str) {
    let color = theme::palette(ui).dim;
    ui.label(egui::RichText::new(text).color(color));
}

/// Statistics of the loaded scene.
fn scene_rows(ui: &mut Ui, state: &mut AppState, scene: &Scene) {
    let name = scene.source.label();
    let shown = format::elide_middle(&name, (ui.available_width() / 7.0) as usize);
    ui.add(egui::Label::new(egui::RichText::new(shown).strong()).truncate()).tip(scene.source.to_string());
    if state.model.file_missing && scene.source.path().is_some() {
        let text = egui::RichText::new("The file is gone").color(ui.visuals().warn_fg_color);
        ui.label(text).tip("What is shown stays; it cannot be read again until the file is back");
    }
    let extent = scene.bounds.extent();
    let size = [extent.x, extent.y, extent.z].map(|side| format::significant(f64::from(side))).join(" × ");
    statistic(ui, state, &Statistic::new("Triangles", format::count(scene.triangle_count())));
    if let Some(copies) = &scene.copies {
        let [own, flat] = [scene.bytes() as u64, copies.flat_bytes()].map(format_bytes);
        let tip = format!(
            "Copies of the meshes, of which the tree consists; below each is the tree of its mesh. In memory: {own}, flat {flat}"
        );
        statistic(ui, state, &Statistic::new("Copies", format::count(scene.built_triangles().len() as u64)).tip(tip));
    }
    statistic(ui, state, &Statistic::new("Size", size).tip("Sides of the box around everything, in the file's unit"));
    if scene.offset != glam::DVec3::ZERO {
        let offset = scene.offset.to_array().map(|number| number.to_string()).join(", ");
        let tip = "Subtracted from the coordinates of the file, which single precision would round";
        statistic(ui, state, &Statistic::new("Offset", offset).tip(tip));
    }
    if scene.mesh_count > 1 {
        statistic(ui, state, &Statistic::new("Meshes", format::count(scene.mesh_count as u64)));
    }
    surface_rows(ui, state, scene);
    statistic(ui, state, &Statistic::new("Materials", format::count(scene.materials.len() as u64)));
    if !scene.textures.is_empty() {
        statistic(ui, state, &Statistic::new("Textures", format::count(scene.image_count() as u64)));
    }
    let warnings = &scene.warnings.entries;
    if !warnings.is_empty() {
        let plural = if warnings.len() == 1 { "warning" } else { "warnings" };
        let title = egui::RichText::new(format!("{} {plural}", warnings.len())).color(ui.visuals().warn_fg_color);
        egui::CollapsingHeader::new(title).id_salt("warnings").show(ui, |ui| {
            for warning in warnings {
                ui.add(egui::Label::new(warning.to_string()).wrap());
            }
        });
    }
}

/// Whether the surface of the scene is closed, manifold and consistently oriented.
fn surface_rows(ui: &mut Ui, state: &mut AppState, scene: &Scene) {
    if scene.copies.is_some() {
        return;
    }
    let edges = scene.known_edges();
    let is_large = scene.triangles.len() > Derived::MOST_EDGES_AT_ONCE && !state.model.derived.counts_edges;
    if edges.is_none() && is_large {
        let tip = "Find out whether the model is closed, manifold and consistently oriented: takes a second for a million triangles";
        state.model.derived.counts_edges = ui.link("Count open edges").tip(tip).clicked();
        return;
    }
    let value = |count: fn(&Edges) -> usize, otherwise: &str| match edges.map(count) {
        None => "…".to_owned(),
        Some(0) => format!("none: {otherwise}"),
        Some(count) => format::count(count as u64),
    };
    for (name, value, tip) in [
        (
            "Open edges",
            value(|edges| edges.open, "closed"),
            "Edges of an odd number of triangles, mostly of one. Without any the model is closed: it has an inside",
        ),
        (
            "Shared edges",
            value(|edges| edges.shared_by_many, "manifold"),
            "Edges of more than two triangles. Without any the surface is a manifold, of which each place has two sides",
        ),
        (
            "Turned edges",
            value(|edges| edges.turned, "oriented"),
            "Edges at which one triangle shows its front and the other its back. Without any all fronts are on one side",
        ),
    ] {
        statistic(ui, state, &Statistic::new(name, value).tip(tip));
    }
}

/// Rows about the build of a tree that was read from a file.
fn file_rows(ui: &mut Ui, state: &mut AppState, file: &FileTree) {
    let name = file.name();
    let shown = format::elide_middle(&name, (ui.available_width() / 11.0) as usize);
    statistic(ui, state, &Statistic::new("File", shown).tip(file.path.display().to_string()));
    // Of the program's own builders the name in the window.
    let builder = file.builder();
    let known = BuilderKind::ALL.into_iter().find(|kind| kind.name() == builder);
    let builder = known.map_or_else(|| builder.into_owned(), |kind| kind.label().to_owned());
    statistic(ui, state, &Statistic::new("Builder", builder).tip("As the file says"));
    statistic(
        ui,
        state,
        &Statistic::new("Arity", file.header.arity.to_string()).tip("Most children of a node, as the file says"),
    );
    if let Some(settings) = file.settings_in_words() {
        let short = format::elide_middle(&settings, (ui.available_width() / 11.0) as usize);
        statistic(ui, state, &Statistic::new("Settings", short).tip(settings));
    }
    if file.header.build_ms.is_none() {
        nothing_yet(ui, "The file does not say how long it took");
    }
    for fault in &file.faults {
        let text = egui::RichText::new(fault.to_string()).color(ui.visuals().error_fg_color);
        ui.add(egui::Label::new(text).wrap());
    }
}

/// Statistics of the build, besides its time in the headline.
fn build_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let report = &shown.accel.report;
    for name in shown.accel.reused_stages() {
        stage_row(ui, name, None, 0.0, None);
    }
    let stages = shown.accel.stages();
    let longest = stages.iter().map(|(_, time)| *time).max().unwrap_or_default();
    for (name, time) in stages {
        let costs = report.stages.cost_change(name);
        stage_row(ui, name, Some(time), time.as_secs_f64() / longest.as_secs_f64().max(1e-12), costs);
    }
    annealed(ui, state, &report.stages.annealing);
    numbers(ui, state, shown, Section::Build);
    statistic(ui, state, &Statistic::new("Threads", report.threads.to_string()).tip("Threads that built the tree"));
}

/// Name and time of a stage, with a bar for its time relative to the longest stage (`fraction`). For a pass over the finished tree
/// also the SAH cost before and after it. A stage whose result came from an earlier build has no time (`None`) and no bar.
fn stage_row(ui: &mut Ui, name: &str, time: Option<Duration>, fraction: f64, costs: Option<[f64; 2]>) {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 16.0), Sense::hover());
    let mut text = time.map_or_else(|| "reused".to_owned(), format::duration);
    if let Some([before, after]) = costs {
        text = format!("SAH {}, {text}", format::change(before, after));
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("Stage {name} {text}")));
    let font = egui::TextStyle::Body.resolve(ui.style());
    let painter = ui.painter();
    painter.text(pos2(rect.left() + 8.0, rect.center().y), egui::Align2::LEFT_CENTER, name, font.clone(), palette.dim);
    let bar = Rect::from_min_max(
        pos2(rect.left() + 84.0, rect.center().y - 2.0),
        pos2(rect.right() - if costs.is_some() { 152.0 } else { 68.0 }, rect.center().y + 2.0),
    );
    if bar.width() > 8.0 && time.is_some() {
        painter.rect_filled(bar, CornerRadius::same(2), palette.rail);
        let filled = Rect::from_min_size(bar.min, vec2((bar.width() * fraction as f32).max(1.0), bar.height()));
        painter.rect_filled(filled, CornerRadius::same(2), palette.accent);
    }
    value_text(ui, rect, &text);
    response.tip(match costs {
        Some([before, after]) => format!(
            "Time of this pass over the finished tree, and SAH cost before and after: {} and {}",
            format::significant(before),
            format::significant(after)
        ),
        None if time.is_none() => "Not run: the result of an earlier build of these triangles was reused".to_owned(),
        None => "Time of this stage of the build".to_owned(),
    });
}

/// Statistics of the tree, besides the SAH cost in the headline.
fn tree_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    numbers(ui, state, shown, Section::Tree);
    common_nodes(ui, state, shown.accel.report.stats.nodes);
}

/// The catalogue's numbers of one section.
fn numbers(ui: &mut Ui, state: &mut AppState, shown: &Presented, section: Section) {
    let reading = shown.reading();
    for number in NUMBERS.iter().filter(|number| number.panel == Some(section)) {
        let value = match (number.get)(&reading) {
            Some(value) => format::of_number(number, &value),
            None if number == EPO && !shown.accel.has_epo() => continue,
            None if number.compared.is_some() => "…".to_owned(),
            None => continue,
        };
        let note = number.note.and_then(|note| note(&reading)).map_or_else(String::new, |note| format!("; {note}"));
        let better = match number.compared.and_then(|compared| compared.better) {
            Some(Direction::Less) => ". Lower is better",
            Some(Direction::More) => ". Higher is better",
            None => "",
        };
        let mut row =
            Statistic::new(number.label, value).unit(number.unit).tip(format!("{}{note}{better}", number.meaning));
        if let Some(term) = number.term {
            row = row.term(term);
        }
        changing(ui, state, shown, number, row);
    }
}

/// How many of the first tree's nodes the second has too.
fn common_nodes(ui: &mut Ui, state: &mut AppState, nodes: usize) {
    if state.model.second.is_none() {
        return;
    }
    let tip = "Nodes of A that B has too: those with the same triangles below. Most leaves survive any change, so the share of \
               interior nodes tells more";
    let row = match state.survival() {
        Some(survival) => {
            let [survivors, _] = &**survival;
            let share = format::percent(survivors.nodes as f64 / nodes.max(1) as f64);
            let interior = format::count(survivors.interior as u64);
            let value = format!("{} ({share})", format::count(survivors.nodes as u64));
            Statistic::new("In both trees", value).tip(format!("{tip}. Interior nodes among them: {interior}"))
        }
        None => Statistic::new("In both trees", "…".to_owned()).tip(tip),
    };
    statistic(ui, state, &row.term(terms::NODE));
}

/// A row that shows for a while how its value differs from that of the tree before.
fn changing(ui: &mut Ui, state: &mut AppState, shown: &Presented, number: &Number, row: Statistic<'_>) {
    let text = |value: f64| {
        if value.fract() == 0.0 && value >= 0.0 { format::count(value as u64) } else { format::significant(value) }
    };
    let row = if let Some(second) = &state.model.second {
        let second = match number.compared {
            Some(_) => second.numbers().value(number).map_or_else(|| "…".to_owned(), text),
            // Not among the numbers that are kept to be compared.
            None => (number.get)(&second.reading())
                .map_or_else(|| "–".to_owned(), |value| format::of_number(number, &value)),
        };
        row.beside(second, state.model.compare(number))
    } else if let Some((before, now, verdict)) = recent_change(ui, shown, number) {
        row.change(text(before), (before, now), verdict)
    } else {
        row
    };
    statistic(ui, state, &row);
}

/// Statistics of the newest frame, besides speed and tests per ray in the headline.
fn trace_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let stats = &shown.frame.stats;
    let (number, unit) = format::duration_parts(stats.trace_time);
    let tip = "Wall-clock time of the newest pass, shading included";
    statistic(ui, state, &Statistic::new("Pass time", number).unit(unit).tip(tip).term(terms::PASS));
    let hits = format::percent(stats.hits as f64 / stats.primary_rays.max(1) as f64);
    let tip =
        format!("{} of {} primary rays hit something", format::count(stats.hits), format::count(stats.primary_rays));
    statistic(ui, state, &Statistic::new("Hits", hits).tip(tip).term(terms::PRIMARY_RAY));
    numbers(ui, state, shown, Section::Trace);
}

/// Duration in seconds for which a change is shown.
const SHOWN_SECS: f64 = 3.0;

/// A comparison of two values, and the time at which it was first shown, in seconds.
#[derive(Debug, Clone, Copy)]
struct Seen {
    values: (f64, f64),
    since: f64,
}

/// Stored in egui's memory, because only the presentation depends on it.
type SeenChanges = HashMap<&'static str, Seen>;

/// The value of the tree before and the verdict, while a recent change is shown; `None` where the two trees' values do not
/// compare.
pub(super) fn recent_change(ui: &Ui, shown: &Presented, number: &Number) -> Option<(f64, f64, Verdict)> {
    let id = Id::unique("recent changes");
    let Comparison::Change { before, now, verdict, .. } = shown.compare(number) else {
        ui.data_mut(|data| data.get_temp_mut_or_default::<SeenChanges>(id).remove(number.key));
        return None;
    };
    let time = ui.input(|input| input.time);
    let since = ui.data_mut(|data| {
        let seen = data.get_temp_mut_or_default::<SeenChanges>(id).entry(number.key);
        let seen = seen.or_insert(Seen { values: (before, now), since: time });
        if seen.values != (before, now) {
            *seen = Seen { values: (before, now), since: time };
        }
        seen.since
    });
    let left = SHOWN_SECS - (time - since);
    if left <= 0.0 || matches!(verdict, Verdict::Same | Verdict::Undecided | Verdict::Once) {
        return None;
    }
    ui.ctx().request_repaint_after_secs(left as f32 + 0.05);
    Some((before, now, verdict))
}

/// Shows how the cost falls in the build that runs, if it anneals.
fn annealing_now(ui: &mut Ui, state: &mut AppState) {
    let Some(job) = &state.activity.build else { return };
    let (costs, left) = (job.costs.clone(), job.time_left(std::time::Instant::now()));
    if costs.is_empty() {
        return;
    }
    let left = left.map_or_else(String::new, |left| format!(", {} left", format::duration(left)));
    annealing_curve(ui, state, "Annealing", &left, &costs);
}

/// Shows how the cost fell in a build that is finished; nothing where it did not anneal.
fn annealed(ui: &mut Ui, state: &mut AppState, costs: &[(Duration, f64)]) {
    if !costs.is_empty() {
        annealing_curve(ui, state, "Annealed", "", costs);
    }
}

fn annealing_curve(ui: &mut Ui, state: &mut AppState, label: &'static str, note: &str, costs: &[(Duration, f64)]) {
    let (Some(&(_, first)), Some(&(duration, last))) = (costs.first(), costs.last()) else { return };
    let [before, after] = [first, last].map(cost_text);
    let gain = format::change(first, last);
    let rounds = costs.len() - 1;
    let tip = format!("SAH cost before the first round and after the last of {rounds} so far, with the best leaves");
    statistic(ui, state, &Statistic::new(label, format!("{before} to {after}, {gain}")).tip(tip));
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), CURVE_HEIGHT), Sense::hover());
    let time = format!("{} rounds in {}{note}", format::count(rounds as u64), format::duration(duration));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("SAH cost: {before} to {after}, {time}")));
    let palette = theme::palette(ui);
    let plot = rect.shrink2(vec2(8.0, 4.0));
    let lowest = costs.iter().map(|&(_, cost)| cost).fold(f64::INFINITY, f64::min);
    let highest = costs.iter().map(|&(_, cost)| cost).fold(f64::NEG_INFINITY, f64::max);
    let point = |time: Duration, cost: f64| {
        let x = time.as_secs_f64() / duration.as_secs_f64().max(1e-9);
        let y = (highest - cost) / (highest - lowest).max(1e-9);
        pos2(plot.left() + plot.width() * x as f32, plot.top() + plot.height() * y as f32)
    };
    let painter = ui.painter();
    let level = point(Duration::ZERO, first).y;
    painter.hline(plot.x_range(), level, Stroke::new(1.0, palette.line));
    let points = costs.iter().map(|&(time, cost)| point(time, cost)).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, palette.accent)));
    let at = |x: f32| duration.mul_f32(((x - plot.left()) / plot.width()).clamp(0.0, 1.0));
    let text = match response.hover_pos().map(|pointer| at(pointer.x)) {
        Some(hovered) => {
            let round = costs.partition_point(|&(time, _)| time <= hovered).max(1) - 1;
            let (time, cost) = costs[round];
            painter.circle_filled(point(time, cost), 3.0, palette.accent);
            format!("SAH cost {} after round {round}, {}", cost_text(cost), format::duration(time))
        }
        None => time,
    };
    ui.label(egui::RichText::new(text).small().color(palette.dim));
    response.tip("SAH cost over the time of annealing: at first it may rise, so that better trees can be reached");
}

/// A cost with the digits in which late rounds differ.
fn cost_text(cost: f64) -> String {
    format!("{cost:.3}")
}
