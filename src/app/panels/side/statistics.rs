//! Sections "Scene", "Build", "Tree" and "Trace": the statistics of the left panel.

use std::time::Duration;

use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use bvhscope_engine::{BuildReport, WideBvh};
use egui::{self, CornerRadius, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use crate::app::panels::side::recent_changes::RecentChanges;
use crate::app::panels::widgets::{Header, Statistic, section, statistic, value_text};
use crate::app::state::{AppState, Presented};
use crate::app::{format, theme};
use crate::scene::Scene;

/// Shows the four sections.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let scene = state.model.loaded.clone();
    section(ui, "SCENE", Header::default(), |ui| match &scene {
        Some(scene) => scene_rows(ui, state, scene),
        None => nothing_yet(ui, "No model loaded yet"),
    });
    let Some(shown) = state.model.presented.clone() else {
        section(ui, "BUILD", Header::default(), |ui| nothing_yet(ui, "No tree built yet"));
        return;
    };
    let model = shown.accel.scene.source.to_string();
    let mut changes = RecentChanges::load(ui, &model);
    let summary = format::duration(shown.accel.report.build_time);
    section(ui, "BUILD", Header { summary: &summary, ..Header::default() }, |ui| {
        build_rows(ui, state, &shown, &mut changes);
    });
    section(ui, "TREE", Header::default(), |ui| tree_rows(ui, state, &shown, &mut changes));
    section(ui, "TRACE", Header::default(), |ui| trace_rows(ui, state, &shown, &mut changes));
    changes.store(ui);
}

fn nothing_yet(ui: &mut Ui, text: &str) {
    let color = theme::palette(ui).dim;
    ui.label(egui::RichText::new(text).color(color));
}

/// Statistics of the loaded scene.
fn scene_rows(ui: &mut Ui, state: &mut AppState, scene: &Scene) {
    let name = scene.source.label();
    let shown = format::elide_middle(&name, (ui.available_width() / 7.0) as usize);
    ui.add(egui::Label::new(egui::RichText::new(shown).strong()).truncate()).on_hover_text(scene.source.to_string());
    if state.model.file_missing && scene.source.path().is_some() {
        let text = egui::RichText::new("The file is gone").color(ui.visuals().warn_fg_color);
        ui.label(text).on_hover_text("What is shown stays; it cannot be read again until the file is back");
    }
    let extent = scene.bounds.extent();
    let size = [extent.x, extent.y, extent.z].map(|side| format::significant(f64::from(side))).join(" × ");
    statistic(ui, state, &Statistic::new("Triangles", format::count(scene.triangles.len() as u64)));
    statistic(ui, state, &Statistic::new("Size", size).tip("Sides of the box around everything, in the file's unit"));
    if scene.mesh_count > 1 {
        statistic(ui, state, &Statistic::new("Meshes", format::count(scene.mesh_count as u64)));
    }
    statistic(ui, state, &Statistic::new("Materials", format::count(scene.materials.len() as u64)));
    if !scene.textures.is_empty() {
        statistic(ui, state, &Statistic::new("Textures", format::count(scene.textures.len() as u64)));
    }
    let (number, unit) = format::bytes_parts(scene.bytes());
    statistic(
        ui,
        state,
        &Statistic::new("Memory", number).unit(unit).tip("Triangles, attributes and textures as loaded"),
    );
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

/// Statistics of the build.
fn build_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, changes: &mut RecentChanges) {
    let report = &shown.accel.report;
    let total = report.build_time.as_secs_f64();
    let before = changes.observe(ui, "build", total);
    let (number, unit) = format::duration_parts(report.build_time);
    let tip = "Wall-clock time of the build: the sum of the stages that ran";
    let mut row = Statistic::new("Build time", number).unit(unit).tip(tip);
    if let Some(before) = before {
        row = row.change(format::duration(Duration::from_secs_f64(before)), format::change(before, total));
    }
    statistic(ui, state, &row);
    for name in &report.stages.reused {
        stage_row(ui, name, None, 0.0, None);
    }
    let longest = report.stages.stages.iter().map(|(_, time)| *time).max().unwrap_or_default();
    for (name, time) in &report.stages.stages {
        let costs = report.stages.cost_change(name);
        stage_row(ui, name, Some(*time), time.as_secs_f64() / longest.as_secs_f64().max(1e-12), costs);
    }
    let rate = report.mtriangles_per_s();
    let tip = "Triangles built per second, in millions";
    statistic(ui, state, &Statistic::new("Speed", format::significant(rate)).unit("Mtri/s").tip(tip));
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
    response.on_hover_text(match costs {
        Some([before, after]) => format!(
            "Time of this pass over the finished tree, and SAH cost before and after: {} and {}",
            format::significant(before),
            format::significant(after)
        ),
        None if time.is_none() => "Not run: the result of an earlier build of these triangles was reused".to_owned(),
        None => "Time of this stage of the build".to_owned(),
    });
}

/// Statistics of the tree: quality, nodes, memory.
fn tree_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, changes: &mut RecentChanges) {
    let report: &BuildReport = &shown.accel.report;
    let stats = &report.stats;
    let significant = |value: f32| format::significant(f64::from(value));
    let mut changing = |ui: &mut Ui, state: &mut AppState, name: &'static str, value: f64, tip: String| {
        let text = |value: f64| {
            if value.fract() == 0.0 && value >= 0.0 { format::count(value as u64) } else { format::significant(value) }
        };
        let mut row = Statistic::new(name, text(value)).tip(tip);
        if let Some(before) = changes.observe(ui, name, value) {
            row = row.change(text(before), format::change(before, value));
        }
        statistic(ui, state, &row);
    };
    let sah_tip = format!(
        "Expected cost of a ray by the surface area heuristic: container test {TRAVERSAL_COST}, triangle test {INTERSECTION_COST}, over the root's area. Lower is better"
    );
    let epo = shown.accel.known_epo();
    let epo_note = epo.and_then(|epo| epo.estimate_note()).map_or_else(String::new, |note| format!("; {note}"));
    let epo_tip = format!(
        "End-point overlap (Aila et al. 2013): surface inside nodes that do not contain it{epo_note}. Lower is better"
    );
    changing(ui, state, "SAH cost", f64::from((stats.sah_cost * 100.0).round() / 100.0), sah_tip);
    match epo {
        Some(epo) => changing(ui, state, "EPO", f64::from(epo.value), epo_tip),
        None => statistic(ui, state, &Statistic::new("EPO", "…".to_owned()).tip(epo_tip)),
    }
    changing(ui, state, "Nodes", stats.nodes as f64, "Interior nodes and leaves".to_owned());
    changing(ui, state, "Leaves", stats.leaves as f64, "Nodes that hold triangles".to_owned());
    let depth_tip =
        format!("Depth of the deepest node, root 0; leaves lie at {} on average", significant(stats.mean_leaf_depth));
    changing(ui, state, "Depth", f64::from(stats.max_depth), depth_tip);
    let leaf = format!("{} / {} / {}", stats.min_leaf_size, significant(stats.mean_leaf_size), stats.max_leaf_size);
    statistic(ui, state, &Statistic::new("Leaf size", leaf).tip("Triangles in a leaf: smallest, mean, largest"));
    let triangles = shown.accel.scene.triangles.len().max(1);
    let overlay_bytes = Levels::bytes(stats.nodes);
    let wide = shown.accel.known_wide();
    for (name, bytes, tip) in [
        ("Tree memory", Some(report.tree_bytes), "Nodes and triangle indices"),
        ("Leaf triangles", Some(report.triangle_bytes), "Triangles in leaf order"),
        (
            "Wide tree",
            wide.map(|wide| wide.tree.node_bytes()),
            "Nodes with up to eight children, which camera rays traverse",
        ),
        ("Wide triangles", wide.map(|wide| wide.tree.triangle_bytes()), "Triangles in blocks of four"),
        ("Overlay", Some(overlay_bytes), "Indices of the nodes at each depth, for the overlay"),
    ] {
        let Some(bytes) = bytes else {
            statistic(ui, state, &Statistic::new(name, "…".to_owned()).tip(tip));
            continue;
        };
        let (number, unit) = format::bytes_parts(bytes);
        let each = format::significant(bytes as f64 / triangles as f64);
        let tip = format!("{tip}: {each} bytes a triangle");
        statistic(ui, state, &Statistic::new(name, number).unit(unit).tip(tip));
    }
    let [binary, wide] = [report.bytes_per_triangle(), wide.map_or(0.0, WideBvh::bytes_per_triangle)];
    let [all, binary, wide] = [binary + wide, binary, wide].map(format::significant);
    let tip = format!("Both trees with their triangles, for each triangle: binary {binary}, wide {wide}");
    statistic(ui, state, &Statistic::new("Per triangle", all).unit("B").tip(tip));
}

/// Statistics of the newest frame.
fn trace_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, changes: &mut RecentChanges) {
    let stats = &shown.frame.stats;
    let (number, unit) = format::duration_parts(stats.trace_time);
    statistic(
        ui,
        state,
        &Statistic::new("Trace time", number).unit(unit).tip("Wall-clock time of the newest pass, shading included"),
    );
    let tip = "Primary rays per second, in millions: the median of the last second";
    let speed = format::significant(state.activity.mrays_per_s);
    statistic(ui, state, &Statistic::new("Speed", speed).unit("Mray/s").tip(tip));
    let hits = format::percent(stats.hits as f64 / stats.primary_rays.max(1) as f64);
    let tip =
        format!("{} of {} primary rays hit something", format::count(stats.hits), format::count(stats.primary_rays));
    statistic(ui, state, &Statistic::new("Hits", hits).tip(tip));
    let tests = |select: fn([f32; 2]) -> f32| shown.tests_per_ray.map(select);
    let (containers, primitives) = (tests(|[containers, _]| containers), tests(|[_, primitives]| primitives));
    for (name, tests, tip) in [
        (
            "Tests per ray",
            tests(|[containers, primitives]| containers + primitives),
            "Container and triangle tests of a primary ray, on average",
        ),
        ("Container tests", containers, "Containers tested by a primary ray, on average"),
        ("Triangle tests", primitives, "Triangles tested by a primary ray, on average"),
    ] {
        let mut row = match tests {
            Some(tests) => Statistic::new(name, format::significant(f64::from(tests))).tip(tip),
            None => Statistic::new(name, "…".to_owned()).tip(format!("{tip}. Counted once the picture is at rest")),
        };
        if let Some(tests) = tests
            && let Some(before) = changes.observe(ui, name, f64::from((tests * 100.0).round() / 100.0))
        {
            row = row.change(format::significant(before), format::change(before, f64::from(tests)));
        }
        statistic(ui, state, &row);
    }
}
