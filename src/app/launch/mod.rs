//! How the window starts: options, settings of earlier runs, the graphics device, and what ends it.

pub mod interrupt;
pub mod options;
pub mod settings;

pub(crate) mod device;
pub(crate) mod run;
pub(crate) mod storage;
