//! The control of a setting, made from its row.

use egui::Ui;

use crate::app::widgets::{DropDown, SliderSpec, check, row, slider};
use crate::catalog::settings::{Choice, Limits, Setting, Settings, Value};

/// Shows the control of a setting; nothing where it has no effect or no control. Lists of several values have rows of their own.
pub(crate) fn control<T: Settings>(ui: &mut Ui, setting: &Setting<T>, settings: &mut T) {
    if setting.label.is_empty() || !(setting.applies)(settings) {
        return;
    }
    match &setting.value {
        Value::Switch { .. } => {
            row(ui, setting.label, setting.tip, |ui| ui.horizontal(|ui| switch(ui, setting, settings)).response);
        }
        Value::Number(number) => {
            let mut value = (number.get)(settings);
            if number_slider(ui, setting, &number.limits, &mut value, (number.get)(&T::default())) {
                (number.set)(settings, value);
            }
        }
        Value::One { .. } => choose(ui, setting, settings, |_| true),
        Value::Optional { .. } | Value::Range { .. } | Value::Any { .. } => {}
    }
}

/// The check box of a switch, beside others of its row.
pub(crate) fn switch<T: Settings>(ui: &mut Ui, setting: &Setting<T>, settings: &mut T) {
    let Value::Switch { name, get, set } = &setting.value else { return };
    let mut on = get(settings);
    if check(ui, &mut on, name, setting.tip) {
        set(settings, on);
    }
}

/// The check box of one of several values.
pub(crate) fn member<T: Settings>(ui: &mut Ui, setting: &Setting<T>, settings: &mut T, index: usize) {
    let Value::Any { options, get, set, .. } = &setting.value else { return };
    let mut on = get(settings, index);
    if let Some(option) = options().get(index)
        && check(ui, &mut on, option.label, &option.tip)
    {
        set(settings, index, on);
    }
}

/// The slider of a number that may be absent and then is `automatic`, as it is again once it is moved there.
pub(crate) fn optional<T: Settings>(ui: &mut Ui, setting: &Setting<T>, settings: &mut T, automatic: f32) {
    let Value::Optional { limits, get, set, .. } = &setting.value else { return };
    let mut value = get(settings).unwrap_or(automatic);
    if number_slider(ui, setting, limits, &mut value, automatic) {
        set(settings, Some(value).filter(|value| *value != automatic));
    }
}

/// The drop-down list of the offered values and the present one.
pub(crate) fn choose<T: Settings>(
    ui: &mut Ui,
    setting: &Setting<T>,
    settings: &mut T,
    is_offered: impl Fn(&Choice) -> bool,
) {
    let Value::One { options, get, set } = &setting.value else { return };
    let Some(mut index) = get(settings) else { return };
    let options = options();
    let offered = options.iter().enumerate().filter(|(at, option)| *at == index || is_offered(option));
    let choices: Vec<_> = offered.map(|(at, option)| (at, option.label, option.tip.as_str())).collect();
    if DropDown::new(setting.label, &choices).explained().row(ui, setting.tip, &mut index) {
        set(settings, index);
    }
}

/// The slider of a number. Returns whether it was changed.
pub(crate) fn number_slider<T>(
    ui: &mut Ui,
    setting: &Setting<T>,
    limits: &Limits,
    value: &mut f32,
    default: f32,
) -> bool {
    let [low, high] = limits.slider.map(f64::from);
    let spec = SliderSpec {
        logarithmic: limits.logarithmic,
        decimals: limits.decimals,
        ..SliderSpec::new(setting.label, setting.tip, low..=high, default.into())
    };
    slider(ui, value, &spec)
}
