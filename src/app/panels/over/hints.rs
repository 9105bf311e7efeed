//! Lines in the viewport that explain what is missing: no container chosen, with a way out; nothing of the model in the
//! picture. While files hover over the window, what dropping them will do.

use egui::{self, Align2, Area, CornerRadius, FontId, Frame, Id, Margin, Rect, Stroke, StrokeKind, Ui, vec2};

use crate::app::commands::{Action, CompareStep};
use crate::app::state::{AppState, Presented};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::scene::{FileFormat, format_names};

/// Remedy where nothing is drawn.
enum WayOut {
    /// Hidden nodes are all that the depths hold.
    ShowAll,
    /// The section plane cuts all of them away.
    Whole,
    /// Leaves are further down.
    Depths([u32; 2]),
    /// Other depths hold nodes that both trees have.
    Automatic,
    /// No depth does.
    NotOnlyCommon,
}

/// Says so where no container is chosen, with a way out, within `rect`, the viewport's rectangle.
pub(crate) fn nothing_drawn(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let Some((text, button, way_out)) = message(state) else { return };
    let palette = theme::palette(ui);
    let at = rect.center_bottom() - vec2(0.0, 16.0);
    let area = Area::new(Id::unique("nothing drawn")).fixed_pos(at).pivot(Align2::CENTER_BOTTOM).constrain_to(rect);
    area.show(ui.ctx(), |ui| {
        Frame::new().fill(palette.veil).corner_radius(6).inner_margin(Margin::symmetric(10, 6)).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label(text);
                let link = ui.link(button).tip("Change the settings so that containers are drawn");
                if link.clicked() {
                    match way_out {
                        WayOut::ShowAll => state.selection.show_all(),
                        WayOut::Whole => state.wanted.render.section = None,
                        WayOut::Depths(depths) => state.wanted.overlay.depth = Some(depths),
                        WayOut::Automatic => state.wanted.overlay.depth = None,
                        WayOut::NotOnlyCommon => Action::Compare(CompareStep::OnlyCommon).perform(state),
                    }
                }
            });
        });
    });
}

/// The message, the label of the link and what it does; `None` where containers are drawn or switched off.
fn message(state: &AppState) -> Option<(String, &'static str, WayOut)> {
    let shown = state.model.presented.as_ref()?;
    let nothing = state.layout.graphics.shown.as_ref().is_some_and(|shown| shown.wanted == 0);
    if !nothing || state.layout.graphics.standing.is_some() || state.drawn_kinds().is_empty() {
        return None;
    }
    if state.selection.nodes.hides_any() {
        return Some(("All containers at these depths are hidden.".to_owned(), "Show all", WayOut::ShowAll));
    }
    let section = shown.frame.settings.section;
    let table = state.model.table()?;
    let overlay = state.overlay_of(table);
    let drawn = table.drawn_depths(&overlay);
    if state.draws_only_common() && section.is_none() {
        let what = if overlay.leaves_only { "leaf" } else { "container" };
        let text = format!("No {what} at these depths is in both trees.");
        // Automatic depths have some, unless they are those of all leaves.
        let can_follow = state.wanted.overlay.depth.is_some() && !overlay.leaves_only;
        return Some(if can_follow {
            (text, "Choose other depths", WayOut::Automatic)
        } else {
            (text, "Show those of one tree too", WayOut::NotOnlyCommon)
        });
    }
    let [first, last] = table.leaf_depths()?;
    let holds_leaves = drawn[0] <= last && first <= drawn[1];
    if section.is_some() && (holds_leaves || !state.wanted.overlay.leaves_only) {
        let text = "The section plane cuts all containers at these depths away.".to_owned();
        return Some((text, "Show the whole model", WayOut::Whole));
    }
    let text = if last < state.drawn_depths()[0] {
        format!("Leaves end at depth {last}.")
    } else {
        format!("Leaves start at depth {first}.")
    };
    Some((text, "Show them", WayOut::Depths([first, last])))
}

/// Says so where nothing of the model is in the picture, within `rect`, the viewport's rectangle.
pub(crate) fn nothing_in_view(ui: &Ui, rect: Rect, state: &AppState) {
    let Some(shown) = &state.model.presented else { return };
    let Some(lines) = reason(shown).filter(|_| state.preferences.show_geometry) else { return };
    for (index, line) in lines.into_iter().enumerate() {
        let at = rect.center() + vec2(0.0, 20.0 * index as f32 - 10.0);
        let palette = theme::palette(ui);
        let galley = ui.painter().layout_no_wrap(line.to_owned(), FontId::proportional(14.0), palette.text);
        let back = Align2::CENTER_CENTER.anchor_size(at, galley.size());
        ui.painter().rect_filled(back.expand2(vec2(8.0, 2.0)), 4.0, palette.veil);
        ui.painter().galley(back.min, galley, palette.text);
    }
}

/// Why the picture is empty and what to do; `None` where it is not, or is not sharp yet.
fn reason(shown: &Presented) -> Option<[&'static str; 2]> {
    let frame = &shown.frame;
    if frame.coarseness > 1.0 || frame.stats.primary_rays == 0 || frame.stats.hits > 0 {
        return None;
    }
    let flat = shown.accel.scene.bounds.extent().to_array().iter().filter(|side| **side == 0.0).count();
    Some(if flat >= 2 {
        ["This model has no surface", "Its triangles are all points or lie on one line, so no ray can hit them"]
    } else {
        [
            "Nothing of the model is in view",
            "F frames it, R goes back to the default view; triangles without area are never seen",
        ]
    })
}

/// Longest file name shown, in characters.
const MAX_NAME: usize = 48;

/// Shows what dropping files will do, while they hover over the window, within `rect`, the viewport's rectangle.
pub(crate) fn drop_hint(ui: &Ui, rect: Rect) {
    let paths: Vec<_> = ui.input(|input| input.raw.hovered_files.iter().map(|file| file.path.clone()).collect());
    if paths.is_empty() {
        return;
    }
    let known = |path: &&Option<std::path::PathBuf>| {
        path.as_deref().is_some_and(|path| FileFormat::from_extension(path).is_some())
    };
    let chosen = paths.iter().find(known).or(paths.first()).and_then(Option::as_deref);
    let name = chosen.and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
    let is_model = chosen.is_some_and(|path| FileFormat::from_extension(path).is_some());
    let text = match &name {
        Some(name) => format!("Drop to open {}", format::elide_middle(name, MAX_NAME)),
        None => "Drop to open this file".to_owned(),
    };
    let below = if name.is_some() && !is_model {
        format!("Its name is not one of a model: {} are read", format_names("and"))
    } else if paths.len() > 1 {
        format!("The first model of {} files; the others stay closed", paths.len())
    } else {
        "The present model stays until the new one is ready".to_owned()
    };
    let palette = theme::palette(ui);
    let frame = rect.shrink(8.0);
    let painter = ui.painter();
    painter.rect_filled(frame, CornerRadius::same(8), palette.veil);
    painter.rect_stroke(frame, CornerRadius::same(8), Stroke::new(2.0, palette.accent), StrokeKind::Inside);
    let center = frame.center();
    painter.text(center - vec2(0.0, 4.0), Align2::CENTER_BOTTOM, text, FontId::proportional(18.0), palette.text);
    painter.text(
        center + vec2(0.0, 6.0),
        Align2::CENTER_TOP,
        below,
        FontId::proportional(theme::VALUE_SIZE),
        palette.dim,
    );
}
