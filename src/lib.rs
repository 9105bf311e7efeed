//! Builds, traces and shows bounding volume hierarchies made by agglomerative clustering.
//!
//! # Map of the code
//!
//! Modules in the order in which a newcomer should read them; each may import only what stands above it.

pub mod budget;

pub mod camera;

pub mod view;

pub mod scene;

pub mod accel;

pub mod render;

pub mod overlay;

pub mod lab;

pub mod export;

pub mod worker;

#[cfg(feature = "gui")]
pub mod app;

pub mod headless;

pub mod cli;
