//! Conversion between linear light and sRGB (IEC 61966-2-1).

use std::sync::LazyLock;

use glam::Vec3;

/// Entries of the encoding table: fine enough to be at most one byte off at the dark end.
const STEPS: usize = 1 << 14;

static ENCODE: LazyLock<Vec<u8>> =
    LazyLock::new(|| (0..=STEPS).map(|step| (encode_exact(step as f32 / STEPS as f32) * 255.0 + 0.5) as u8).collect());

/// Encodes a linear component, 0 to 1, as sRGB, 0 to 1.
fn encode_exact(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an sRGB component, 0 to 1, to linear light.
pub fn decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes linear light as opaque sRGB bytes, clamped; NaN becomes black.
#[derive(Clone, Copy)]
pub struct Encoder {
    table: &'static [u8],
}

impl Default for Encoder {
    fn default() -> Self {
        Self { table: &ENCODE }
    }
}

impl Encoder {
    /// Linear red, green and blue, 0 to 1, as opaque sRGB.
    pub fn rgba(self, linear: Vec3) -> [u8; 4] {
        // `as` saturates and converts NaN to 0.
        let byte = |x: f32| self.table[((x * STEPS as f32 + 0.5) as usize).min(STEPS)];
        [byte(linear.x), byte(linear.y), byte(linear.z), 255]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        let encoder = Encoder::default();
        for byte in 0..=255_u8 {
            let linear = decode(f32::from(byte) / 255.0);
            assert_eq!(encoder.rgba(Vec3::splat(linear))[0], byte);
        }
    }

    #[test]
    fn what_bytes_cannot_show_is_clamped() {
        let encoder = Encoder::default();
        assert_eq!(encoder.rgba(Vec3::new(-1.0, 2.0, f32::NAN)), [0, 255, 0, 255]);
        assert_eq!(encoder.rgba(Vec3::INFINITY), [255; 4]);
    }
}
