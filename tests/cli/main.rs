//! The commands, run as processes: flags, exit codes, output, files, signals.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../support/mod.rs"]
mod support;

mod animate;
#[cfg(all(target_os = "linux", feature = "gui"))]
mod bookmarks;
mod cameras;
mod commands;
mod coordinates;
mod copies_command;
mod diff;
mod documented_counts;
mod golden;
mod in_folder;
#[cfg(unix)]
mod interrupting;
mod layouts_command;
#[cfg(feature = "gui")]
mod merges;
mod moments;
#[cfg(unix)]
mod overwriting;
mod populations;
mod ray_files;
mod rays;
mod rows;
mod scaling;
#[cfg(target_os = "linux")]
mod streams;
#[cfg(target_os = "linux")]
mod threads;
#[cfg(unix)]
mod tree_check;
#[cfg(unix)]
mod tree_clients;
mod tree_files;
mod tree_levels;
#[cfg(unix)]
mod tree_writers;
