//! The offset of models far from the origin, whose coordinates lose their decimals in single precision.
//!
//! A reader of double-precision coordinates bounds the corners of all triangles with an [`Extent`], subtracts its
//! [`Extent::offset`] from each before rounding, and stores it in [`Assembly::offset`](super::assemble::Assembly::offset).

use glam::{DVec3, Vec3};

pub(crate) use bvhscope_engine::geometry::Extent;

/// Largest absolute coordinate; beyond it squared distances overflow, so such triangles are skipped.
pub(super) const MAX_COORDINATE: f32 = 1e18;

/// A point of the scene in the coordinates of its file, of which those of the scene are less by `offset`; with no more decimals than
/// single precision has.
pub fn to_file(point: Vec3, offset: DVec3) -> DVec3 {
    let decimal = |number: f32| number.to_string().parse().unwrap_or(f64::from(number));
    DVec3::from_array(point.to_array().map(decimal)) + offset
}

/// A point of the file in the coordinates of the scene; the inverse of [`to_file`].
pub fn from_file(point: DVec3, offset: DVec3) -> Vec3 {
    moved(point, offset).as_vec3()
}

/// A point less the offset of the model.
pub(super) fn moved(point: DVec3, offset: DVec3) -> DVec3 {
    point - offset
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_the_file_have_its_decimals_and_come_back() {
        let offset = DVec3::new(408_204.0, 4_080_928.0, 0.0);
        let point = Vec3::new(-2.42, 0.1, 1e-7);
        assert_eq!(to_file(point, offset), DVec3::new(408_201.58, 4_080_928.1, 1e-7));
        assert_eq!(from_file(to_file(point, offset), offset), point);
    }
}
