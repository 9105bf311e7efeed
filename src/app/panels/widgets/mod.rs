//! Widgets that the panels share: sections, labelled rows, sliders with a default, drop-down lists, statistics, icons.

mod combo;
mod icon;
mod panel;
mod row;
mod section;
mod slider;
mod statistic;

pub(crate) use combo::combo;
pub(crate) use icon::{Icon, icon_button};
pub(crate) use panel::{panel_frame, scroll};
pub(crate) use row::{check, chip, row};
pub(crate) use section::{Header, section};
pub(crate) use slider::{SliderSpec, slider};
pub(crate) use statistic::{Statistic, statistic, value_text};
