//! How the exposure of a picture follows that of the one before it.

use glam::Vec3;

use super::settings::Exposure;

/// Largest difference in stops, and in openness, between two pictures that nobody notices.
const UNNOTICED: [f32; 2] = [0.02, 0.01];

/// Measurements of the light meter in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metered {
    /// Exposure in stops.
    pub stops: f32,
    /// Light of the sky that arrives at the surfaces in view as a fraction of an open sky: red, green and blue.
    pub openness: Vec3,
}

impl Metered {
    /// Of a view in which nothing takes light.
    pub(super) const NOTHING: Self = Self { stops: 0.0, openness: Vec3::ONE };
}

/// How a picture follows one of another view before it, as an eye that gets used to the light, so that neither its brightness nor
/// its shadows flicker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptation {
    /// Values of the previous picture.
    pub from: Metered,
    /// How far it goes from there to what is measured in its own view, 0 to 1.
    pub fraction: f32,
}

impl Adaptation {
    /// Values for a picture in whose view `metered` was measured; true if they have reached `metered`.
    pub(super) fn towards(&self, metered: Metered, exposure: Exposure) -> (Metered, bool) {
        let Self { from, fraction } = *self;
        let follow = |from: f32, to: f32| from + (to - from) * fraction;
        let stops = match exposure {
            Exposure::Auto => follow(from.stops, metered.stops),
            Exposure::Fixed(stops) => stops,
        };
        let shown = Metered { stops, openness: from.openness.lerp(metered.openness, fraction) };
        let near = (shown.stops - metered.stops).abs() <= UNNOTICED[0]
            && (shown.openness - metered.openness).abs().max_element() <= UNNOTICED[1];
        (shown, near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_get_used_to_the_light() {
        let metered = |stops: f32, openness: f32| Metered { stops, openness: Vec3::splat(openness) };
        let (bright, dark) = (metered(-1.0, 0.8), metered(3.0, 0.2));
        let quarter = Adaptation { from: bright, fraction: 0.25 };
        let (shown, near) = quarter.towards(dark, Exposure::Auto);
        assert!((shown.stops, near) == (0.0, false) && (shown.openness.y - 0.65).abs() < 1e-6, "{shown:?}");
        assert_eq!(quarter.towards(dark, Exposure::Fixed(0.5)).0.stops, 0.5, "what is set is shown at once");
        assert!(Adaptation { from: bright, fraction: 1.0 }.towards(dark, Exposure::Auto).1);
        let (mut shown, mut steps) = ((bright, false), 0);
        while !shown.1 {
            shown = Adaptation { from: shown.0, fraction: 0.25 }.towards(dark, Exposure::Auto);
            steps += 1;
        }
        // 0.75ⁿ of 4 stops are at most 0.02 from the 19th step on.
        assert_eq!(steps, 19);
    }
}
