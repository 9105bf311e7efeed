//! Measuring jobs: pure functions from scenes and settings to [`Measurement`] rows, with tables, plots and diagnosis of them.
//!
//! Knows no window, no wgpu and no files; the command line and the window show the same rows. Start at [`Job`], then read
//! [`measure()`].

mod conditions;
mod measurement;
mod setup;
mod trial;

mod measure;

pub mod at_rest;

mod bench;
pub mod by_depth;
mod compare;
pub mod diff;
mod scaling;
pub mod speedup;
mod sweep;

mod job;

#[cfg(test)]
mod sample;

pub mod paper;

pub mod diagnose;
pub mod scaffold;
pub mod visit_scatter;

pub mod population;
pub mod prediction;

pub mod copy_advice;
pub mod copy_boxes;
pub mod copy_costs;
pub mod copy_forms;
pub mod cost_row;
pub mod icicle;
pub mod layouts;
pub mod merges;
mod mesh_changes;
mod mesh_pairs;
pub mod motion;
pub mod node_ranking;

pub mod plot;
pub mod ray;
pub mod ray_check;
pub mod report_table;
pub mod rows;
pub mod verdict;

pub use bench::bench;
pub use compare::{compare, compared_setups, settings_of_forms};
pub use conditions::{Conditions, ViewConditions};
pub use job::Job;
pub use measure::{LabError, RowSink, measure, measure_contenders};
pub use measurement::{Measurement, available_threads, file_and_builder, millis, pool};
pub use scaling::scaling;
pub use setup::{Contender, SceneForm, Setup, Subject, TraceView};
pub use sweep::{SweepPlan, SweepPoint, sweep};
pub use verdict::{Reading, Verdict};
