//! bvhscope opens a 3D model, ray traces it on the CPU through a bounding volume hierarchy (BVH) built by approximate
//! agglomerative clustering (AAC), and shows the tree.
//!
//! This package is the viewer and its commands. The engine (geometry, trees, builders, traversal) is a crate of its own,
//! [`bvhscope_engine`]: triangles in, tree and hits out; it depends on nothing here.
//!
//! # Map of the code
//!
//! Modules from the bottom up, in the order in which a newcomer should read them. Each may import the engine and the
//! modules above it in this table, none below (`tests/source` checks that).
//!
//! | module | what it does | must not know | start reading at |
//! | --- | --- | --- | --- |
//! | [`text`] | names from outside as messages show them | everything else | [`text::printable`] |
//! | [`vectors`] | lengths and directions of vectors of any size | everything else | [`vectors::length`] |
//! | [`colors`] | colour maps, linear light and sRGB | everything else | [`colors::ColorMap`] |
//! | [`catalog`] | what many places need, one row each: settings, numbers of a tree, metrics of a node, terms | egui, clap, files | [`catalog::numbers`] |
//! | [`console`] | standard streams that may be full, closed, slow or without a reader | everything else | [`console::note`] |
//! | [`threads`] | how many threads the program works with, and pools of them | everything else | [`threads::count`] |
//! | [`provenance`] | machine, day and version of a measurement | everything else but [`threads`] | [`provenance::machine`] |
//! | [`budget`] | memory limit of the process, checked before large allocations | everything else | [`budget::Budget`] |
//! | [`export`] | atomic writing of files | file formats | [`export::write_file`] |
//! | [`worker`] | a background thread of which only the latest request counts | what the work is | [`worker::Worker`] |
//! | [`camera`], [`view`] | primary rays, the matching matrix, named views | scenes, trees | [`camera::Camera`] |
//! | [`scene`] | model files and built-in models into triangles and materials | trees, cameras, pixels | [`scene::load()`] |
//! | [`ray_file`] | files of rays, read in chunks and written | trees, pixels | [`ray_file::RayReader`] |
//! | [`section`] | the plane that cuts picture and overlay open | everything else | [`section::SectionPlane`] |
//! | [`accel`] | a scene's tree and wide tree with their build report | pixels, windows | [`accel::Accel::build`] |
//! | [`visibility`] | hidden nodes of a tree and the triangles hidden with them | pixels | [`visibility::TriangleSet`] |
//! | [`render`] | tiles, shading modes, colour maps: a tree and a camera into a frame | egui, wgpu, the overlay | [`render::render`] |
//! | [`overlay`] | nodes into wireframe instances and the wgpu pass that draws them | `render`, egui's widgets | [`overlay::NodeTable`] |
//! | [`lab`] | measuring jobs, tables, plots, diagnosis | egui, wgpu, files | [`lab::Job`] |
//! | [`legend`] | what the colours of a saved picture stand for, drawn below it | egui, wgpu, files | [`legend::of_picture`] |
//! | `app` | the window: the only place that owns threads and egui | command line flags | `app::run` |
//! | [`headless`] | the commands that need no window | command line flags | [`headless::render::run`] |
//! | [`cli`] | command line flags into resolved settings; dispatch and exit codes | how anything is done | [`cli::main`] |
//!
//! # From a model to a picture
//!
//! ```
//! use std::sync::Arc;
//!
//! use bvhscope::accel::Accel;
//! use bvhscope::camera::Camera;
//! use bvhscope::scene::{LoadOptions, SceneSource, load};
//! use bvhscope_engine::cancel::CancelToken;
//! use bvhscope_engine::settings::{BuildSettings, Preset};
//! use bvhscope_engine::tree::ContainerKind;
//!
//! let token = CancelToken::new();
//! let source = SceneSource::parse("builtin:cornell".as_ref())?;
//! let scene = Arc::new(load(&source, &LoadOptions::default(), &token)?);
//! let settings = BuildSettings::preset(Preset::Fast, ContainerKind::Aabb);
//! let accel = Accel::build(&scene, &settings, &token)?;
//! let camera = Camera::framing(&scene.bounds, scene.up);
//! let ray = camera.for_size(640, 480).ray(320.0, 240.0);
//! let hit = accel.closest_hit(&ray).expect("the camera looks into the box");
//! assert!(hit.t > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Both panic where the stream is full or closed: `console::note` and `console::Output` do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

pub mod text;

pub mod vectors;

pub mod colors;

pub mod catalog;

pub mod console;

pub mod threads;

pub mod provenance;

pub mod budget;

pub mod export;

pub mod worker;

pub mod camera;

pub mod view;

pub mod scene;

pub mod ray_file;

pub mod section;

pub mod accel;

pub mod visibility;

pub mod render;

pub mod overlay;

pub mod lab;

pub mod legend;

#[cfg(feature = "gui")]
pub mod app;

pub mod headless;

pub mod cli;

#[cfg(test)]
#[path = "../tests/support/skip.rs"]
#[allow(dead_code, reason = "integration tests use the rest")]
mod skip;
