//! The view "Copies": what the rays of the view cost in the parts of a scene of two levels, or its forms flat, in two levels and opened,
//! or what other meshes would save.

mod advice;
mod dearest;
mod forms;
mod plot;
mod report;

use std::sync::Arc;

use egui::{self, Align, Key, Layout, ScrollArea, Ui, UiBuilder};
use serde::{Deserialize, Serialize};

use self::advice::MeasuredAdvice;
use self::dearest::DearCopy;
use self::forms::MeasuredForms;
use self::report::{GAP, report};
use super::parts;
use crate::accel::Accel;
use crate::app::format;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Derived, Presented, Study, ViewState};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{Needs, View};
use crate::app::widgets::{Tip as _, chip, empty_view};
use crate::lab::LabError;
use crate::lab::copy_costs::{CostInPart, copy_costs};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, dearest_copies, mesh_costs};
use crate::text::counted;
use bvhscope_engine::cancel::Cancelled;

/// Number of copies that are listed.
const MOST_COPIES: usize = 200;
/// Part of the width that the table takes.
const TABLE: f32 = 0.62;

/// Labels of the studies.
const COUNTING: &str = "Tracing rays through both levels";
const BUILDING: &str = "Building the forms of the scene";
const CHANGING: &str = "Tracing rays through other meshes";

/// The costs of the rays in all parts of the scene.
#[derive(Debug)]
struct MeasuredParts {
    rows: Vec<CostInPart>,
    /// The copies among them, the dearest first.
    dearest: Vec<DearCopy>,
}

/// The costs, or why there are none.
type Measured<T> = Result<T, String>;

/// A part of the view.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Section {
    #[default]
    Costs,
    Forms,
    Advice,
}

impl Section {
    /// All with labels and meanings.
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Costs,
            "Costs",
            "What rays cost in the tree over the copies, in each mesh and in the copies with most tests",
        ),
        (Self::Forms, "Forms", "The scene flat, in two levels, and with the tree over the copies opened"),
        (Self::Advice, "Advice", "What it would save to split a mesh, or to make one of two that stand together"),
    ];
}

/// The choice of the user, and the measurements.
#[derive(Debug, Default)]
pub struct CopiesView {
    section: Section,
    parts: Study<ViewRays, Measured<MeasuredParts>>,
    forms: Study<ViewRays, Measured<MeasuredForms>>,
    advice: Study<ViewRays, Measured<MeasuredAdvice>>,
    /// The copy to which the list was scrolled last, so that it can be scrolled away from the selected one.
    revealed: Option<u32>,
}

/// The part of the view in a shared state.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedCopies {
    section: Section,
}

impl ViewState for CopiesView {
    const NAME: &'static str = "Copies";
    type Shared = SharedCopies;

    fn shared(&self, _: Option<&Arc<Accel>>) -> SharedCopies {
        let Self { section, parts: _, forms: _, advice: _, revealed: _ } = self;
        SharedCopies { section: *section }
    }

    fn show_shared(&mut self, SharedCopies { section }: SharedCopies) {
        self.section = section;
    }

    #[cfg(test)]
    fn changed() -> Self {
        Self { section: Section::Forms, ..Self::default() }
    }
}

impl View for CopiesView {
    const PURPOSE: &'static str = "Which copies and meshes make rays slow in a scene of two levels, and what opening the tree over the copies, or other meshes, would save";
    const KEY: Key = Key::O;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let Some(shown) = parts::presented_tree(ui, state, "Open a model to see what its copies cost") else { return };
        let scene = &shown.accel.scene;
        if scene.copies.is_none() {
            let text = if scene.repeats_meshes {
                "Copies are counted in two levels: File has “Copies in two levels” for this scene"
            } else {
                "This model has no copies of meshes; the built-in forest, village, stack and traffic have"
            };
            return empty_view(ui, text);
        }
        match self.section {
            Section::Costs => self.costs(ui, state, &shown),
            Section::Forms => self.forms(ui, state, &shown),
            Section::Advice => self.advice(ui, state, &shown),
        }
    }

    // Their rays are those of measured visits.
    fn needs(&self) -> Needs {
        Needs { visits: true, ..Needs::default() }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        let plan = StudyPlan::new(
            "copies",
            COUNTING,
            |state| &mut state.views.get_mut::<Self>().parts,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(Section::Costs, &model.derived, accel)),
        );
        studies.add(plan, |accel, rays: &ViewRays, token| {
            let mut rows = Vec::new();
            let rays = std::slice::from_ref(rays);
            outcome(copy_costs(accel, rays, MOST_COPIES, token, &mut |row| rows.push(row)), || {
                let dear = |row: &CostInPart| {
                    let copy = row.part.copy?;
                    Some(DearCopy { copy, node: accel.node_of_copy(copy), row: *row })
                };
                let dearest = rows.iter().filter_map(dear).collect();
                MeasuredParts { rows, dearest }
            })
        })?;
        let plan = StudyPlan::new(
            "forms",
            BUILDING,
            |state| &mut state.views.get_mut::<Self>().forms,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(Section::Forms, &model.derived, accel)),
        );
        studies.add(plan, |accel, rays: &ViewRays, token| {
            let mut forms = MeasuredForms::default();
            outcome(forms.measure(accel, rays, token), || forms)
        })?;
        let plan = StudyPlan::new(
            "advice",
            CHANGING,
            |state| &mut state.views.get_mut::<Self>().advice,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(Section::Advice, &model.derived, accel)),
        );
        studies.add(plan, |accel, rays: &ViewRays, token| {
            let mut advice = MeasuredAdvice::default();
            outcome(advice.measure(accel, rays, token), || advice)
        })
    }
}

/// A measurement, of which a refusal is an outcome, too.
fn outcome<T>(measured: Result<(), LabError>, value: impl FnOnce() -> T) -> Result<Measured<T>, Cancelled> {
    match measured {
        Ok(()) => Ok(Ok(value())),
        Err(LabError::Refused(text)) => Ok(Err(text)),
        Err(LabError::Cancelled(cancelled)) => Err(cancelled),
    }
}

/// Shows what was measured by so many `rays` by `show`, or why there is nothing.
fn answer<T>(
    ui: &mut Ui,
    state: &mut AppState,
    shown: &Presented,
    known: &Measured<T>,
    rays: fn(&T) -> u64,
    show: impl FnOnce(&mut Ui, &mut AppState, &T),
) {
    match known {
        Ok(known) if rays(known) == 0 => {
            empty_view(ui, parts::no_rays(state, shown).unwrap_or("There are no such rays"));
        }
        Ok(known) => show(ui, state, known),
        Err(reason) => empty_view(ui, &format::capital(reason)),
    }
}

impl MeasuredParts {
    fn rays(&self) -> u64 {
        self.rows.first().map_or(0, |row| row.rays)
    }
}

impl CopiesView {
    /// The inputs for `accel` of a section, where it is shown and the rays are known.
    fn inputs(&self, section: Section, derived: &Derived, accel: &Arc<Accel>) -> Option<ViewRays> {
        let is_shown = self.section == section && accel.scene.copies.is_some();
        is_shown.then(|| derived.rays(&accel.scene))?
    }

    /// The copy `step` places below `picked` in the list of `accel`, or the first where that is not listed; `None` at either end and while
    /// nothing is listed.
    pub(crate) fn neighbour(&self, accel: &Arc<Accel>, picked: Option<u32>, step: isize) -> Option<u32> {
        let dearest = self.dearest(accel)?;
        let place = dearest.iter().position(|dear| Some(dear.copy) == picked);
        let target = place.map_or(Some(0), |place| place.checked_add_signed(step))?;
        dearest.get(target).map(|dear| dear.copy)
    }

    /// True if the copies of `accel` are listed.
    pub(crate) fn lists(&self, accel: &Arc<Accel>) -> bool {
        self.dearest(accel).is_some()
    }

    /// Shows the list of copies in place of other sections.
    pub(crate) fn show_list(&mut self) {
        self.section = Section::Costs;
    }

    fn dearest(&self, accel: &Arc<Accel>) -> Option<&[DearCopy]> {
        self.parts.of_tree(accel)?.as_ref().as_ref().ok().map(|known| &known.dearest[..])
    }

    /// The choices, and at its right end the `outputs`.
    fn bar(
        &mut self,
        ui: &mut Ui,
        state: &mut AppState,
        shown: &Presented,
        outputs: impl FnOnce(&mut Ui, &mut AppState),
    ) {
        ui.horizontal(|ui| {
            for (section, label, tip) in Section::ALL {
                if chip(ui, label, self.section == section, tip) {
                    self.section = section;
                }
            }
            ui.add_space(6.0);
            parts::rays(ui, state, shown);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| outputs(ui, state));
        });
        ui.add_space(4.0);
    }

    /// Shows the costs of all parts, or waits for them.
    fn costs(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let inputs = self.inputs(Section::Costs, &state.model.derived, &shown.accel);
        let known = inputs.as_ref().and_then(|inputs| self.parts.get(&shown.accel, inputs)).cloned();
        let of_outputs = known.as_deref().and_then(|known| known.as_ref().ok());
        self.bar(ui, state, shown, |ui, state| outputs(ui, state, shown, of_outputs));
        let Some(known) = known.as_deref() else {
            let study = (&mut self.parts, inputs);
            return parts::wait_for(ui, &mut state.model.derived, &shown.accel, study, COUNTING);
        };
        answer(ui, state, shown, known, MeasuredParts::rays, |ui, state, known| self.body(ui, state, shown, known));
    }

    /// Shows the forms of the scene, or waits for them.
    fn forms(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let inputs = self.inputs(Section::Forms, &state.model.derived, &shown.accel);
        let known = inputs.as_ref().and_then(|inputs| self.forms.get(&shown.accel, inputs)).cloned();
        let of_outputs = known.as_deref().and_then(|known| known.as_ref().ok());
        self.bar(ui, state, shown, |ui, state| forms::outputs(ui, state, shown, of_outputs));
        let Some(known) = known.as_deref() else {
            let study = (&mut self.forms, inputs);
            return parts::wait_for(ui, &mut state.model.derived, &shown.accel, study, BUILDING);
        };
        answer(ui, state, shown, known, MeasuredForms::rays, |ui, state, known| forms::show(ui, state, shown, known));
    }

    /// Shows what other meshes would save, or waits for it.
    fn advice(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let inputs = self.inputs(Section::Advice, &state.model.derived, &shown.accel);
        let known = inputs.as_ref().and_then(|inputs| self.advice.get(&shown.accel, inputs)).cloned();
        let of_outputs = known.as_deref().and_then(|known| known.as_ref().ok());
        self.bar(ui, state, shown, |ui, state| advice::outputs(ui, state, shown, of_outputs));
        let Some(known) = known.as_deref() else {
            let study = (&mut self.advice, inputs);
            return parts::wait_for(ui, &mut state.model.derived, &shown.accel, study, CHANGING);
        };
        answer(ui, state, shown, known, MeasuredAdvice::rays, |ui, state, known| advice::show(ui, state, shown, known));
    }

    /// The table of the meshes on the left, and the list of copies beside it.
    fn body(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented, known: &MeasuredParts) {
        let [left, right] = parts::beside(ui, TABLE, GAP);
        ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
            let area = ScrollArea::both().id_salt("copies").auto_shrink(false);
            area.show(ui, |ui| report(ui, state, &part_table(shown, known)));
        });
        ui.scope_builder(UiBuilder::new().max_rect(right), |ui| {
            dearest::show(ui, state, shown, &known.dearest, &mut self.revealed);
        });
        ui.advance_cursor_after_rect(left.union(right));
    }
}

fn part_table(shown: &Presented, known: &MeasuredParts) -> ReportTable {
    mesh_costs(&shown.accel.scene.source.label(), &known.rows.iter().collect::<Vec<_>>())
}

/// The buttons that copy both tables and walk through the copies.
fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&MeasuredParts>) {
    let known = known.filter(|known| !known.rows.is_empty());
    let copy = ui.add_enabled(known.is_some(), egui::Button::new("Copy"));
    if let Some(known) = known.filter(|_| copy.tip("Copy both tables as tab-separated text").clicked()) {
        let dearest = dearest_copies(&known.rows.iter().collect::<Vec<_>>());
        let text = format!("{}\n{}", part_table(shown, known).tab_separated(), dearest.tab_separated());
        state.copy(text, &format!("{} copied", counted(known.rows.len() as u64, "rows")));
    }
    let has_copies = known.is_some_and(|known| !known.dearest.is_empty());
    parts::steps(ui, state, has_copies, "copy", Action::StepCopies, ["Alt+Shift+.", "Alt+Shift+,"]);
}
