//! Changes of statistics: for three seconds after a new tree, a row shows the value of the tree before.

use std::collections::HashMap;

use egui::{Id, Ui};

use crate::app::state::Presented;
use crate::app::state::comparison::{Comparison, Verdict};
use crate::catalog::numbers::Number;

/// Duration in seconds for which a change is shown.
const SHOWN_SECS: f64 = 3.0;

/// A comparison of two values, and the time at which it was first shown, in seconds.
#[derive(Debug, Clone, Copy)]
struct Seen {
    values: (f64, f64),
    since: f64,
}

/// Stored in egui's memory, because only the presentation depends on it.
type SeenChanges = HashMap<&'static str, Seen>;

/// The value of the tree before and the verdict, while a recent change is shown; `None` where the two trees' values do not
/// compare.
pub(super) fn recent_change(ui: &Ui, shown: &Presented, number: &Number) -> Option<(f64, f64, Verdict)> {
    let id = Id::unique("recent changes");
    let Comparison::Change { before, now, verdict } = shown.compare(number) else {
        ui.data_mut(|data| data.get_temp_mut_or_default::<SeenChanges>(id).remove(number.key));
        return None;
    };
    let time = ui.input(|input| input.time);
    let since = ui.data_mut(|data| {
        let seen = data.get_temp_mut_or_default::<SeenChanges>(id).entry(number.key);
        let seen = seen.or_insert(Seen { values: (before, now), since: time });
        if seen.values != (before, now) {
            *seen = Seen { values: (before, now), since: time };
        }
        seen.since
    });
    let left = SHOWN_SECS - (time - since);
    if left <= 0.0 || matches!(verdict, Verdict::Same | Verdict::Noise) {
        return None;
    }
    ui.ctx().request_repaint_after_secs(left as f32 + 0.05);
    Some((before, now, verdict))
}
