//! A labelled drop-down list.

use egui::{self, Role, Ui, WidgetInfo};

use super::row::row;
use super::tip::Tip as _;

/// A drop-down list of values, each with its name and tooltip. Values for which `refusal` returns a reason cannot be chosen.
/// Returns whether the value changed.
pub(crate) fn combo<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
) -> bool {
    let before = *value;
    row(ui, label, tip, |ui| {
        let selected = choices.iter().find(|(choice, ..)| choice == value).map_or("", |(_, name, _)| name);
        let response = egui::ComboBox::from_id_salt(label)
            .width(ui.available_width())
            .selected_text(selected)
            .truncate()
            .show_ui(ui, |ui| {
                for &(choice, name, meaning) in choices {
                    let refused = refusal(choice);
                    let button = egui::Button::selectable(*value == choice, name);
                    let response = ui.add_enabled(refused.is_none() || *value == choice, button).tip(meaning);
                    let response = match refused {
                        Some(reason) => response.disabled_tip(reason),
                        None => response,
                    };
                    if response.clicked() {
                        *value = choice;
                    }
                }
            })
            .response;
        response.widget_info(|| {
            let mut info = WidgetInfo::labeled(Role::ComboBox, ui.is_enabled(), label);
            info.current_text_value = Some(selected.to_owned());
            info
        });
        response
    });
    *value != before
}
