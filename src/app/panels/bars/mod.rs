//! The bars across the window: menu at the top, depth bar and job strip at the bottom.

pub(super) mod depth_bar;
pub(super) mod job_strip;
pub(super) mod menu;
