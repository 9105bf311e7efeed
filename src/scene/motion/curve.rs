//! Keys of an animated property, and its value between them (glTF 2.0, sections 3.11 and C).

use std::sync::Arc;

use glam::{DQuat, Vec4};

/// How a property passes from one key to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum Interpolation {
    /// The value of the last key, until the next.
    Step,
    /// Along the line between two values; along the shorter arc between two rotations.
    Linear,
    /// A cubic Hermite spline. Each key has three values: in-tangent, value and out-tangent, with tangents per second.
    Cubic,
}

impl Interpolation {
    /// Number of values of each key.
    pub(in crate::scene) fn values_per_key(self) -> usize {
        if self == Self::Cubic { 3 } else { 1 }
    }
}

/// The keys of an animated property. Before the first key and after the last it keeps their values.
#[derive(Debug, Clone)]
pub(in crate::scene) struct Curve {
    /// Times in seconds, ascending, at least one. Of equal ones the last counts from then on.
    times: Arc<[f32]>,
    /// `width` numbers of each value of each key; all finite.
    values: Vec<f32>,
    /// Numbers of a value, at least one.
    width: usize,
    interpolation: Interpolation,
}

impl Curve {
    /// The curve through `values`, whose number is that of `times` times the values of a key times `width`.
    pub(in crate::scene) fn new(
        times: Arc<[f32]>,
        values: Vec<f32>,
        width: usize,
        interpolation: Interpolation,
    ) -> Self {
        assert!(width > 0 && !times.is_empty() && times.is_sorted());
        assert_eq!(values.len(), times.len() * width * interpolation.values_per_key());
        Self { times, values, width, interpolation }
    }

    /// Times of the first and the last key in seconds.
    pub(in crate::scene) fn span(&self) -> [f32; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// Bytes in memory; times are shared between curves.
    pub(in crate::scene) fn bytes(&self) -> usize {
        size_of_val(&self.values[..])
    }

    /// Number of numbers of a value.
    pub(in crate::scene) fn width(&self) -> usize {
        self.width
    }

    /// The key that counts at `time`, the seconds to the next, and the part of them that has passed, 0 to 1.
    fn interval(&self, time: f32) -> (usize, f32, f32) {
        let after = self.times.partition_point(|&key| key <= time);
        let (Some(key), Some(&next)) = (after.checked_sub(1), self.times.get(after)) else {
            return (after.saturating_sub(1), 0.0, 0.0);
        };
        let length = next - self.times[key];
        (key, length, if self.interpolation == Interpolation::Step { 0.0 } else { (time - self.times[key]) / length })
    }

    /// Number `part` of the values of a key: of a spline 0 is the in-tangent, 1 the value, 2 the out-tangent.
    fn value(&self, key: usize, part: usize) -> &[f32] {
        let values_per_key = self.interpolation.values_per_key();
        &self.values[(key * values_per_key + part % values_per_key) * self.width..][..self.width]
    }

    /// Number `component` of the value at `time`, in seconds.
    pub(in crate::scene) fn component(&self, time: f32, component: usize) -> f32 {
        let (key, length, passed) = self.interval(time);
        if passed == 0.0 {
            return self.value(key, 1)[component];
        }
        let [from, to] = [key, key + 1].map(|key| self.value(key, 1)[component]);
        if self.interpolation == Interpolation::Linear {
            return from + (to - from) * passed;
        }
        let [leaving, arriving] =
            [self.value(key, 2)[component], self.value(key + 1, 0)[component]].map(|tangent| tangent * length);
        let (t, t2, t3) = (passed, passed * passed, passed * passed * passed);
        (2.0 * t3 - 3.0 * t2 + 1.0) * from
            + (t3 - 2.0 * t2 + t) * leaving
            + (3.0 * t2 - 2.0 * t3) * to
            + (t3 - t2) * arriving
    }

    /// The first three components of the value at `time`.
    pub(in crate::scene) fn vector(&self, time: f32) -> [f32; 3] {
        std::array::from_fn(|component| self.component(time, component))
    }

    /// The value at `time` as a rotation, of unit length.
    pub(in crate::scene) fn rotation(&self, time: f32) -> DQuat {
        if self.interpolation == Interpolation::Cubic {
            return unit(std::array::from_fn(|component| self.component(time, component)));
        }
        let (key, _, passed) = self.interval(time);
        let at = |key: usize| unit(Vec4::from_slice(self.value(key, 1)).to_array());
        if passed == 0.0 { at(key) } else { at(key).slerp(at(key + 1), passed.into()) }
    }
}

/// The rotation by a quaternion of any length; none if it has no direction.
fn unit(numbers: [f32; 4]) -> DQuat {
    let quaternion = DQuat::from_array(numbers.map(f64::from));
    let length = quaternion.length();
    if length > 0.0 && length.is_finite() { quaternion / length } else { DQuat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Interpolation::{Cubic, Linear, Step};

    fn curve(times: &[f32], values: &[f32], interpolation: Interpolation) -> Curve {
        let width = values.len() / times.len() / interpolation.values_per_key();
        Curve::new(times.into(), values.to_vec(), width, interpolation)
    }

    #[test]
    fn values_before_the_first_and_after_the_last_key_are_theirs() {
        for (interpolation, values) in
            [(Step, &[5.0, 7.0][..]), (Linear, &[5.0, 7.0]), (Cubic, &[9.0, 5.0, 9.0, 9.0, 7.0, 9.0])]
        {
            let curve = curve(&[1.0, 2.0], values, interpolation);
            let found = [-3.0, 0.0, 1.0, 2.0, 2.5, f32::INFINITY].map(|time| curve.component(time, 0));
            assert_eq!(found, [5.0, 5.0, 5.0, 7.0, 7.0, 7.0], "{interpolation:?}");
        }
        let single = curve(&[4.0], &[1.0, 2.0, 3.0], Linear);
        assert_eq!([0.0, 4.0, 9.0].map(|time| single.vector(time)), [[1.0, 2.0, 3.0]; 3]);
        assert_eq!(single.span(), [4.0, 4.0]);
    }

    #[test]
    fn steps_hold_and_lines_rise() {
        let at = |interpolation| curve(&[0.0, 4.0], &[10.0, 20.0], interpolation);
        assert_eq!([0.0, 3.9, 4.0].map(|time| at(Step).component(time, 0)), [10.0, 10.0, 20.0]);
        assert_eq!([0.0, 1.0, 2.0].map(|time| at(Linear).component(time, 0)), [10.0, 12.5, 15.0]);
    }

    #[test]
    fn of_equal_keys_the_last_counts_from_then_on() {
        let jump = curve(&[0.0, 1.0, 1.0, 2.0], &[0.0, 1.0, 5.0, 6.0], Linear);
        assert_eq!([0.5, 1.0, 1.5].map(|time| jump.component(time, 0)), [0.5, 5.0, 5.5]);
    }

    #[test]
    fn tangents_of_splines_are_per_second() {
        // Two seconds from 0 to 0, leaving with 1 a second and arriving with 0: (1/8 - 2/4 + 1/2) · 2 · 1 in the middle.
        let bump = curve(&[1.0, 3.0], &[9.0, 0.0, 1.0, 0.0, 0.0, 9.0], Cubic);
        assert_eq!(bump.component(2.0, 0), 0.25);
        // Arriving with 1 a second: (1/8 - 1/4) · 2.
        let dip = curve(&[1.0, 3.0], &[9.0, 0.0, 0.0, 1.0, 0.0, 9.0], Cubic);
        assert_eq!(dip.component(2.0, 0), -0.25);
        let half_way = curve(&[0.0, 2.0], &[0.0, 4.0, 0.0, 0.0, 8.0, 0.0], Cubic);
        assert_eq!(half_way.component(1.0, 0), 6.0);
    }

    #[test]
    fn rotations_take_the_shorter_arc_and_have_unit_length() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        // None, and a quarter turn about z by the quaternion of the opposite sign and three times the length.
        let turn = curve(&[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -3.0 * half, -3.0 * half], Linear);
        let angle = turn.rotation(0.5).to_scaled_axis().z.to_degrees();
        assert!((angle - 45.0).abs() < 1e-5, "{angle}");
        // The spline passes through half of the sum of both, whose length is not one.
        let spline = [0.0; 4].into_iter().chain([0.0, 0.0, 0.0, 1.0]).chain([0.0; 8]);
        let spline: Vec<f32> = spline.chain([0.0, 0.0, 1.0, 0.0]).chain([0.0; 4]).collect();
        let found = curve(&[0.0, 1.0], &spline, Cubic).rotation(0.5);
        assert!((found.length() - 1.0).abs() < 1e-12 && (found.z - f64::from(half)).abs() < 1e-6, "{found}");
        let nothing = curve(&[0.0], &[0.0; 4], Linear);
        assert_eq!(nothing.rotation(0.0), DQuat::IDENTITY);
    }
}
