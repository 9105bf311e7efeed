//! The views of the dock, a folder each: what it shows and what it derives. [`VIEWS`] is the only list of them.

mod axes;
mod parts;

mod icicle;
mod merges;
mod nodes;
mod paper;
mod plots;
mod ray;

use egui::{Key, Ui};

use crate::app::state::AppState;
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::population::ViewRays;

/// The views, in the order of their tabs.
pub(crate) static VIEWS: [&dyn View; 6] =
    [&merges::MergesView, &icicle::IcicleView, &ray::RayView, &nodes::NodesView, &plots::PlotsView, &paper::PaperView];

/// The open view.
pub(crate) fn open_view(state: &AppState) -> Option<&'static dyn View> {
    VIEWS.into_iter().find(|view| state.preferences.dock.shows(view.name()))
}

/// Adds the background studies of all views.
pub(crate) fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
    add_visits(studies)?;
    VIEWS.iter().try_for_each(|view| view.add_studies(studies))
}

/// Adds the study of measured visits, by the rays of the view, which several views need.
fn add_visits(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "visits",
        label: "Measuring visits",
        at_once: false,
        study: |state| &mut state.lab.visits,
        wanted: |state, idle| {
            let accel =
                state.presented_tree().filter(|_| open_view(state).is_some_and(|view| view.needs_visits(state)))?;
            // Not before the picture has come to rest.
            if state.lab.rays(&accel.scene).is_none() && idle {
                let present = state.view_rays();
                state.lab.measure_by(&accel.scene, present);
            }
            let rays = state.lab.rays(&accel.scene)?;
            Some((accel, rays))
        },
    };
    studies.add(plan, |accel, rays: &ViewRays, token| rays.measure(accel, token))
}

/// A view of the dock as the window sees it.
pub(crate) trait View: Sync {
    /// The name on its tab, by which saved settings and shared lines name it too.
    fn name(&self) -> &'static str;

    /// Its purpose in one sentence.
    fn purpose(&self) -> &'static str;

    /// The key that opens and closes it.
    fn key(&self) -> Key;

    /// Shows it.
    fn ui(&self, ui: &mut Ui, state: &mut AppState);

    /// Adds its background studies.
    fn add_studies(&self, _studies: &mut Studies) -> std::io::Result<()> {
        Ok(())
    }

    /// It shows measured visits now.
    fn needs_visits(&self, _state: &AppState) -> bool {
        false
    }

    /// It shows how many primitives are below each node.
    fn needs_counts(&self) -> bool {
        false
    }
}
