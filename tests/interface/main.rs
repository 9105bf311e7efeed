//! The window's contents driven by egui_kittest, without a display: panels, keys, mouse, background jobs.

#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod harness;
mod panel;

mod app;
mod interaction;
mod jobs;
mod panels;
mod shortcuts;
mod views;
