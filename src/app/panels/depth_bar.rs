//! Depth bar: a histogram of nodes per depth, on which the range of drawn depths is dragged.

use egui::{
    self, Align, Align2, CornerRadius, CursorIcon, DragValue, FontId, Key, Layout, Rect, Response, Role, Sense, Ui,
    WidgetInfo, accesskit, pos2, vec2,
};

use crate::app::state::AppState;
use crate::app::views::parts::layout_on_show;
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};

/// Largest width of the summary in points: "shown: 12 … 39 · 100,000 of 2,175,431".
const SUMMARY_WIDTH: f32 = 256.0;
/// Height of the bars in points.
const HEIGHT: f32 = 44.0;

/// Shows the bar.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let palette = theme::palette(ui);
    let Some(table) = state.model.table().cloned() else {
        ui.allocate_ui(vec2(ui.available_width(), HEIGHT), |ui| {
            ui.centered_and_justified(|ui| ui.label(egui::RichText::new("No tree yet").color(palette.dim)));
        });
        return;
    };
    let counts: Vec<u32> = table.nodes_per_depth().collect();
    let max_depth = table.max_depth();
    let [from, to] = state.drawn_depths();
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        ui.label(egui::RichText::new("depth").color(palette.dim));
        number(ui, state, max_depth, 0, "From depth");
        ui.label(egui::RichText::new("…").color(palette.dim));
        number(ui, state, max_depth, 1, "To depth");
        automatic(ui, state);
        layout_on_show(ui, state);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let text = summary(state, &counts, [from, to]);
            ui.allocate_ui_with_layout(
                vec2(SUMMARY_WIDTH.min(ui.available_width() * 0.5), HEIGHT),
                Layout::right_to_left(Align::Center),
                |ui| {
                    ui.add(egui::Label::new(text).truncate());
                },
            );
            let size = vec2(ui.available_width(), HEIGHT);
            let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
            bars(ui, state, &counts, rect, &response);
        });
    });
}

/// Number field for one end of the range: 0 first, 1 last.
fn number(ui: &mut Ui, state: &mut AppState, max_depth: u32, end: usize, name: &str) {
    let mut depth = state.drawn_depths();
    let mut value = depth[end];
    let response =
        ui.add_sized(vec2(36.0, theme::ROW_HEIGHT), DragValue::new(&mut value).range(0..=max_depth).speed(0.1));
    let current = f64::from(value);
    response.widget_info(|| {
        let mut info = WidgetInfo::drag_value(ui.is_enabled(), current);
        info.label = Some(name.to_owned());
        info
    });
    if response.changed() {
        depth[end] = value;
        // Keep the range ordered: the other end follows.
        if depth[0] > depth[1] {
            depth[1 - end] = value;
        }
        state.wanted.overlay.depth = Some(depth);
    }
    response.tip("First and last depth whose containers are drawn; the root is 0 (keys , and .)");
}

/// Switch for the range that suits the tree.
fn automatic(ui: &mut Ui, state: &mut AppState) {
    let on = state.wanted.overlay.depth.is_none();
    let tip = if on {
        "The range follows the tree: the levels that together hold 100 to 200 containers; of leaves alone, the largest in view. Click to keep this one (Ctrl+.)"
    } else {
        "The range is as you set it. Click for the levels that together hold 100 to 200 containers of any tree; of leaves alone, the largest in view (Ctrl+.)"
    };
    let response = ui.add(egui::Button::new("Auto").selected(on));
    response.widget_info(|| WidgetInfo::selected(Role::Button, ui.is_enabled(), on, "Automatic depth range"));
    if response.tip(tip).clicked() {
        state.wanted.overlay.depth = on.then(|| state.drawn_depths());
    }
}

/// Depth range and number of drawn containers: "shown: 4 … 7 · 240 containers".
fn summary(state: &AppState, counts: &[u32], [from, to]: [u32; 2]) -> String {
    let range = if from == to { from.to_string() } else { format!("{from} … {to}") };
    let overlay = &state.wanted.overlay;
    if state.drawn_kinds().is_empty() {
        return format!("depth {range} · containers off");
    }
    if let Some(standing) = &state.layout.graphics.standing {
        let [drawn, wanted] = [standing.nodes.len(), standing.all].map(|count| format::count(count as u64));
        let of = if drawn == wanted { wanted } else { format!("{drawn} of {wanted}") };
        let noun = if standing.is_split { "nodes" } else { "clusters" };
        return format!("shown: {of} {noun} of Merges");
    }
    let in_range: u64 = counts.iter().take(to as usize + 1).skip(from as usize).map(|&count| u64::from(count)).sum();
    let (drawn, wanted) = state.layout.graphics.overlay_counts();
    if drawn < wanted {
        return format!("shown: {range} · {} of {}", format::count(drawn as u64), format::count(wanted as u64));
    }
    let is_part = overlay.leaves_only || state.selection.nodes.hides_any() || state.draws_only_common();
    let text = if is_part || overlay.parents { format::count(drawn as u64) } else { format::count(in_range) };
    let noun = if text == "1" { "container" } else { "containers" };
    format!("shown: {range} · {text} {noun}")
}

/// The histogram with the chosen range, which drags, clicks and arrow keys change.
fn bars(ui: &mut Ui, state: &mut AppState, counts: &[u32], rect: Rect, response: &Response) {
    let palette = theme::palette(ui);
    let max_depth = counts.len().saturating_sub(1) as u32;
    let before = state.drawn_depths();
    let plot = Rect::from_min_max(rect.min + vec2(16.0, 4.0), rect.max - vec2(20.0, 4.0));
    let step = plot.width() / counts.len().max(1) as f32;
    let depth_at = |x: f32| (((x - plot.left()) / step).floor().max(0.0) as u32).min(max_depth);
    drag(ui, state, response, before, depth_at);
    keys(ui, state, response, max_depth);

    let [from, to] = state.drawn_depths();
    let text = format!("Depth range {from} to {to} of {max_depth}");
    response.widget_info(|| WidgetInfo::labeled(Role::Group, ui.is_enabled(), "Depth range"));
    ui.ctx().accesskit_node_builder(response.id, |node| {
        node.set_role(accesskit::Role::Group);
        node.set_description(text.clone());
    });
    let painter = ui.painter();
    let chosen = Rect::from_min_max(
        pos2(plot.left() + from as f32 * step, rect.top()),
        pos2(plot.left() + (to + 1) as f32 * step, rect.bottom()),
    );
    let hot = response.hovered() || response.dragged() || response.has_focus();
    let fill = palette.accent.gamma_multiply(if hot { 0.26 } else { 0.18 });
    painter.rect_filled(chosen, CornerRadius::same(4), fill);
    let most = counts.iter().copied().max().unwrap_or(1);
    let gap = if step > 6.0 { 2.0 } else { 0.5 };
    for (depth, &count) in counts.iter().enumerate() {
        // Logarithmic, since counts span several orders of magnitude.
        let height = (1.0 + count as f32).ln() / (1.0 + most as f32).ln();
        let left = plot.left() + depth as f32 * step;
        let bar = Rect::from_min_max(
            pos2(left + gap * 0.5, plot.bottom() - (height * plot.height()).max(1.0)),
            pos2(left + step - gap * 0.5, plot.bottom()),
        );
        let inside = (from..=to).contains(&(depth as u32));
        let color = if inside { palette.accent } else { palette.rail };
        painter.rect_filled(bar, CornerRadius::same(1), color);
    }
    let font = FontId::proportional(theme::HEADING_SIZE);
    painter.text(pos2(rect.left() + 4.0, plot.bottom()), Align2::LEFT_BOTTOM, "0", font.clone(), palette.dim);
    painter.text(pos2(rect.right(), plot.bottom()), Align2::RIGHT_BOTTOM, max_depth.to_string(), font, palette.dim);
    let hovered = response.hover_pos().map(|pointer| depth_at(pointer.x));
    let tip = match hovered {
        Some(depth) => format!(
            "Depth {depth}: {} nodes\nDrag to choose a range, drag its ends to change it, Shift+drag moves it; double click shows all",
            format::count(u64::from(counts.get(depth as usize).copied().unwrap_or(0)))
        ),
        None => String::new(),
    };
    response.clone().on_hover_cursor(CursorIcon::ResizeHorizontal).on_hover_text_at_pointer(tip);
}

/// Effect of a drag, decided where it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grip {
    /// Selects a new range from this depth.
    New(u32),
    /// Moves a range: the depth where the drag started, and the range at that time.
    Move(u32, [u32; 2]),
}

/// Pointer control: drags choose or move the range, a double click chooses all depths.
fn drag(ui: &Ui, state: &mut AppState, response: &Response, [from, to]: [u32; 2], depth_at: impl Fn(f32) -> u32) {
    let id = response.id.with("grip");
    if response.double_clicked() {
        state.wanted.overlay.depth = Some([0, depth_at(f32::INFINITY)]);
        return;
    }
    let Some(pointer) = response.interact_pointer_pos() else { return };
    let here = depth_at(pointer.x);
    if response.drag_started() || response.clicked() {
        let origin = ui.input(|input| input.pointer.press_origin()).map_or(here, |origin| depth_at(origin.x));
        let grip = if ui.input(|input| input.modifiers.shift) {
            Grip::Move(origin, [from, to])
        } else if origin == from && from != to && !response.clicked() {
            Grip::New(to)
        } else if origin == to && from != to && !response.clicked() {
            Grip::New(from)
        } else {
            Grip::New(origin)
        };
        ui.data_mut(|data| data.insert_temp(id, GripState(grip)));
    }
    if !(response.dragged() || response.clicked()) {
        return;
    }
    let Some(GripState(grip)) = ui.data(|data| data.get_temp(id)) else { return };
    state.wanted.overlay.depth = Some(match grip {
        Grip::New(start) => [start.min(here), start.max(here)],
        Grip::Move(start, [first, last]) => {
            let length = last - first;
            let max_depth = depth_at(f32::INFINITY);
            let first = (i64::from(first) + i64::from(here) - i64::from(start)).clamp(0, i64::from(max_depth - length));
            [first as u32, first as u32 + length]
        }
    });
}

#[derive(Debug, Clone, Copy)]
struct GripState(Grip);

/// Keyboard control while focused: arrow keys move the range, with Shift its last depth.
fn keys(ui: &Ui, state: &mut AppState, response: &Response, max_depth: u32) {
    if !response.has_focus() {
        return;
    }
    let filter = egui::EventFilter { horizontal_arrows: true, ..egui::EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let (step, grow) = ui.input(|input| {
        let step = i32::from(input.key_pressed(Key::ArrowRight)) - i32::from(input.key_pressed(Key::ArrowLeft));
        (step, input.modifiers.shift)
    });
    let [from, to] = state.drawn_depths();
    if step == 0 {
        return;
    }
    let end = to.saturating_add_signed(step).min(max_depth);
    if grow {
        state.wanted.overlay.depth = Some([from, end.max(from)]);
    } else if end != to && !(step < 0 && from == 0) {
        state.wanted.overlay.depth = Some([from.saturating_add_signed(step), end]);
    }
}
