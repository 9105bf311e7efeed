//! Which ray: picked in the picture or typed, what it is traced for, and how.

use egui::{self, Button, DragValue, Key, Response, RichText, Role, TextEdit, Ui, WidgetInfo};

use crate::app::state::{AppState, Presented};
use crate::app::widgets::{Tip as _, chip};
use crate::app::{format, theme};
use crate::lab::ray::RayMethod;
use crate::render::RayKind;
use bvhscope_engine::tree::traverse::Traversal;

/// Width of a field for a typed vector in points: in a window that is wide, room for seven digits of each number.
const FIELD_WIDTHS: [f32; 2] = [124.0, 196.0];
/// Room for the label of a field in points.
const LABEL_ROOM: f32 = 72.0;
/// Width of the view from which its fields are wide.
const WIDE: f32 = 1180.0;

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    ui.horizontal_wrapped(|ui| {
        let picks = &mut state.model.ray.picks;
        let tip = "A click on the picture takes the ray of that pixel; while this is off it selects as usual";
        ui.checkbox(picks, "Pick in the picture").tip(tip);
        ui.separator();
        kinds(ui, state);
        ui.separator();
        methods(ui, state);
        ui.separator();
        typed(ui, state, shown);
        of_file(ui, state);
    });
}

/// Which ray of the file, where one is open.
fn of_file(ui: &mut Ui, state: &mut AppState) {
    let file = &state.model.derived.ray_file;
    let Some(read) = file.rays() else { return };
    let rays = &read.set.rays;
    let (last, mut place) = (rays.len() - 1, file.chosen);
    let (index, pixel) = rays.get(place).map_or((0, None), |ray| (ray.index, ray.pixel));
    ui.end_row();
    ui.label(RichText::new("Ray of the file").color(theme::palette(ui).dim));
    let step = |ui: &mut Ui, text: &str, name: &str, is_there: bool| {
        let response = ui.add_enabled(is_there, Button::new(text));
        response.widget_info(|| WidgetInfo::labeled(Role::Button, is_there, name));
        response.tip(name).clicked()
    };
    let before = step(ui, "Before", "Ray before", place > 0);
    let at = pixel.map_or_else(String::new, |[x, y]| format!(", pixel {x},{y}"));
    let all = format::count(rays.len() as u64);
    let tip = format!("Its place among the {all} that were read: ray {index} of the file{at}");
    let typed = ui.add(DragValue::new(&mut place).range(0..=last).speed(0.2)).tip(tip).changed();
    let next = step(ui, "Next", "Next ray", place < last);
    let again = ui.button("Replay").tip("Record this ray step by step").clicked();
    if before || typed || next || again {
        state.take_ray_of_file((place + usize::from(next)).saturating_sub(usize::from(before)));
    }
}

fn kinds(ui: &mut Ui, state: &mut AppState) {
    ui.spacing_mut().item_spacing.x = 4.0;
    for kind in RayKind::ALL {
        let tip = match kind {
            RayKind::Primary => "The ray through the pixel, or the typed one",
            RayKind::Shadow => "From the surface that it hits to the sun, as in the lit picture",
            RayKind::AmbientOcclusion => {
                "From that surface into its surroundings: the first of the ambient occlusion picture"
            }
            RayKind::Bounce => "From that surface to where its light comes from: the first that the lit picture traces",
        };
        if chip(ui, kind.label(), state.model.ray.kind == kind, tip) {
            state.model.ray.kind = kind;
            state.model.ray.restart();
        }
    }
}

fn methods(ui: &mut Ui, state: &mut AppState) {
    for method in RayMethod::ALL {
        let tip = match method {
            RayMethod::Binary(Traversal::Ordered) => {
                "The binary tree: near child first, skipping what begins behind the nearest hit"
            }
            RayMethod::Binary(Traversal::Paper) => {
                "The binary tree as in the paper's figure 2: neither ordered nor culled"
            }
            RayMethod::Wide => {
                "The tree that pictures are traced through: up to eight children and four triangles at once"
            }
        };
        let response = ui.add(Button::new(method.label()).selected(state.model.ray.method == method));
        // "Paper" is also the name of a tab.
        let name = format!("Trace: {}", method.label());
        let on = state.model.ray.method == method;
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, &name));
        if response.tip(tip).clicked() {
            state.model.ray.method = method;
            state.model.ray.restart();
        }
    }
}

/// Origin and direction as text, taken by Enter or the button.
fn typed(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let palette = theme::palette(ui);
    let width = FIELD_WIDTHS[usize::from(ui.max_rect().width() >= WIDE)];
    let mut entered = false;
    for (index, name) in ["Origin", "Direction"].into_iter().enumerate() {
        // The label stays beside its field where the controls take several rows.
        if ui.available_size_before_wrap().x < width + LABEL_ROOM {
            ui.end_row();
        }
        ui.label(RichText::new(name).color(palette.dim));
        let field = TextEdit::singleline(&mut state.model.ray.typed[index]).desired_width(width).hint_text("x, y, z");
        let response = ui.add(field);
        let text = state.model.ray.typed[index].clone();
        response.widget_info(|| {
            let mut info = WidgetInfo::text_edit(true, &text, &text, "x, y, z");
            info.label = Some(format!("Ray {}", name.to_lowercase()));
            info
        });
        entered |= response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        tip_of(response, index);
    }
    let tip = "Trace the ray from this origin in this direction (Enter)";
    if ui.button("Trace").tip(tip).clicked() || entered {
        let offset = shown.accel.scene.offset;
        state.model.ray.take_typed(shown.frame.camera, state.layout.viewport_px, offset);
    }
}

fn tip_of(response: Response, index: usize) {
    let tip = if index == 0 {
        "Where the ray starts, in the model's coordinates, as in 0, 1.5, -2"
    } else {
        "Where it goes, of any length but zero; distances are in the model's unit"
    };
    response.tip(tip);
}
