//! Facts that many places need, each stated once: plain tables of structs with function pointers, from which flags, panels, tables, rows
//! and docs follow. Knows the engine, and neither egui nor clap.

pub mod settings;

pub mod terms;

pub mod reading;

pub mod numbers;

pub mod metric_scale;
pub mod metrics;

pub mod fields;

pub mod values;
