//! Facts that many places need, each once, as plain tables of structs. Knows the engine only: no egui, no flags.

pub mod settings;
