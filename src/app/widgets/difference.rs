//! The difference between a number of the presented tree and that of the tree before, shown by sign, word and colour.

use egui::{Color32, Painter, Pos2, Shape, Stroke, vec2};

use crate::app::format;
use crate::app::state::comparison::{Comparison, Factor, Verdict};
use crate::app::theme::Palette;

/// Colour of a difference.
pub(crate) const fn verdict_color(verdict: Verdict, palette: &Palette) -> Color32 {
    match verdict {
        Verdict::Better => palette.better,
        Verdict::Worse => palette.worse,
        Verdict::Same | Verdict::Undecided | Verdict::Once | Verdict::Different => palette.dim,
    }
}

/// Sign, percentage and word: "−12 % better"; the word alone without a difference, and where none is decided.
pub(crate) fn verdict_text(before: f64, now: f64, verdict: Verdict) -> String {
    match verdict {
        Verdict::Same | Verdict::Undecided | Verdict::Once => verdict.word().to_owned(),
        _ => format!("{} {}", format::change(before, now), verdict.word()).trim().to_owned(),
    }
}

/// Paints the arrow of a difference of two trees at `center`: upwards where the number of B is larger. Nothing where they are the
/// same. The window's font has no arrows.
pub(crate) fn paint_arrow(painter: &Painter, center: Pos2, comparison: Comparison, palette: &Palette) {
    let Comparison::Change { before, now, verdict, .. } = comparison else { return };
    if matches!(verdict, Verdict::Same | Verdict::Undecided | Verdict::Once) {
        return;
    }
    let up = if now > before { -1.0 } else { 1.0 };
    let corners = [vec2(-4.0, -2.5 * up), vec2(4.0, -2.5 * up), vec2(0.0, 3.5 * up)].map(|offset| center + offset);
    painter.add(Shape::convex_polygon(corners.to_vec(), verdict_color(verdict, palette), Stroke::NONE));
}

/// The line below a number, with its colour; `None` where nothing is to be said.
pub(crate) fn line(comparison: Comparison, two_trees: bool, palette: &Palette) -> Option<(String, Color32)> {
    match comparison {
        Comparison::Change { before, now, verdict, .. } => {
            let text = verdict_text(before, now, verdict);
            let text = if two_trees && verdict != Verdict::Undecided { format!("B {text}") } else { text };
            Some((text, verdict_color(verdict, palette))).filter(|(text, _)| !text.is_empty())
        }
        Comparison::OtherContainer => Some(("not comparable".to_owned(), palette.dim)),
        Comparison::Unknown | Comparison::OtherView | Comparison::OtherStages => None,
    }
}

const OTHER_STAGES: &str = "Not compared: one of the two builds was not repeated as a whole, reused other stages of an earlier build, or changed the tree of another moment";

/// The sentence in the tooltip: the number before, or why there is no difference. `text` formats a number.
pub(crate) fn sentence(comparison: Comparison, two_trees: bool, text: impl Fn(f64) -> String) -> Option<String> {
    if two_trees {
        return Some(between_two(comparison, text));
    }
    match comparison {
        Comparison::Change { before, factor, .. } => {
            let basis = factor.map_or_else(String::new, |factor| format!("; now {}", basis(&factor)));
            Some(format!("The tree before: {}{basis}", text(before)))
        }
        Comparison::OtherContainer => Some(
            "Not comparable with the tree before, which had the other container: costs are relative to the root's surface"
                .to_owned(),
        ),
        Comparison::OtherView => {
            Some("The tree before was counted in another view or shading, so no difference is shown".to_owned())
        }
        Comparison::OtherStages => Some(OTHER_STAGES.to_owned()),
        Comparison::Unknown => None,
    }
}

/// The factor that decides a verdict: "× 0.388, with 99 % from 0.37 to 0.4, over 9 rounds".
fn basis(factor: &Factor) -> String {
    let interval = factor.interval.map_or_else(String::new, |[least, most]| {
        format!(", with 99 % from {} to {}", format::significant(least), format::significant(most))
    });
    let rounds = format::counted(factor.count as u64, "round");
    format!("× {}{interval}, over {rounds}", format::significant(factor.median))
}

/// The same for two trees side by side.
fn between_two(comparison: Comparison, text: impl Fn(f64) -> String) -> String {
    match comparison {
        Comparison::Change { before, now, verdict, factor } => {
            let verdict = match verdict {
                Verdict::Better => "B is better",
                Verdict::Worse => "A is better",
                Verdict::Same => "no difference",
                Verdict::Undecided => "which is better is not decided",
                Verdict::Once => "measured once, so that neither is called better",
                Verdict::Different => "neither is better by this number alone",
            };
            let basis = factor.map_or_else(String::new, |factor| format!(". B {}", basis(&factor)));
            format!("A: {}, B: {}; {verdict}{basis}", text(before), text(now))
        }
        Comparison::OtherContainer => {
            "Not comparable, because the trees have different containers: costs are relative to the root's surface"
                .to_owned()
        }
        Comparison::OtherStages => OTHER_STAGES.to_owned(),
        Comparison::OtherView | Comparison::Unknown => {
            "Compared once both pictures are at rest, with no triangle hidden".to_owned()
        }
    }
}
