//! The views of the dock, a folder each: its state, what it shows and what it derives. `VIEWS` is the only list of them.

mod axes;
pub(crate) mod parts;

pub mod copies;
pub mod icicle;
mod layouts;
mod merges;
pub mod motion;
pub mod nodes;
mod paper;
pub mod plots;
mod ray;

use std::path::PathBuf;
use std::sync::Arc;

use egui::{Key, Ui};

use crate::accel::Accel;
use crate::app::state::ray_file::ReadRays;
use crate::app::state::{AppState, ViewState, ViewStates};
use crate::app::studies::{Studies, StudyPlan};
use crate::catalog::metrics::Source;
use crate::lab::population::ViewRays;

/// The views, in the order of their tabs.
pub(crate) static VIEWS: [Tab; 9] = [
    Tab::of::<merges::MergesView>(),
    Tab::of::<icicle::IcicleView>(),
    Tab::of::<ray::RayView>(),
    Tab::of::<nodes::NodesView>(),
    Tab::of::<plots::PlotsView>(),
    Tab::of::<paper::PaperView>(),
    Tab::of::<motion::MotionView>(),
    Tab::of::<layouts::LayoutsView>(),
    Tab::of::<copies::CopiesView>(),
];

/// A view of the dock. Its state holds what the user chose in it and what it derived.
pub(crate) trait View: ViewState {
    /// Its purpose in one sentence.
    const PURPOSE: &'static str;
    /// The key that opens and closes it.
    const KEY: Key;

    /// Shows it. Meanwhile the state has a view of this type that is as at the start.
    fn ui(&mut self, ui: &mut Ui, state: &mut AppState);

    /// The shared derived data that it shows now.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// Goes on with what plays in it while it is open. Called before the panels, which then all show the same.
    fn play(_: &Ui, _: &mut AppState) {}

    /// Adds its background studies.
    fn add_studies(_: &mut Studies) -> std::io::Result<()> {
        Ok(())
    }
}

/// Shared derived data that a view shows now.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Needs {
    /// Measured visits of each node.
    pub(crate) visits: bool,
    /// Savings from rebuilding each subtree.
    pub(crate) regrets: bool,
    /// Numbers of primitives below each node.
    pub(crate) counts: bool,
}

/// A view as the window sees it.
pub(crate) struct Tab {
    /// The name on its tab, by which saved settings and shared states name it too.
    pub(crate) name: &'static str,
    /// Its purpose in one sentence.
    pub(crate) purpose: &'static str,
    /// The key that opens and closes it.
    pub(crate) key: Key,
    /// Shows it.
    pub(crate) ui: fn(&mut Ui, &mut AppState),
    needs: fn(&AppState) -> Needs,
    play: fn(&Ui, &mut AppState),
    add_state: fn(&mut ViewStates),
    add_studies: fn(&mut Studies) -> std::io::Result<()>,
    #[cfg(test)]
    add_changed: fn(&mut ViewStates),
}

impl Tab {
    const fn of<V: View>() -> Self {
        Self {
            name: V::NAME,
            purpose: V::PURPOSE,
            key: V::KEY,
            ui: |ui, state| {
                let mut view = std::mem::take(state.views.get_mut::<V>());
                view.ui(ui, state);
                *state.views.get_mut() = view;
            },
            needs: |state| state.views.get::<V>().needs(),
            play: V::play,
            add_state: |states| states.add(V::default()),
            add_studies: V::add_studies,
            #[cfg(test)]
            add_changed: |states| states.add(V::changed()),
        }
    }
}

/// The names of all views, in the order of their tabs.
pub fn names() -> impl Iterator<Item = &'static str> {
    VIEWS.iter().map(|view| view.name)
}

/// The states of all views at the start.
pub fn states() -> ViewStates {
    let mut states = ViewStates::default();
    for view in &VIEWS {
        (view.add_state)(&mut states);
    }
    states
}

/// The open view.
pub(crate) fn open_view(state: &AppState) -> Option<&'static Tab> {
    VIEWS.iter().find(|view| state.preferences.dock.shows(view.name))
}

/// The shared derived data that the open view shows.
pub(crate) fn needs(state: &AppState) -> Needs {
    open_view(state).map_or_else(Needs::default, |view| (view.needs)(state))
}

/// Goes on with what plays in the open view.
pub(crate) fn play(ui: &Ui, state: &mut AppState) {
    if let Some(view) = open_view(state) {
        (view.play)(ui, state);
    }
}

/// Adds the background studies of all views.
pub(crate) fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
    add_ray_file(studies)?;
    add_visits(studies)?;
    add_regrets(studies)?;
    VIEWS.iter().try_for_each(|view| (view.add_studies)(studies))
}

/// The tree of which the open view, or else the colours of containers, show derived data.
fn tree_with(state: &AppState, is_needed: fn(Needs) -> bool, source: Source) -> Option<Arc<Accel>> {
    let view = open_view(state).filter(|view| is_needed((view.needs)(state)));
    let of_view = view.and_then(|view| state.tree_of_view(view.name));
    of_view.or_else(|| state.presented_tree().filter(|_| state.colors_from(source)))
}

/// Adds the study of measured visits, by the rays of the view, which several views and the colours of containers need.
fn add_visits(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "visits",
        "Measuring visits",
        |state| &mut state.model.derived.visits,
        |state, idle| {
            let of_layout = || state.presented_tree().filter(|_| state.model.layout.is_by_visits());
            let accel = tree_with(state, |needs| needs.visits, Source::Visits).or_else(of_layout)?;
            // Not before the picture has come to rest.
            if state.model.derived.rays(&accel.scene).is_none() && idle {
                let present = state.view_rays();
                state.model.derived.measure_by(&accel.scene, present);
            }
            let rays = state.model.derived.rays(&accel.scene)?;
            Some((accel, rays))
        },
    );
    studies.add(plan, |accel, rays: &ViewRays, token| rays.measure(accel, token))
}

/// The rays of the wanted file.
fn add_ray_file(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "rays",
        "Reading rays",
        |state| &mut state.model.derived.ray_file.study,
        |state, _| state.follow_ray_file(),
    );
    studies.add(plan, |accel, (path, _): &(PathBuf, u32), token| ReadRays::read(accel, path, token))
}

/// Regrets, for the open view or for the colours of containers.
fn add_regrets(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "regrets",
        "Rebuilding subtrees",
        |state| &mut state.model.derived.regrets,
        |state, _| Some((tree_with(state, |needs| needs.regrets, Source::Regrets)?, ())),
    );
    studies.add(plan, |accel, (), token| accel.compute_regrets(token).map(|_| ()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn every_control_of_every_view_is_shared_and_shown() {
        let mut changed = ViewStates::default();
        for view in &VIEWS {
            (view.add_changed)(&mut changed);
        }
        assert_eq!(changed.unchanged(), [""; 0], "not changed by this test");
        let shared = changed.shared(None);
        let mut other = states();
        other.show_shared(shared.clone()).unwrap();
        assert_eq!(other.shared(None), shared);
        other.show_shared(states().shared(None)).unwrap();
        assert!(other.shared(None).is_empty(), "back at the start");
    }
}
