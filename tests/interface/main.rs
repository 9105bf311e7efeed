//! The window's contents driven by egui_kittest, without a display: panels, keys, mouse, background jobs.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod files;
mod first_minute;
mod harness;
mod headline;
mod panel;

mod app;
mod cuts;
mod interaction;
mod jobs;
mod panels;
mod shortcuts;
mod views;
