//! How the window starts and ends: options, saved settings, the graphics device, and the application that eframe runs.

mod lessons;
pub mod options;
pub mod settings;

pub mod app;
pub mod run;

pub mod interrupt;

mod device;
mod files;
pub mod storage;
mod window_size;
