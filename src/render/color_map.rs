//! Perceptual colour maps.

use serde::{Deserialize, Serialize};

/// From a number between 0 and 1 to a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColorMap {
    /// Blue to yellow, uniform in perceived lightness.
    Viridis,
    /// Black to white through red.
    Inferno,
    /// A rainbow that keeps its order.
    Turbo,
}

impl ColorMap {
    /// All maps, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Viridis, Self::Inferno, Self::Turbo];

    /// The name in the window and on the command line (lower case).
    pub const fn label(self) -> &'static str {
        match self {
            Self::Viridis => "Viridis",
            Self::Inferno => "Inferno",
            Self::Turbo => "Turbo",
        }
    }

    /// The colour at `value`, clamped to 0..1, as sRGB bytes.
    pub fn srgb(self, _value: f32) -> [u8; 3] {
        todo!("render")
    }
}
