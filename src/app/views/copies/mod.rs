//! The view "Copies": what the rays of the view cost in the parts of a scene of two levels, or its forms flat, in two levels and opened,
//! or what other meshes would save.

mod advice;
mod content;
mod costs;
mod dearest;
mod forms;
mod plot;
mod report;

use std::sync::Arc;

use egui::{self, Align, Key, Layout, Ui};
use serde::{Deserialize, Serialize};

use self::advice::MeasuredAdvice;
use self::content::Content;
use self::costs::MeasuredParts;
use self::dearest::DearCopy;
use self::forms::MeasuredForms;
use super::parts;
use crate::accel::Accel;
use crate::app::format;
use crate::app::state::{AppState, Derived, Presented, Study, ViewState};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{Needs, View};
use crate::app::widgets::{chip, empty_view};
use crate::lab::LabError;
use crate::lab::population::ViewRays;

/// The study of a section: its measurement, or the reason that there is none.
type Measured<T> = Study<ViewRays, Result<T, String>>;

/// The content of a section in the view.
trait InView: Content {
    /// The section.
    const SECTION: Section;

    /// The study of it.
    fn study(view: &mut CopiesView) -> &mut Measured<Self>;
}

impl InView for MeasuredParts {
    const SECTION: Section = Section::Costs;

    fn study(view: &mut CopiesView) -> &mut Measured<Self> {
        &mut view.parts
    }
}

impl InView for MeasuredForms {
    const SECTION: Section = Section::Forms;

    fn study(view: &mut CopiesView) -> &mut Measured<Self> {
        &mut view.forms
    }
}

impl InView for MeasuredAdvice {
    const SECTION: Section = Section::Advice;

    fn study(view: &mut CopiesView) -> &mut Measured<Self> {
        &mut view.advice
    }
}

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
    parts: Measured<MeasuredParts>,
    forms: Measured<MeasuredForms>,
    advice: Measured<MeasuredAdvice>,
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
            Section::Costs => self.content::<MeasuredParts>(ui, state, &shown),
            Section::Forms => self.content::<MeasuredForms>(ui, state, &shown),
            Section::Advice => self.content::<MeasuredAdvice>(ui, state, &shown),
        }
    }

    // Their rays are those of measured visits.
    fn needs(&self) -> Needs {
        Needs { visits: true, ..Needs::default() }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        add_study::<MeasuredParts>(studies)?;
        add_study::<MeasuredForms>(studies)?;
        add_study::<MeasuredAdvice>(studies)
    }
}

/// Adds the study of a section. A refusal is an outcome, too.
fn add_study<T: InView>(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        T::THREAD,
        T::LABEL,
        |state| T::study(state.views.get_mut()),
        |state, _| state.inputs_of(|view: &CopiesView, model, accel| view.inputs(T::SECTION, &model.derived, accel)),
    );
    studies.add(plan, |accel, rays: &ViewRays, token| match T::measure(accel, rays, token) {
        Ok(measured) => Ok(Ok(measured)),
        Err(LabError::Refused(text)) => Ok(Err(text)),
        Err(LabError::Cancelled(cancelled)) => Err(cancelled),
    })
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

    /// Shows what a section measured, or why there is nothing, or waits for it.
    fn content<T: InView>(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let inputs = self.inputs(T::SECTION, &state.model.derived, &shown.accel);
        let known = inputs.as_ref().and_then(|inputs| T::study(self).get(&shown.accel, inputs)).cloned();
        let of_outputs = known.as_deref().and_then(|known| known.as_ref().ok());
        self.bar(ui, state, shown, |ui, state| T::outputs(ui, state, shown, of_outputs));
        match known.as_deref() {
            None => {
                let study = (T::study(self), inputs);
                parts::wait_for(ui, &mut state.model.derived, &shown.accel, study, T::LABEL);
            }
            Some(Ok(known)) if known.rays() == 0 => {
                empty_view(ui, parts::no_rays(state, shown).unwrap_or("There are no such rays"));
            }
            Some(Ok(known)) => known.show(ui, state, shown, &mut self.revealed),
            Some(Err(reason)) => empty_view(ui, &format::capital(reason)),
        }
    }
}
