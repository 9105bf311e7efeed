//! The views of the dock, a folder each: what it shows and what it derives. [`VIEWS`] is the only list of them.

mod axes;
mod parts;

mod icicle;
mod merges;
mod motion;
mod nodes;
mod paper;
mod plots;
mod ray;

use egui::{Key, Ui};

use crate::app::state::AppState;
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::population::ViewRays;
use crate::overlay::ColorBy;

/// The views, in the order of their tabs.
pub(crate) static VIEWS: [View; 7] =
    [merges::VIEW, icicle::VIEW, ray::VIEW, nodes::VIEW, plots::VIEW, paper::VIEW, motion::VIEW];

/// The open view.
pub(crate) fn open_view(state: &AppState) -> Option<&'static View> {
    VIEWS.iter().find(|view| state.preferences.dock.shows(view.name))
}

/// Goes on with what plays in the open view.
pub(crate) fn play(ui: &Ui, state: &mut AppState) {
    merges::play(ui, state);
}

/// Adds the background studies of all views.
pub(crate) fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
    add_visits(studies)?;
    add_regrets(studies)?;
    VIEWS.iter().try_for_each(|view| (view.add_studies)(studies))
}

/// Adds the study of measured visits, by the rays of the view, which several views need.
fn add_visits(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "visits",
        "Measuring visits",
        |state| &mut state.lab.visits,
        |state, idle| {
            let accel = open_view(state)
                .filter(|view| (view.needs_visits)(state))
                .and_then(|view| state.tree_of_view(view.name))?;
            // Not before the picture has come to rest.
            if state.lab.rays(&accel.scene).is_none() && idle {
                let present = state.view_rays();
                state.lab.measure_by(&accel.scene, present);
            }
            let rays = state.lab.rays(&accel.scene)?;
            Some((accel, rays))
        },
    );
    studies.add(plan, |accel, rays: &ViewRays, token| rays.measure(accel, token))
}

/// Regrets, for the open view or for the colours of containers.
fn add_regrets(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "regrets",
        "Rebuilding subtrees",
        |state| &mut state.lab.regrets,
        |state, _| {
            let by_view = open_view(state).filter(|view| (view.needs_regrets)(state));
            let of_view = by_view.and_then(|view| state.tree_of_view(view.name));
            Some((of_view.or_else(|| state.presented_tree().filter(|_| state.colors_by(ColorBy::Regret)))?, ()))
        },
    );
    studies.add(plan, |accel, (), token| accel.compute_regrets(token).map(|_| ()))
}

/// A view of the dock as the window sees it.
pub(crate) struct View {
    /// The name on its tab, by which saved settings and shared lines name it too.
    pub(crate) name: &'static str,
    /// Its purpose in one sentence.
    pub(crate) purpose: &'static str,
    /// The key that opens and closes it.
    pub(crate) key: Key,
    /// Shows it.
    pub(crate) ui: fn(&mut Ui, &mut AppState),
    /// Adds its background studies.
    add_studies: fn(&mut Studies) -> std::io::Result<()>,
    /// Whether it shows measured visits now.
    needs_visits: fn(&AppState) -> bool,
    /// Whether it shows regrets now.
    pub(crate) needs_regrets: fn(&AppState) -> bool,
    /// It shows how many primitives are below each node.
    pub(crate) needs_counts: bool,
}

impl View {
    /// A view without studies, visits, regrets and counts.
    const fn new(name: &'static str, purpose: &'static str, key: Key, ui: fn(&mut Ui, &mut AppState)) -> Self {
        Self {
            name,
            purpose,
            key,
            ui,
            add_studies: |_| Ok(()),
            needs_visits: |_| false,
            needs_regrets: |_| false,
            needs_counts: false,
        }
    }
}
