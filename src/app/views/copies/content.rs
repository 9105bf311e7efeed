//! The content of a section of the view: what it measures by the rays of the view, and how it shows that.

use std::sync::Arc;

use egui::Ui;

use crate::accel::Accel;
use crate::app::state::{AppState, Presented};
use crate::lab::LabError;
use crate::lab::population::ViewRays;
use bvhscope_engine::cancel::CancelToken;

/// A measurement that is the content of a section.
pub(super) trait Content: Sized + Send + Sync + 'static {
    /// Name of its thread.
    const THREAD: &'static str;
    /// Label of its job.
    const LABEL: &'static str;

    /// Measures by `rays`.
    fn measure(accel: &Arc<Accel>, rays: &ViewRays, token: &CancelToken) -> Result<Self, LabError>;

    /// Number of rays that it was measured by.
    fn rays(&self) -> u64;

    /// The buttons at the right end of the bar, for what is `known`.
    fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&Self>);

    /// Shows it. A list of copies keeps in `revealed` the one to which it was scrolled last.
    fn show(&self, ui: &mut Ui, state: &mut AppState, shown: &Presented, revealed: &mut Option<u32>);
}
