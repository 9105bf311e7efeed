//! Controls that views of nodes share: small drop-down lists, and the button that measures visits from the present view.

use egui::{self, ComboBox, Ui};

use crate::app::state::{AppState, Presented};
use crate::app::widgets::{Tip as _, plain_drop_down};
use crate::lab::population::Population;

/// A drop-down list beside its label. `choices` have a value, a name and what it means.
pub(super) fn drop_down<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
) {
    ui.weak(label);
    plain_drop_down(ui, ComboBox::from_id_salt(label), label, value, choices).tip(tip);
}

/// The button that measures visits by the rays of the present view.
fn measure_here(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let scene = &shown.accel.scene;
    let present = state.view_rays();
    let can = state.lab.rays(scene).is_some_and(|rays| rays != present.of(state.lab.population));
    let response = ui.add_enabled(can, egui::Button::new("Measure this view"));
    let tip = "Count the visits again, by the rays of the view that you see now. Until then they stay those of an earlier view";
    let response = response.tip(tip).disabled_tip("Visits are those of the view that you see");
    if response.clicked() {
        state.lab.measure_by(scene, present);
    }
}

/// The list of the kinds of rays that visits are measured by, and the button that measures those of the present view.
pub(super) fn rays(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let choices = Population::ALL.map(|population| (population, population.label(), population.meaning()));
    drop_down(ui, "Rays", "The rays by which visits are measured", &mut state.lab.population, &choices);
    measure_here(ui, state, shown);
}

/// Why no visits were measured, where the view has none of the chosen rays.
pub(super) fn no_rays(state: &AppState, shown: &Presented) -> Option<&'static str> {
    let rays = state.lab.rays(&shown.accel.scene)?;
    let visits = state.lab.visits.get(&shown.accel, &rays)?;
    (visits.rays == 0).then(|| rays.population().absence(rays.light()))
}

/// What is said while a view has nothing to show: that its job is running, waits, or was stopped, with a button to begin again.
/// Returns whether to begin again.
pub(super) fn waiting(ui: &mut Ui, is_cancelled: bool, text: &str) -> bool {
    let mut again = false;
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.3);
        ui.weak(if is_cancelled { "Stopped" } else { text });
        again = is_cancelled && ui.button("Begin again").clicked();
    });
    again
}
