//! The diverging colour map of differences.

/// Colours of −1, −0.5, 0, 0.5 and 1 in sRGB: blue over neutral grey to orange. Blue and orange differ for every kind of colour
/// vision, and luminance rises from one end to the other, so that signs differ in a grey print too.
const STOPS: [[u8; 3]; 5] =
    [[0x08, 0x30, 0x6b], [0x2b, 0x6c, 0xb0], [0x8a, 0x8a, 0x8a], [0xe9, 0x9a, 0x3c], [0xff, 0xd0, 0x7a]];

/// The sRGB colour of a difference from −1 to 1; values beyond are clamped, NaN is 0.
pub fn diverging(value: f32) -> [u8; 3] {
    let value = if value.is_nan() { 0.0 } else { value.clamp(-1.0, 1.0) };
    let place = (value + 1.0) * 0.5 * (STOPS.len() - 1) as f32;
    let index = (place as usize).min(STOPS.len() - 2);
    let (low, high, part) = (STOPS[index], STOPS[index + 1], place - index as f32);
    std::array::from_fn(|channel| {
        let [low, high] = [low[channel], high[channel]].map(f32::from);
        (low + (high - low) * part).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of an sRGB colour (WCAG 2).
    fn luminance(color: [u8; 3]) -> f32 {
        let linear = color.map(|byte| {
            let x = f32::from(byte) / 255.0;
            if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn luminance_rises_from_the_lowest_to_the_highest() {
        let luminances: Vec<f32> = (-50_i8..=50).map(|step| luminance(diverging(f32::from(step) / 50.0))).collect();
        for (step, pair) in luminances.windows(2).enumerate() {
            assert!(pair[0] < pair[1], "step {step}: {} then {}", pair[0], pair[1]);
        }
        let [low, middle, high] = [luminances[0], luminances[50], luminances[100]];
        assert!(low * 4.0 < middle && middle * 2.0 < high, "{low} {middle} {high}");
    }

    #[test]
    fn zero_is_neutral_and_values_beyond_are_clamped() {
        let [r, g, b] = diverging(0.0);
        assert!(r == g && g == b, "{r} {g} {b}");
        assert_eq!(diverging(f32::NAN), [r, g, b]);
        assert_eq!([-9.0, -1.0, 1.0, f32::INFINITY].map(diverging), [STOPS[0], STOPS[0], STOPS[4], STOPS[4]]);
        let ([low, _, low_blue], [high, _, high_blue]) = (diverging(-0.5), diverging(0.5));
        assert!(low_blue > low && high > high_blue, "blue below, orange above");
    }
}
