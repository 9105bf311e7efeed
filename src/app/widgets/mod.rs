//! Widgets that the panels share: sections, labelled rows, sliders with a default, drop-down lists, statistics, icons.

mod combo;
pub(crate) mod difference;
mod empty_view;
mod icon;
mod panel;
mod row;
mod section;
mod slider;
mod statistic;
mod tip;

pub(crate) use combo::{combo, explained_combo, plain_drop_down};
pub(crate) use empty_view::empty_view;
pub(crate) use icon::{Icon, icon_button};
pub(crate) use panel::{panel_frame, scroll};
pub(crate) use row::{check, chip, note_place, place_of, row};
pub(crate) use section::{Header, more, restore_sections, section, sections};
pub(crate) use slider::{SliderSpec, slider};
pub(crate) use statistic::{Statistic, copies, statistic, tip_with_hint, value_text};
pub(crate) use tip::{Tip, note_panel};
