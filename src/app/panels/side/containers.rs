//! Section "Containers": which containers the overlay draws, and how; the curve that the primitives are sorted along.

use egui::{self, Label, RichText, Ui};

use crate::app::state::curve::CurveState;
use crate::app::state::{AppState, before_passes};
use crate::app::widgets::{DropDown, Header, SliderSpec, check, more, row, section, slider};
use crate::app::{format, theme};
use crate::overlay::{ColorBy, OverlaySettings};
use bvhscope_engine::tree::ContainerKind;

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let header = Header { reset: Some("Reset the look of the containers; depths stay"), ..Header::default() };
    let reset = section(ui, "CONTAINERS", header, |ui| {
        kinds(ui, state);
        let overlay = &mut state.wanted.overlay;
        row(ui, "Of these", "Which nodes of the chosen depths are drawn", |ui| {
            ui.horizontal(|ui| {
                check(ui, &mut overlay.leaves_only, "Leaves only", "Draw only the leaves within the chosen depths");
                check(ui, &mut overlay.parents, "Parents", "Also draw all levels above the chosen depths");
            })
            .response
        });
        let choices = ColorBy::ALL.map(|choice| {
            let meaning = match choice {
                ColorBy::Depth => "Levels below the root: what contains what",
                ColorBy::Size => "Surface area relative to the root's: how likely a ray hits it",
                ColorBy::Overlap => {
                    "Surface that its two children have in common, over its own: rays there must visit both. Of more children, the sum over all pairs"
                }
                ColorBy::Primitives => "Number of triangles below it: where the model is dense",
                ColorBy::Regret => "What rebuilding it would save: where the tree is bad",
                ColorBy::Growth => {
                    "Its surface now over that when the tree was built, in trees that are kept or fitted while the model moves"
                }
                ColorBy::Planes => "Whether an oriented box is a plain one, turned to fit or skewed: see the pass Orient",
                ColorBy::Survival => {
                    "Whether tree B has a node of the same triangles too; without a B, whether the tree had it before its passes"
                }
            };
            (choice, choice.label(), meaning)
        });
        let tip = "What the colour of a container means; the legend has the numbers";
        DropDown::new("Colour by", &choices).row(ui, tip, &mut overlay.color_by);
        more(ui, "containers", |ui| {
            line_style(ui, &mut state.wanted.overlay, state.layout.graphics.automatic_budget());
            curve(ui, state);
        });
        let shown = !state.drawn_kinds().is_empty();
        let (drawn, wanted) = state.layout.graphics.overlay_counts();
        let color = theme::palette(ui);
        let (text, color) = if !state.preferences.show_containers {
            ("Containers are off: B shows them".to_owned(), color.dim)
        } else if !shown {
            ("No kind of container is chosen".to_owned(), color.dim)
        } else if state.colors_by(ColorBy::Survival) && has_no_other(state) {
            ("Nothing to compare with: add a tree B (Ctrl+2), or choose passes".to_owned(), color.warning)
        } else if wanted > drawn {
            let drawn = format::count(drawn as u64);
            (format!("{drawn} of {} shown: the largest on screen", format::count(wanted as u64)), color.warning)
        } else if wanted == 0 && state.layout.graphics.shown.is_some() {
            ("No containers at this depth".to_owned(), color.dim)
        } else {
            return;
        };
        ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
    });
    if reset {
        state.wanted.overlay = OverlaySettings { depth: state.wanted.overlay.depth, ..OverlaySettings::default() };
    }
}

/// Whether there is no second tree, and the first had no passes.
fn has_no_other(state: &AppState) -> bool {
    state.wanted.second.is_none() && state.presented_tree().is_some_and(|accel| before_passes(&accel).is_none())
}

/// Which kinds of containers are drawn: those of the tree, until one is chosen by hand.
fn kinds(ui: &mut Ui, state: &mut AppState) {
    let kind = state.container_kind();
    let overlay = &mut state.wanted.overlay;
    row(ui, "Show", "Boxes, spheres and 14-DOPs, whichever the tree is built with (B hides all)", |ui| {
        ui.vertical(|ui| {
            let choose = |ui: &mut Ui, overlay: &mut OverlaySettings, drawn, label, tip| {
                let kinds = overlay.kinds(kind);
                let mut on = kinds.contains(drawn);
                if check(ui, &mut on, label, tip) {
                    *overlay = overlay.with_kinds(if on { kinds.with(drawn) } else { kinds.without(drawn) });
                }
            };
            ui.horizontal(|ui| {
                choose(ui, overlay, ContainerKind::Aabb, "Boxes", "Draw the boxes around nodes");
                choose(ui, overlay, ContainerKind::Sphere, "Spheres", "Draw the spheres around nodes");
            });
            // A narrow panel stays as it is where there is one more kind.
            ui.horizontal_wrapped(|ui| {
                choose(ui, overlay, ContainerKind::Dop14, "14-DOPs", "Draw the 14-DOPs around nodes");
                if kind == ContainerKind::Oriented || overlay.kinds(kind).contains(ContainerKind::Oriented) {
                    let tip = "Draw the turned and skewed boxes of a tree after the pass Orient";
                    choose(ui, overlay, ContainerKind::Oriented, "Oriented", tip);
                }
                let tip = "Draw what the tree is built of, also after that changes";
                check(ui, &mut overlay.follows_tree, "As tree", tip);
            });
            let tip = "Fill the sides that face you, faintly, so that near and far are told apart";
            check(ui, &mut overlay.faces, "Faces", tip);
            let tip = "Fill what the children of the selected node have in common, seen through the surface: rays there must visit both. Of spheres the smallest one around it is drawn";
            check(ui, &mut overlay.overlap, "Overlap of children", tip);
        })
        .response
    });
}

/// Sliders for hidden lines, line width and the most containers drawn.
fn line_style(ui: &mut Ui, overlay: &mut OverlaySettings, automatic: u32) {
    let defaults = OverlaySettings::default();
    let hidden = "How strong lines behind the surface are. 0 hides them, 1 draws them like those in front";
    let width = "Width of the lines in points, the same at any zoom";
    for (value, label, tip, range, default) in [
        (&mut overlay.hidden_alpha, "Hidden lines", hidden, 0.0..=1.0, defaults.hidden_alpha),
        (&mut overlay.line_width, "Line width", width, 0.5..=4.0, defaults.line_width),
    ] {
        slider(ui, value, &SliderSpec { decimals: 2, ..SliderSpec::new(label, tip, range, default.into()) });
    }
    let mut budget = f64::from(overlay.budget.unwrap_or(automatic));
    let spec = SliderSpec {
        logarithmic: true,
        ..SliderSpec::new(
            "At most",
            "Containers drawn of each kind; where the depths hold more, the largest on screen are shown. More is slower",
            100.0..=1_000_000.0,
            f64::from(automatic),
        )
    };
    if slider(ui, &mut budget, &spec) {
        overlay.budget = Some(budget as u32).filter(|&budget| budget != automatic);
    }
}

/// Shows the rows.
pub(super) fn curve(ui: &mut Ui, state: &mut AppState) {
    let tip = "Draw the curve along which AAC sorts the triangles: a line through their centres, from blue to orange";
    row(ui, "Sorting", tip, |ui| {
        ui.horizontal(|ui| check(ui, &mut state.model.curve.shown, "Curve through centres", tip)).response
    });
    if !state.model.curve.shown {
        return;
    }
    let spec = SliderSpec {
        zero: "all",
        ..SliderSpec::new(
            "Split level",
            "The cells at which the recursion has split the triangles after so many levels; 0 is the whole model",
            0.0..=f64::from(CurveState::MAX_LEVEL),
            f64::from(CurveState::default().level),
        )
    };
    slider(ui, &mut state.model.curve.level, &spec);
    let palette = theme::palette(ui);
    let known = state.model.presented.as_ref().and_then(|shown| state.model.curve.scaffold.of_tree(&shown.accel));
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
