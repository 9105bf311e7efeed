//! Rows of the section "Containers": the curve that the primitives are sorted along.

use egui::{self, Label, RichText, Ui};

use crate::app::state::AppState;
use crate::app::state::lab::CurveState;
use crate::app::widgets::{SliderSpec, check, row, slider};
use crate::app::{format, theme};

/// Shows the rows.
pub(super) fn show(ui: &mut Ui, state: &mut AppState) {
    let tip = "Draw the curve along which AAC sorts the triangles: a line through their centres, from blue to orange";
    row(ui, "Sorting", tip, |ui| {
        ui.horizontal(|ui| check(ui, &mut state.lab.curve.shown, "Curve through centres", tip)).response
    });
    if !state.lab.curve.shown {
        return;
    }
    let mut level = f64::from(state.lab.curve.level);
    let spec = SliderSpec {
        label: "Split level",
        tip: "The cells at which the recursion has split the triangles after so many levels; 0 is the whole model",
        range: 0.0..=f64::from(CurveState::MAX_LEVEL),
        default: f64::from(CurveState::default().level),
        logarithmic: false,
        decimals: 0,
        zero: "all",
    };
    if slider(ui, &mut level, &spec) {
        state.lab.curve.level = level as u32;
    }
    let palette = theme::palette(ui);
    let known = state.model.presented.as_ref().and_then(|shown| state.lab.curve.scaffold.of_tree(&shown.accel));
    let (text, color) = match known.map(|known| (**known).as_ref()) {
        None => ("Sorting along the curve".to_owned(), palette.dim),
        Some(Err(reason)) => (reason.clone(), palette.warning),
        Some(Ok(scaffold)) => {
            let cells = format::counted(scaffold.cells.len() as u64, "cell");
            let count = format::count(scaffold.primitives as u64);
            let points = if scaffold.step == 1 {
                format!("all {count} centres")
            } else {
                format!("one of {} of {count} centres", scaffold.step)
            };
            (format!("{cells}; the line goes through {points}"), palette.dim)
        }
    };
    ui.add(Label::new(RichText::new(text).color(color)).wrap());
}
