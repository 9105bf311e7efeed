//! Facts that many places need, each stated once: plain tables of structs with function pointers, from which flags, panels, tables, rows
//! and docs follow. Knows the engine, and neither egui nor clap.

pub mod settings;

pub mod terms;

pub mod reading;

pub mod numbers;

pub mod metric_scale;
pub mod metrics;

pub mod fields;

pub mod layouts;

pub mod values;

/// Equality of keys and names in constants, whose rows are found by them.
const fn is_same(a: &str, b: &str) -> bool {
    let (a, b, mut index) = (a.as_bytes(), b.as_bytes(), 0);
    while index < a.len() && index < b.len() && a[index] == b[index] {
        index += 1;
    }
    index == a.len() && index == b.len()
}
