//! Rules that the source text must follow. This program links neither the library nor the engine.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../support/skip.rs"]
mod skip;

mod file_names;
mod layering;
mod maps;
mod profiles;
mod reliability;
mod skips;
mod tables;
mod texts;
mod words;
