//! The windows in the window: command palette, start page, list of keys, message log.

mod frame;
pub(super) mod message_log;
pub(super) mod palette;
pub(super) mod shortcuts;
pub(super) mod start_page;
