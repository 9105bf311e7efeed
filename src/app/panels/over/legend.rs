//! Legends of the picture's and the containers' colours in the lower left corner of the viewport.

use std::sync::Arc;

use egui::{
    Align2, Color32, CornerRadius, FontId, Galley, Painter, Rect, Role as AccessRole, Sense, Stroke, StrokeKind, Ui,
    Vec2, WidgetInfo, pos2, vec2,
};

use crate::app::state::{AppState, CompareView, Presented, Standing, TreeSide};
use crate::app::{format, theme};
use crate::lab::diff::{DifferenceMap, diverging};
use crate::overlay::{self, ColorScale, NodeTable, Role};
use crate::render::{Frame, HeatKind, Shading};
use bvhscope_engine::construction::Cut;

/// Width of a legend in points, unless its title or a row needs more.
const WIDTH: f32 = 208.0;
/// Left and right of what a legend holds, in points.
const MARGIN: f32 = 8.0;
/// Largest share of the viewport that legends may take.
const MAX_SHARE: f32 = 0.18;
/// Height of a legend's title in points.
const TITLE_HEIGHT: f32 = 20.0;
/// Height of a gradient with its labels in points.
const RAMP_HEIGHT: f32 = 28.0;
/// Steps of a gradient.
const STEPS: u16 = 48;
/// Width of the sample of a line in points, twice that of the lines of the picture: so widths differ by whole points.
const LINE_WIDTH: f32 = 2.5;
/// Gap after a sample, and before a name, in points.
const MARK_GAP: f32 = 2.0;
/// Gap after a name in points.
const SWATCH_GAP: f32 = 10.0;
/// Height of a row of swatches or of text in points.
const LINE_HEIGHT: f32 = 18.0;

/// Title and rows of a legend.
struct LegendBox {
    title: String,
    parts: Vec<Part>,
}

/// A row of a legend.
enum Part {
    /// A gradient with labelled stops.
    Ramp {
        /// Positions between 0 and 1, with the label of each.
        stops: Vec<(f32, String)>,
        /// The part of the gradient that is in use; the rest is dimmed.
        used: Option<[f32; 2]>,
        /// sRGB colour at a position between 0 and 1.
        color: Box<dyn Fn(f32) -> [u8; 3]>,
    },
    /// Names, each with what it stands for.
    Swatches(Vec<(Vec<Mark>, String)>),
    /// Text, where single colours have no meaning.
    Text(String),
}

/// A sample of what is drawn in a colour.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    color: [u8; 3],
    /// Width of a line relative to the usual one; `None` for a surface.
    line: Option<f32>,
}

impl Mark {
    const fn surface(color: [u8; 3]) -> Self {
        Self { color, line: None }
    }

    /// Lines of a role, which differ by width where they do not by colour. Containers drawn by depth are white.
    fn of_role(role: Role) -> Self {
        let line = (role != Role::Overlap).then_some(role.width());
        Self { color: role.color().unwrap_or([255; 3]), line }
    }

    fn size(self) -> Vec2 {
        self.line.map_or(vec2(8.0, 8.0), |width| vec2(12.0, LINE_WIDTH * width))
    }
}

impl Part {
    const fn height(&self) -> f32 {
        match self {
            Self::Ramp { .. } => RAMP_HEIGHT,
            Self::Swatches(_) | Self::Text(_) => LINE_HEIGHT,
        }
    }

    /// Width in points that it needs. A gradient has whatever there is, with as many labels as it holds.
    fn width(&self, painter: &Painter) -> f32 {
        match self {
            Self::Ramp { .. } => 0.0,
            Self::Swatches(swatches) => SwatchRow::of(painter, swatches).width,
            Self::Text(text) => laid_out(painter, text).size().x,
        }
    }

    /// Accessible description.
    fn text(&self) -> String {
        match self {
            Self::Ramp { stops, .. } => stops.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>().join(", "),
            Self::Swatches(swatches) => swatches.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(", "),
            Self::Text(text) => text.clone(),
        }
    }
}

/// Text of a legend in a colour that is chosen when it is painted.
fn laid_out(painter: &Painter, text: &str) -> Arc<Galley> {
    painter.layout_no_wrap(text.to_owned(), FontId::proportional(theme::HEADING_SIZE), Color32::PLACEHOLDER)
}

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &AppState) {
    let mut bottom = rect.bottom() - 12.0;
    let mut free_area = rect.area() * MAX_SHARE;
    for legend in [picture_legend(state), overlay_legend(state)].into_iter().flatten() {
        let height = TITLE_HEIGHT + legend.parts.iter().map(Part::height).sum::<f32>() + 4.0;
        let title = laid_out(ui.painter(), &legend.title);
        let widths = legend.parts.iter().map(|part| part.width(ui.painter()));
        let needed = widths.fold(title.size().x, f32::max) + 2.0 * MARGIN;
        let size = vec2(WIDTH.max(needed).min(rect.width() - 24.0), height);
        let place = Rect::from_min_size(pos2(rect.left() + 12.0, bottom - size.y), size);
        // In a small viewport the picture comes first.
        free_area -= size.x * size.y;
        if place.top() > rect.top() + 12.0 && size.x > 80.0 && free_area >= 0.0 {
            paint(ui, place, &legend);
        }
        bottom -= size.y + 8.0;
    }
}

/// Legend of the containers.
fn overlay_legend(state: &AppState) -> Option<LegendBox> {
    let shown = state.model.presented.as_ref()?;
    if state.drawn_kinds().is_empty() || state.layout.graphics.failed {
        return None;
    }
    let nodes = state.layout.graphics.shown.as_ref()?;
    let standing = state.layout.graphics.standing.as_deref();
    let table = match standing {
        Some(standing) => standing.table().unwrap_or(&shown.table),
        None => state.model.table()?,
    };
    let legend = overlay::legend(nodes);
    let roles =
        [Some(marked_roles(state, shown, standing)), filled_roles(state, shown, standing), ray_roles(state, table)];
    let is_coded = state.preferences.show_geometry && shown.frame.settings.shading.is_coded();
    let (title, colors) = if is_coded {
        // Colours of lines would be mistaken for those of the picture.
        let shown = vec![(vec![Mark::of_role(Role::Shown)], drawn_nodes(state, standing))];
        ("Containers".to_owned(), vec![Part::Swatches(shown)])
    } else if nodes.colors == ColorScale::Survival {
        survivors_legend(state, standing.is_some_and(|standing| standing.table().is_some()))
    } else {
        let colors = if nodes.colors == ColorScale::Planes {
            Part::Swatches(
                legend.stops.into_iter().map(|(at, kind)| (vec![Mark::surface(overlay::ramp(at))], kind)).collect(),
            )
        } else {
            Part::Ramp {
                stops: legend.stops,
                used: standing.is_none().then_some(legend.drawn),
                color: Box::new(overlay::ramp),
            }
        };
        (format!("Containers: {}", format::lower(legend.title)), vec![colors])
    };
    let cut = (nodes.nodes.len() < nodes.wanted).then(|| {
        let [drawn, wanted] = [nodes.nodes.len(), nodes.wanted].map(|count| format::count(count as u64));
        let largest = if standing.is_some() { "largest area" } else { "largest on screen" };
        Part::Text(format!("{drawn} of {wanted}: {largest}"))
    });
    let title = if let Some(standing) = standing {
        if standing.is_split { title } else { title.replace("Containers", "Clusters") }
    } else if let Some(layout) = state.model.layout_name() {
        title.replace("Containers", &format!("Nodes of {layout}"))
    } else {
        title
    };
    let roles = roles.into_iter().flatten().map(|roles| swatches(&roles));
    Some(LegendBox { title, parts: colors.into_iter().chain(roles).chain(cut).collect() })
}

/// Roles of nodes that have one colour, with a name for them.
type NamedRoles = Vec<(&'static [Role], &'static str)>;

fn swatches(named: &NamedRoles) -> Part {
    let swatch =
        |(roles, name): &(&[Role], &str)| (roles.iter().copied().map(Mark::of_role).collect(), (*name).to_owned());
    Part::Swatches(named.iter().map(swatch).collect())
}

/// The selected node of the shown tree.
fn selected_node(state: &AppState, shown: &Presented) -> Option<u32> {
    state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len())
}

/// The selected, hovered or merged nodes. Listed even while no container is hovered, so that the legend's height stays the same.
fn marked_roles(state: &AppState, shown: &Presented, standing: Option<&Standing>) -> NamedRoles {
    if let Some(standing) = standing {
        return match (standing.made, standing.is_split) {
            (None, _) => vec![(&[Role::Hovered], "under the pointer")],
            (_, true) => vec![(&[Role::Selected], "split"), (&[Role::FirstChild, Role::SecondChild], "into these")],
            (_, false) => vec![(&[Role::FirstChild, Role::SecondChild], "merged"), (&[Role::Selected], "into this")],
        };
    }
    let selected = selected_node(state, shown);
    let mut marked: NamedRoles = Vec::new();
    if let Some(node) = selected {
        marked.push((&[Role::Selected], "selected"));
        if !shown.table.is_leaf(node) {
            marked.push((&[Role::FirstChild, Role::SecondChild], "children"));
        }
    }
    marked.push((&[Role::Hovered], if selected.is_some() { "hovered" } else { "under the pointer" }));
    marked
}

/// The overlap of the selected node's children, where it is filled.
fn filled_roles(state: &AppState, shown: &Presented, standing: Option<&Standing>) -> Option<NamedRoles> {
    let has_overlap = |node: u32| !shown.table.overlap_instances(node).is_empty();
    let is_filled = state.wanted.overlay.overlap && standing.is_none();
    let is_filled = is_filled && selected_node(state, shown).is_some_and(has_overlap);
    is_filled.then(|| vec![(&[Role::Overlap][..], "filled: shared by the children")])
}

/// Faulty nodes, and those of a ray's step.
fn ray_roles(state: &AppState, table: &NodeTable) -> Option<NamedRoles> {
    let mut roles: NamedRoles = Vec::new();
    if table.faulty().next().is_some() {
        roles.push((&[Role::Faulty], "sticks out"));
    }
    if state.shows_ray() && state.selection.nodes.has_ray() {
        roles.extend([(&[Role::Traced][..], "ray's step"), (&[Role::Waiting], "on its stack")]);
    }
    (!roles.is_empty()).then_some(roles)
}

/// The nodes whose containers are drawn, in words.
fn drawn_nodes(state: &AppState, standing: Option<&Standing>) -> String {
    let [first, last] = state.drawn_depths();
    if standing.is_some() && state.model.cut.wanted_cut().is_some() {
        "nodes of the cut".to_owned()
    } else if standing.is_some() {
        "active clusters".to_owned()
    } else if first == last {
        format!("depth {first}")
    } else {
        format!("depths {first} to {last}")
    }
}

/// Title and colours where these tell which nodes another tree has too; `is_before` for the clusters of a tree before its passes.
fn survivors_legend(state: &AppState, is_before: bool) -> (String, Vec<Part>) {
    let [title, same, new] = match (state.wanted.second, state.shown_view(), is_before) {
        (Some(_), CompareView::B, _) => ["Containers of B: in both trees?", "also in A", "only in B"],
        (Some(_), CompareView::Split, _) => ["Containers: in both trees?", "in both", "in one only"],
        (Some(_), ..) => ["Containers of A: in both trees?", "also in B", "only in A"],
        (None, _, false) => ["Containers: moved by the passes?", "before them too", "moved by them"],
        (None, _, true) => ["Clusters before the passes", "kept", "moved"],
    };
    let side = usize::from(is_before || state.shown_view() == CompareView::B);
    let interior = state.shown_tree(TreeSide::ALL[side]).map(|shown| &shown.accel.report.stats);
    let kept = state.compared().zip(interior).map(|(survival, stats)| {
        let all = (stats.nodes - stats.leaves).max(1) as f64;
        format!(" ({})", format::percent((survival[side].interior as f64 / all).min(1.0)))
    });
    let same = format!("{same}{}", kept.filter(|_| !is_before).unwrap_or_default());
    // A line each: both are too long for one.
    let line = |(at, name)| Part::Swatches(vec![(vec![Mark::surface(overlay::ramp(at))], name)]);
    (title.to_owned(), [(0.0, same), (1.0, new.to_owned())].map(line).into())
}

/// Legend of the picture; `None` for shadings whose colours have no meaning.
fn picture_legend(state: &AppState) -> Option<LegendBox> {
    let shown = state.model.presented.as_ref()?;
    if !state.preferences.show_geometry {
        return None;
    }
    if state.shown_view() == CompareView::Difference
        && let Some(difference) = &state.model.difference
    {
        return Some(difference_legend(&difference.map));
    }
    let frame = &shown.frame;
    let lines = frame.settings.mesh_edges.then(|| Part::Text("lines: edges of triangles, from 2 px on".to_owned()));
    let (title, part) = match frame.settings.shading {
        Shading::Lit => return lines.map(|lines| LegendBox { title: "Picture: mesh".to_owned(), parts: vec![lines] }),
        Shading::Normals => {
            let axes = [("+x", [255, 128, 128]), ("+y", [128, 255, 128]), ("+z", [128, 128, 255])];
            let swatches = axes.map(|(name, color)| (vec![Mark::surface(color)], name.to_owned()));
            ("Picture: surface normal".to_owned(), Part::Swatches(swatches.to_vec()))
        }
        Shading::AmbientOcclusion => {
            let grey = |position: f32| [(255.0 * (0.05 + 0.9 * position)) as u8; 3];
            let stops = vec![(0.0, "occluded".to_owned()), (1.0, "open".to_owned())];
            ("Picture: ambient occlusion".to_owned(), Part::Ramp { stops, used: None, color: Box::new(grey) })
        }
        Shading::Clusters => (format!("Picture: {}", clusters(frame)), Part::Text("one colour each".to_owned())),
        Shading::Copies => ("Picture: copies".to_owned(), of_copies(shown, "one colour each")),
        Shading::Meshes => ("Picture: meshes".to_owned(), of_copies(shown, "one colour for all copies of a mesh")),
        Shading::Heat(kind) => {
            (format!("Picture: {} per pixel{}", kind.counted(), frame.in_layout()), values_ramp(frame))
        }
        Shading::Depth => ("Picture: depth".to_owned(), values_ramp(frame)),
        Shading::Thickness => ("Picture: thickness".to_owned(), values_ramp(frame)),
        Shading::Distance => (format!("Picture: distance, a line every {}", frame.line_spacing), values_ramp(frame)),
    };
    Some(LegendBox { title, parts: std::iter::once(part).chain(lines).collect() })
}

/// The meaning of the colours of copies, or that there are none.
fn of_copies(shown: &Presented, meaning: &str) -> Part {
    let scene = &shown.accel.scene;
    let text = match (scene.copies.is_some(), scene.repeats_meshes) {
        (true, _) => meaning,
        (false, true) => "none: the scene is flat, see File",
        (false, false) => "none: no mesh has copies",
    };
    Part::Text(text.to_owned())
}

/// The nodes that cluster colours show.
fn clusters(frame: &Frame) -> String {
    match frame.clusters.as_ref().map(|clusters| clusters.cut) {
        None => format!("containers at depth {}", frame.settings.cluster_depth),
        Some(Cut::Area(share)) => format!("nodes of at most {} of the area", format::percent(f64::from(share))),
        Some(Cut::Primitives(most)) => {
            format!("nodes of at most {}", format::counted(u64::from(most), "triangle"))
        }
        Some(Cut::Clusters(_) | Cut::Step { .. }) => "active clusters".to_owned(),
    }
}

/// Legend of the difference of two trees.
fn difference_legend(map: &DifferenceMap) -> LegendBox {
    let kind = match map.frames[0].settings.shading {
        Shading::Heat(kind) => kind,
        _ => HeatKind::Both,
    };
    let limit = format::count(map.limit.round() as u64);
    let stops = vec![(0.0, format!("−{limit}")), (0.5, "0".to_owned()), (1.0, format!("+{limit}"))];
    let ramp = Part::Ramp { stops, used: None, color: Box::new(|position| diverging(position * 2.0 - 1.0)) };
    let [fewer, same, more] = map.pixels;
    let all = (fewer + same + more).max(1) as f64;
    let percent = |count: u64| format::percent(count as f64 / all);
    let ends = [(-1.0, "fewer in B", fewer), (1.0, "more", more)];
    let swatches =
        ends.map(|(end, name, count)| (vec![Mark::surface(diverging(end))], format!("{name}: {}", percent(count))));
    LegendBox {
        title: format!("B − A: {} per pixel", kind.counted()),
        parts: vec![ramp, Part::Swatches(swatches.to_vec())],
    }
}

/// Gradient of the colour map over the frame's range of values.
fn values_ramp(frame: &Frame) -> Part {
    let [low, high] = frame.value_range;
    // Counts are whole numbers, distances are not.
    let whole = !frame.settings.shading.is_length();
    let stops = [0.0, 0.5, 1.0].map(|position: f32| {
        let value = low + (high - low) * position;
        (position, format::significant(f64::from(if whole { value.round() } else { value })))
    });
    let settings = frame.settings;
    Part::Ramp { stops: stops.to_vec(), used: None, color: Box::new(move |position| settings.value_color(position)) }
}

fn paint(ui: &mut Ui, rect: Rect, legend: &LegendBox) {
    let palette = theme::palette(ui);
    let response = ui.interact(rect, ui.scope_id().with(&legend.title), Sense::hover());
    let parts: Vec<String> = legend.parts.iter().map(Part::text).collect();
    let name = format!("Legend. {}: {}", legend.title, parts.join("; "));
    response.widget_info(|| WidgetInfo::labeled(AccessRole::Image, true, &name));
    let painter = ui.painter();
    painter.rect_filled(rect, CornerRadius::same(6), palette.veil);
    let font = FontId::proportional(theme::HEADING_SIZE);
    painter.text(rect.min + vec2(MARGIN, 5.0), Align2::LEFT_TOP, &legend.title, font.clone(), palette.text);
    let mut top = rect.top() + TITLE_HEIGHT;
    for part in &legend.parts {
        let place =
            Rect::from_min_size(pos2(rect.left() + MARGIN, top), vec2(rect.width() - 2.0 * MARGIN, part.height()));
        match part {
            Part::Ramp { stops, used, color } => paint_ramp(painter, place, stops, *used, color, palette.dim),
            Part::Swatches(swatches) => SwatchRow::of(painter, swatches).paint(painter, place, palette.dim),
            Part::Text(text) => {
                painter.text(place.left_center(), Align2::LEFT_CENTER, text, font.clone(), palette.dim);
            }
        }
        top += part.height();
    }
}

/// A row of swatches, laid out from its left end.
struct SwatchRow {
    marks: Vec<(f32, Mark)>,
    names: Vec<(f32, Arc<Galley>)>,
    width: f32,
}

impl SwatchRow {
    fn of(painter: &Painter, swatches: &[(Vec<Mark>, String)]) -> Self {
        let mut row = Self { marks: Vec::new(), names: Vec::new(), width: 0.0 };
        for (marks, name) in swatches {
            let mut left = if row.names.is_empty() { 0.0 } else { row.width + SWATCH_GAP };
            for &mark in marks {
                row.marks.push((left, mark));
                left += mark.size().x + MARK_GAP;
            }
            left += MARK_GAP;
            let name = laid_out(painter, name);
            row.width = left + name.size().x;
            row.names.push((left, name));
        }
        row
    }

    fn paint(self, painter: &Painter, place: Rect, dim: Color32) {
        for (left, mark) in self.marks {
            let (size, [r, g, b]) = (mark.size(), mark.color);
            let swatch = Rect::from_min_size(pos2(place.left() + left, place.center().y - size.y * 0.5), size);
            // The outline shows a white swatch on a light ground.
            let outline = Stroke::new(1.0, dim.gamma_multiply(0.7));
            painter.rect(swatch, CornerRadius::same(2), Color32::from_rgb(r, g, b), outline, StrokeKind::Outside);
        }
        for (left, name) in self.names {
            painter.galley(pos2(place.left() + left, place.center().y - name.size().y * 0.5), name, dim);
        }
    }
}

fn paint_ramp(
    painter: &Painter,
    place: Rect,
    stops: &[(f32, String)],
    used: Option<[f32; 2]>,
    color: &dyn Fn(f32) -> [u8; 3],
    dim: Color32,
) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let bar = Rect::from_min_size(place.min + vec2(0.0, 2.0), vec2(place.width(), 8.0));
    theme::paint_gradient(painter, bar, STEPS, |position| {
        let [r, g, b] = color(position);
        let half_step = 0.5 / f32::from(STEPS);
        let is_used = used.is_none_or(|[from, to]| (from - half_step..=to + half_step).contains(&position));
        let color = Color32::from_rgb(r, g, b);
        if is_used { color } else { color.gamma_multiply(0.3) }
    });
    let mut free_left = place.left() - 8.0;
    for (position, text) in stops {
        let galley = painter.layout_no_wrap(text.clone(), font.clone(), dim);
        let width = galley.size().x;
        let center = bar.left() + bar.width() * position;
        let left = (center - width * 0.5).clamp(bar.left(), (bar.right() - width).max(bar.left()));
        // Skip labels that would overlap the previous one.
        if left >= free_left {
            painter.galley(pos2(left, bar.bottom() + 3.0), galley, dim);
            free_left = left + width + 6.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_samples_of_all_roles_look_different() {
        let marks = Role::ALL.map(Mark::of_role);
        for (index, mark) in marks.iter().enumerate() {
            assert!(!marks[..index].contains(mark), "{:?}", Role::ALL[index]);
        }
    }
}
