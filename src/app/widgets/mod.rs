//! Widgets that the panels share: sections, labelled rows, sliders with a default, drop-down lists, statistics, icons.

pub(crate) mod difference;
mod drop_down;
mod icon;
mod panel;
mod row;
mod slider;
mod statistic;
pub(crate) mod table;
mod tip;

pub(crate) use drop_down::{DropDown, explained, several};
pub(crate) use icon::{Icon, icon_button};
pub(crate) use panel::{Header, empty_view, more, panel_frame, restore_sections, scroll, section, sections};
pub(crate) use row::{check, chip, note_place, place_of, row};
pub(crate) use slider::{SliderSpec, slider};
pub(crate) use statistic::{Statistic, copies, statistic, tip_with_hint, value_text};
pub(crate) use tip::{Tip, hush, note_front, note_panel};
