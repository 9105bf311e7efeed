//! Changes of statistics: for three seconds after a change, a statistic shows its value before.

use std::collections::HashMap;

use egui::{Id, Ui};

/// Duration in seconds for which a change is shown.
const SHOWN_SECS: f64 = 3.0;

/// Present and previous value of each statistic. Stored in egui's memory, because only the presentation depends on it.
#[derive(Debug, Clone, Default)]
pub(crate) struct RecentChanges {
    /// Model that the values belong to; they are discarded when another one is shown.
    model: String,
    values: HashMap<&'static str, Value>,
}

#[derive(Debug, Clone, Copy)]
struct Value {
    now: f64,
    /// Value before a series of changes, and the time of the last of them in seconds.
    change: Option<(f64, f64)>,
}

impl RecentChanges {
    /// Loads the values of `model` from egui's memory.
    pub(crate) fn load(ui: &Ui, model: &str) -> Self {
        let changes: Self = ui.data(|data| data.get_temp(Id::unique("recent changes"))).unwrap_or_default();
        if changes.model == model { changes } else { Self { model: model.to_owned(), values: HashMap::new() } }
    }

    /// Stores the values in egui's memory.
    pub(crate) fn store(self, ui: &Ui) {
        ui.data_mut(|data| data.insert_temp(Id::unique("recent changes"), self));
    }

    /// Records the present value of a statistic and returns its previous one while the change is shown. A series of
    /// changes, as during the drag of a slider, is compared with the value before the first of them.
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
