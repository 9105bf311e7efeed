//! The window's contents driven by egui_kittest, without a display: panels, keys, mouse, background jobs.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod files;
mod find;
mod first_minute;
mod harness;
mod headline;
mod hidden_nodes;
mod panel;
mod recorded_screen;

mod app;
mod copies_view;
mod cut_controls;
mod dock;
mod interaction;
mod jobs;
mod layouts_view;
mod merges_view;
mod motion;
mod nodes_view;
mod opened_rays;
mod opened_trees;
mod panels;
mod plots;
mod ray_view;
mod scene_of_copies;
mod shared_state;
mod shortcuts;
mod two_trees;
mod views;
