//! Controls of the paper panel: the experiment and its settings, in two rows.

use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;
use egui::{self, Button, DragValue, RichText, Role, Ui, WidgetInfo, vec2};

use crate::app::state::paper::{Display, Experiment, PaperPlan, RowFormat};
use crate::app::state::{AppState, Request};
use crate::app::theme;
use crate::app::widgets::{DropDown, Tip as _, chip};

/// Width of the dock in points from which the buttons name the paper's tables and figures, and stand apart.
const NUMBERS_FROM: f32 = 1140.0;

/// Shows the controls.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    ui.scope(|ui| {
        if ui.available_width() < NUMBERS_FROM {
            // Each of the two rows stays one in a window of 1024 points.
            ui.spacing_mut().item_spacing.x = 4.0;
        }
        ui.horizontal_wrapped(|ui| {
            experiments(ui, state);
            ui.add_space(8.0);
            run(ui, state);
            ui.add_space(8.0);
            output(ui, state);
        });
        ui.horizontal_wrapped(|ui| settings(ui, state));
    });
}

/// Buttons that choose the experiment.
fn experiments(ui: &mut Ui, state: &mut AppState) {
    let has_room = ui.available_width() >= NUMBERS_FROM;
    for experiment in Experiment::ALL {
        let on = state.preferences.paper.experiment == experiment;
        let number = RichText::new(experiment.in_paper()).small().color(theme::palette(ui).dim);
        let (button, tip) = match experiment.in_paper() {
            "" => (Button::new(experiment.label()), experiment.description().to_owned()),
            in_paper => {
                let button = Button::new(experiment.label());
                let button = if has_room { Button::new((experiment.label(), number)) } else { button };
                (button, format!("{} (the paper's {in_paper})", experiment.description()))
            }
        };
        let response = ui.add(button.selected(on)).tip(tip);
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, experiment.label()));
        if response.clicked() {
            state.preferences.paper.choose(experiment);
        }
    }
}

/// The button that starts or cancels the measurement.
fn run(ui: &mut Ui, state: &mut AppState) {
    if state.activity.measure.is_some() {
        if ui.button("Cancel measuring").tip("Stop and keep the finished rows (Esc)").clicked() {
            state.activity.requests.push(Request::CancelMeasuring);
        }
        return;
    }
    let label = RichText::new("Measure").color(ui.visuals().selection.stroke.color);
    let button = Button::new(label).fill(ui.visuals().selection.bg_fill);
    let tip = "Measure the open model as set below, in the background";
    if ui.add_enabled(state.model.loaded.is_some(), button).tip(tip).clicked() {
        state.activity.requests.push(Request::Measure);
    }
}

/// Buttons for tables or plots, and for saving what was measured.
fn output(ui: &mut Ui, state: &mut AppState) {
    let display = &mut state.preferences.paper.display;
    for (value, label, tip) in
        [(Display::Tables, "Tables", "Show the numbers"), (Display::Plots, "Plots", "Show the curves")]
    {
        if chip(ui, label, *display == value, tip) {
            *display = value;
        }
    }
    ui.add_space(8.0);
    for format in RowFormat::ALL {
        let button = ui.add_enabled(state.can_save_rows(format), Button::new(format.label()));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), format!("Save {}", format.label())));
        let what = match format {
            RowFormat::Csv => "rows as a table for spreadsheets",
            RowFormat::Json => "rows as JSON lines, as on the command line",
            RowFormat::Png => "plot as a picture",
            RowFormat::Svg => "plot as vectors",
        };
        if button.tip(format!("Save the {what} in the current folder")).clicked() {
            state.activity.requests.push(Request::SaveRows(format));
        }
    }
}

/// Settings of the experiment.
fn settings(ui: &mut Ui, state: &mut AppState) {
    let plan = &mut state.preferences.paper;
    for kind in ContainerKind::ALL {
        let mut on = plan.containers.contains(&kind);
        let response = ui.checkbox(&mut on, kind.label()).tip("Container of the measured trees");
        response.widget_info(|| {
            WidgetInfo::selected(Role::CheckBox, true, on, format!("Measure {}", kind.label().to_lowercase()))
        });
        if response.changed() {
            plan.containers = ContainerKind::ALL
                .into_iter()
                .filter(|other| if *other == kind { on } else { plan.containers.contains(other) })
                .collect();
            // At least one stays chosen.
            if plan.containers.is_empty() {
                plan.containers = ContainerKind::ALL.into_iter().filter(|other| *other != kind).collect();
            }
        }
    }
    match plan.experiment {
        Experiment::Thresholds => thresholds(ui, plan),
        Experiment::Tables => {
            let tip = "Also test every triangle with a sample of the rays; the table names their number";
            ui.checkbox(&mut plan.no_bvh, "No BVH").tip(tip);
        }
        Experiment::Threads | Experiment::Builders => {}
    }
    choice(
        ui,
        "Rays",
        "Ordered: near child first, culled by distance. Paper: neither, as in its figure 2",
        &mut plan.traversal,
        &Traversal::ALL.map(|traversal| (traversal, traversal.name().to_owned())),
    );
    choice(
        ui,
        "Camera",
        "The model's default camera, as on the command line, or this window's. The paper does not name its own; in rooms it makes a \
         difference of twofold and more in tests per ray: docs/paper.md has a table of both",
        &mut plan.default_camera,
        &[(true, "default".to_owned()), (false, "this view".to_owned())],
    );
    let sides = PaperPlan::SIDES_PX.map(|side| (side, format!("{side}×{side}")));
    choice(ui, "Picture", "Traced pixels, a primary ray through the centre of each", &mut plan.side_px, &sides);
    let tip = "Repetitions of each measurement: medians are shown";
    number(ui, "Repeat", tip, &mut plan.repeat, 1..=PaperPlan::MAX_REPEAT);
}

/// Range of thresholds for the sweep, and the values of the other parameter that have a curve each.
fn thresholds(ui: &mut Ui, plan: &mut PaperPlan) {
    const LIMITS: [u32; 2] = [BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD];
    let [first, last] = &mut plan.thresholds;
    number(ui, "Thresholds", "The smallest threshold that is measured", first, LIMITS[0]..=*last);
    number(ui, "to", "The largest threshold that is measured", last, *first..=LIMITS[1]);
    let symbol = PaperPlan::CURVES.symbol().unwrap_or_default();
    ui.label(RichText::new(symbol).color(theme::palette(ui).dim));
    let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.x, 4.0);
    for value in PaperPlan::CURVE_VALUES {
        let on = plan.has_curve(value);
        let response = ui.add(Button::new(value.to_string()).selected(on));
        response.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, on, format!("Measure {symbol} {value}")));
        let tip = format!("Curves for this {symbol}. {}", PaperPlan::CURVES.tip);
        if response.tip(tip).clicked() {
            plan.toggle_curve(value);
        }
    }
    ui.spacing_mut().item_spacing.x = spacing;
}

/// A labelled drop-down list.
fn choice<T: Copy + PartialEq>(ui: &mut Ui, name: &str, tip: &str, value: &mut T, choices: &[(T, String)]) {
    let choices: Vec<(T, &str, &str)> = choices.iter().map(|(choice, text)| (*choice, text.as_str(), "")).collect();
    DropDown::new(&format!("Measured {}", name.to_lowercase()), &choices).width(60.0).beside(ui, name, tip, value);
}

/// A labelled number field.
fn number<T: egui::emath::Numeric>(
    ui: &mut Ui,
    name: &str,
    tip: &str,
    value: &mut T,
    range: std::ops::RangeInclusive<T>,
) {
    ui.label(RichText::new(name).color(theme::palette(ui).dim)).tip(tip);
    let current = value.to_f64();
    let response = ui.add_sized(vec2(36.0, theme::ROW_HEIGHT), DragValue::new(value).range(range).speed(0.1));
    response.widget_info(|| {
        let mut info = WidgetInfo::drag_value(ui.is_enabled(), current);
        info.label = Some(format!("Measured {}", name.to_lowercase()));
        info
    });
    response.tip(tip);
}
