//! Colour maps, and the conversion between linear light and sRGB.

mod color_map;

pub mod srgb;

pub use color_map::ColorMap;
