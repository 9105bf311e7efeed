#![no_main]

#[path = "../../tests/loading/entry_points.rs"]
mod entry_points;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry_points::ray_file(bytes));
