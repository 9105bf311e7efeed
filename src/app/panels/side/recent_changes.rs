//! What a change did: for three seconds a statistic shows where it came from.

use std::collections::HashMap;

use eframe::egui::{Id, Ui};

/// How long a change is shown in seconds.
const SHOWN_SECS: f64 = 3.0;

/// What is known of each statistic. Lives in egui's memory: it is looks, not state.
#[derive(Debug, Clone, Default)]
pub(crate) struct RecentChanges {
    /// The model that the values belong to; another one starts afresh.
    model: String,
    values: HashMap<&'static str, Value>,
}

#[derive(Debug, Clone, Copy)]
struct Value {
    now: f64,
    /// The value before a run of changes, and when the last of them came.
    change: Option<(f64, f64)>,
}

impl RecentChanges {
    /// Takes the effects of `model` out of egui's memory.
    pub(crate) fn load(ui: &Ui, model: &str) -> Self {
        let effects: Self = ui.data(|data| data.get_temp(Id::unique("effects"))).unwrap_or_default();
        if effects.model == model { effects } else { Self { model: model.to_owned(), values: HashMap::new() } }
    }

    /// Puts them back.
    pub(crate) fn store(self, ui: &Ui) {
        ui.data_mut(|data| data.insert_temp(Id::unique("effects"), self));
    }

    /// Notes the present value of a statistic and returns the one before, while its change is worth showing. A run of
    /// changes, as while a slider drags, is measured from where it began.
    pub(crate) fn observe(&mut self, ui: &Ui, name: &'static str, now: f64) -> Option<f64> {
        let time = ui.input(|input| input.time);
        let value = self.values.entry(name).or_insert(Value { now, change: None });
        if let Some((_, since)) = value.change
            && time - since > SHOWN_SECS
        {
            value.change = None;
        }
        if value.now != now {
            let from = value.change.map_or(value.now, |(from, _)| from);
            value.change = Some((from, time));
            value.now = now;
        }
        let (from, since) = value.change?;
        ui.ctx().request_repaint_after_secs((SHOWN_SECS - (time - since)).max(0.0) as f32 + 0.05);
        (from != now).then_some(from)
    }
}
