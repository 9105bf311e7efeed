//! The windows in the window: command palette, start page, help, message log, about.

pub(super) mod about;
mod frame;
pub(super) mod help;
pub(super) mod message_log;
pub(super) mod palette;
mod path_field;
pub(super) mod start_page;
mod thumbnail;
