//! How the window starts and ends, and the work behind it: threads that load, build, trace and measure, and what they exchange
//! with the state.
//!
//! [`reconcile`] holds the rails from a model to a picture: load, build, a second build, render. Each holds the latest request
//! to its worker ([`Latest`](crate::app::studies::latest::Latest)), which does not request again what failed or was cancelled;
//! so does measuring.

pub mod options;
pub mod settings;

pub mod app;
pub mod run;

mod files;
pub mod storage;

pub(crate) mod reconcile;

mod build_rail;
mod load_rail;
mod render_rail;
mod second_rail;

mod build_job;
mod render_job;

mod frame_pacing;
mod present;
mod quick_drags;

pub(crate) mod derived_worker;
pub(crate) mod measure_worker;

pub(crate) mod file_watch;
pub(crate) mod requests;
pub mod system;
pub(crate) mod thumbnails;
pub(crate) mod wake_signal;
