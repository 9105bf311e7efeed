//! Measurements as aligned tables for people. Pure text: depends on neither files nor terminals.

mod aligned;
mod format;

mod advice;
mod copies;
mod depths;
mod difference;
mod findings;
mod forms;
mod layouts;
mod lists;
mod pairs;
mod policies;
mod predictions;
mod speedups;

mod formats;

mod by_command;
mod summary;

pub use advice::{advice_costs, advice_tables};
pub use aligned::ReportTable;
pub use by_command::{few_entering, tables};
pub use copies::{copy_tables, dearest_copies, mesh_costs};
pub use depths::depth_table;
pub use difference::difference_table;
pub(super) use format::conditions_and_threads;
pub use format::{name_among, number, short};
pub use formats::TableFormat;
pub use forms::{form_costs, form_tables};
pub use layouts::{layout_costs, layout_tables};
pub use summary::summary;
