//! From linear radiance to what a screen can show: the Khronos PBR Neutral tone mapper.

use glam::Vec3;

/// Radiance above which highlights are compressed.
const START_COMPRESSION: f32 = 0.8 - F90_OFFSET;
/// Reflectance of a dielectric on top of its base colour, which the tone mapper subtracts again.
const F90_OFFSET: f32 = 0.04;
/// Speed with which compressed colours lose their saturation.
const DESATURATION: f32 = 0.15;

/// Khronos PBR Neutral (Khronos 3D Commerce, *Khronos PBR Neutral Tone Mapper*, 2024, and its reference `pbrNeutral.glsl`):
/// base colours up to 0.8 are shown as they are, brighter ones are compressed below 1 and turn white. Takes and returns linear
/// RGB.
pub(super) fn tone_map(color: Vec3) -> Vec3 {
    let least = color.min_element();
    let offset = if least < 2.0 * F90_OFFSET { least - 6.25 * least * least } else { F90_OFFSET };
    let color = color - offset;
    let peak = color.max_element();
    if peak < START_COMPRESSION {
        return color;
    }
    let room = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - room * room / (peak + room - START_COMPRESSION);
    let whitening = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), whitening)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked out with pencil and paper from the published formula.
    #[test]
    fn colors_are_those_of_the_published_formula() {
        for (color, expected) in [
            (Vec3::ZERO, Vec3::ZERO),
            // 6.25 · 0.04² = 0.01 remains of a dark grey.
            (Vec3::splat(0.04), Vec3::splat(0.01)),
            (Vec3::splat(0.08), Vec3::splat(0.04)),
            // Below the compression 0.04 is subtracted from all channels.
            (Vec3::new(0.5, 0.3, 0.1), Vec3::new(0.46, 0.26, 0.06)),
            (Vec3::new(0.5, 0.3, 0.0), Vec3::new(0.5, 0.3, 0.0)),
            // A peak of 1 is compressed to 1 - 0.24² / 0.48 = 0.88.
            (Vec3::splat(1.04), Vec3::splat(0.88)),
            // Red 2 and nothing else: the peak becomes 1 - 0.0576 / 1.48 = 0.961081, of which
            // 1 - 1 / (0.15 · 1.038919 + 1) = 0.134827 is white.
            (Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.961_081, 0.129_580, 0.129_580)),
        ] {
            let found = tone_map(color);
            assert!((found - expected).abs().max_element() < 2e-6, "{color} became {found} instead of {expected}");
        }
    }

    #[test]
    fn greys_keep_their_order_and_stay_below_white() {
        let steps: Vec<f32> = (0..2_000).map(|step| tone_map(Vec3::splat(step as f32 * 0.01)).x).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < 1.0));
        assert!(!tone_map(Vec3::NAN).is_finite());
    }
}
