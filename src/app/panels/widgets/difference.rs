//! The difference between a number of the presented tree and that of the tree before, told by sign, word and colour.

use egui::Color32;

use crate::app::format;
use crate::app::state::comparison::{Comparison, Verdict};
use crate::app::theme::Palette;

/// Colour of a difference.
pub(crate) const fn verdict_color(verdict: Verdict, palette: &Palette) -> Color32 {
    match verdict {
        Verdict::Better => palette.better,
        Verdict::Worse => palette.worse,
        Verdict::Same | Verdict::Different => palette.dim,
    }
}

/// Sign, percentage and word: "−12 % better"; "same" without a difference.
pub(crate) fn verdict_text(before: f64, now: f64, verdict: Verdict) -> String {
    match verdict {
        Verdict::Same => verdict.word().to_owned(),
        _ => format!("{} {}", format::change(before, now), verdict.word()).trim().to_owned(),
    }
}

/// The line below a number, with its colour; `None` where nothing is to be said.
pub(crate) fn line(comparison: Comparison, palette: &Palette) -> Option<(String, Color32)> {
    match comparison {
        Comparison::Change { before, now, verdict } => {
            Some((verdict_text(before, now, verdict), verdict_color(verdict, palette)))
        }
        Comparison::OtherContainer => Some(("not comparable".to_owned(), palette.dim)),
        Comparison::Unknown | Comparison::OtherView => None,
    }
}

/// The sentence in the tooltip: the number before, or why there is no difference. `text` formats a number.
pub(crate) fn sentence(comparison: Comparison, text: impl Fn(f64) -> String) -> Option<String> {
    match comparison {
        Comparison::Change { before, .. } => Some(format!("The tree before: {}", text(before))),
        Comparison::OtherContainer => Some(
            "Not comparable with the tree before, which had the other container: costs are relative to the root's surface"
                .to_owned(),
        ),
        Comparison::OtherView => {
            Some("The tree before was counted in another view or shading, so no difference is shown".to_owned())
        }
        Comparison::Unknown => None,
    }
}
