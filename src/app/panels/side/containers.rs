//! Section "Containers": which containers the overlay draws, and how; the curve that the primitives are sorted along.

use egui::{self, Label, RichText, Ui};

use crate::app::panels::side::control::{control, member, optional, switch};
use crate::app::state::curve::CurveState;
use crate::app::state::{AppState, before_passes};
use crate::app::views::parts;
use crate::app::widgets::{DropDown, Header, SliderSpec, check, more, row, section, slider};
use crate::app::{format, theme};
use crate::catalog::metrics::Source;
use crate::catalog::settings::{Setting, Settings as _, Value};
use crate::overlay::rows::{COLOR_BY, CONTAINERS, DEPTH, FACES, LEAVES, OVERLAP, PARENTS};
use crate::overlay::{ColorBy, ContainerSet, OverlaySettings};
use bvhscope_engine::tree::ContainerKind;

/// Settings that have a place of their own; all others are listed among those that are folded away.
static ABOVE: [&Setting<OverlaySettings>; 7] = [&CONTAINERS, &DEPTH, &LEAVES, &PARENTS, &FACES, &OVERLAP, &COLOR_BY];

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let header = Header { reset: Some("Reset the look of the containers; depths stay"), ..Header::default() };
    let reset = section(ui, "CONTAINERS", header, |ui| {
        kinds(ui, state);
        let overlay = &mut state.wanted.overlay;
        row(ui, LEAVES.label, "Which nodes of the chosen depths are drawn", |ui| {
            ui.horizontal(|ui| {
                switch(ui, &LEAVES, overlay);
                switch(ui, &PARENTS, overlay);
            })
            .response
        });
        control(ui, &COLOR_BY, overlay);
        colors(ui, state);
        more(ui, "containers", |ui| {
            let automatic = state.layout.graphics.automatic_budget() as f32;
            for &row in OverlaySettings::rows().iter().filter(|row| !ABOVE.contains(row)) {
                control(ui, row, &mut state.wanted.overlay);
                optional(ui, row, &mut state.wanted.overlay, automatic);
            }
            more_kinds(ui, state);
            curve(ui, state);
        });
        let shown = !state.drawn_kinds().is_empty();
        let (drawn, wanted) = state.layout.graphics.overlay_counts();
        let color = theme::palette(ui);
        let (text, color) = if !state.shows_containers() {
            let over = if state.preferences.show_containers { " over the difference" } else { "" };
            (format!("Containers are off{over}: B shows them"), color.dim)
        } else if !shown {
            ("No kind of container is chosen".to_owned(), color.dim)
        } else if state.colors_by(ColorBy::Survival) && has_no_other(state) {
            ("Nothing to compare with: add a tree B (Ctrl+2), or choose passes".to_owned(), color.warning)
        } else if wanted > drawn {
            let drawn = format::count(drawn as u64);
            (format!("{drawn} of {} shown: the largest on screen", format::count(wanted as u64)), color.warning)
        } else if wanted == 0 && state.layout.graphics.shown.is_some() {
            let those = if state.draws_only_common() { " that both trees have" } else { "" };
            (format!("No containers at this depth{those}"), color.dim)
        } else {
            return;
        };
        ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
    });
    if reset {
        state.wanted.overlay = OverlaySettings { depth: state.wanted.overlay.depth, ..OverlaySettings::default() };
    }
}

/// The rays that colours stand for, or why the tree on the screen has no such colours.
fn colors(ui: &mut Ui, state: &mut AppState) {
    let ColorBy::Metric(metric) = state.wanted.overlay.color_by else { return };
    let Some(shown) = state.model.presented.clone().filter(|_| state.preferences.show_containers) else { return };
    if metric.source == Source::Visits {
        ui.horizontal_wrapped(|ui| parts::rays(ui, state, &shown));
    }
    let Some(text) = parts::missing(state, &shown, metric) else { return };
    let is_stopped = state.model.derived.is_measuring_stopped(&shown.accel);
    let color = theme::palette(ui).dim;
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(if is_stopped { "Stopped" } else { text }).color(color));
        if is_stopped && ui.button("Begin again").clicked() {
            state.model.derived.resume_measuring();
        }
    });
}

/// Whether there is no second tree, and the first had no passes.
fn has_no_other(state: &AppState) -> bool {
    state.wanted.second.is_none() && state.presented_tree().is_some_and(|accel| before_passes(&accel).is_none())
}

/// The containers that are drawn: those of the tree's kind, until one is chosen by hand.
#[derive(Clone, Copy, PartialEq)]
enum Drawn {
    AsTree,
    One(ContainerKind),
    /// None, or several at once.
    Several,
}

/// Which kind of containers is drawn, one of them by a click.
fn kinds(ui: &mut Ui, state: &mut AppState) {
    let overlay = &mut state.wanted.overlay;
    let Value::Any { options, .. } = &CONTAINERS.value else { return };
    let options = options();
    let only = ContainerKind::WITH_ORIENTED.into_iter().find(|kind| ContainerSet::of(*kind) == overlay.containers);
    let mut drawn = match only {
        _ if overlay.follows_tree => Drawn::AsTree,
        Some(kind) => Drawn::One(kind),
        None => Drawn::Several,
    };
    let as_tree = (Drawn::AsTree, "As the tree", "Draw what the tree is built of, also after that changes");
    let several = (drawn == Drawn::Several).then(|| {
        let name = if overlay.containers.is_empty() { "None" } else { "Several" };
        (Drawn::Several, name, "Those that are chosen below More")
    });
    let each = ContainerKind::WITH_ORIENTED.into_iter().zip(&options);
    let each = each.map(|(kind, option)| (Drawn::One(kind), option.label, option.tip.as_str()));
    let choices: Vec<_> = std::iter::once(as_tree).chain(each).chain(several).collect();
    if DropDown::new(CONTAINERS.label, &choices).explained().row(ui, CONTAINERS.tip, &mut drawn) {
        match drawn {
            Drawn::AsTree => overlay.follows_tree = true,
            Drawn::One(kind) => *overlay = overlay.with_kinds(ContainerSet::of(kind)),
            Drawn::Several => {}
        }
    }
}

/// Several kinds at once, and what else is drawn of containers.
fn more_kinds(ui: &mut Ui, state: &mut AppState) {
    let own = state.container_kind();
    let overlay = &mut state.wanted.overlay;
    row(ui, "Kinds", "Draw several kinds of containers at once", |ui| {
        ui.vertical(|ui| {
            let mut chosen = overlay.spelt_out(own);
            let before = chosen.containers;
            for pair in ContainerKind::WITH_ORIENTED.chunks(2) {
                ui.horizontal(|ui| pair.iter().for_each(|kind| member(ui, &CONTAINERS, &mut chosen, *kind as usize)));
            }
            if chosen.containers != before {
                *overlay = chosen;
            }
        })
        .response
    });
    for setting in [&FACES, &OVERLAP] {
        control(ui, setting, overlay);
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
