//! The selected triangles in the colour of the selection.

use rayon::prelude::*;

use crate::overlay::node::Role;
use crate::visibility::TriangleSet;

/// Share of the selection's colour in a tinted pixel.
const TINT: f32 = 0.4;

/// The pixels `rgba` with those tinted whose triangle, in `primitives`, is in `selected`.
pub fn tinted(rgba: &[[u8; 4]], primitives: &[u32], selected: &TriangleSet) -> Vec<[u8; 4]> {
    let tint = Role::Selected.color().unwrap_or_default();
    let pixel = |(&[r, g, b, a], &primitive): (&[u8; 4], &u32)| {
        if !selected.contains(primitive) {
            return [r, g, b, a];
        }
        let mix = |own: u8, tint: u8| (f32::from(own) * (1.0 - TINT) + f32::from(tint) * TINT).round() as u8;
        [mix(r, tint[0]), mix(g, tint[1]), mix(b, tint[2]), a]
    };
    rgba.par_iter().zip(primitives).with_min_len(1 << 14).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_selected_triangles_are_tinted() {
        let mut selected = TriangleSet::none(10);
        selected.insert(7);
        let pixels = tinted(&[[0, 0, 0, 255]; 3], &[7, 6, u32::MAX], &selected);
        assert_eq!(pixels, [[102, 72, 34, 255], [0, 0, 0, 255], [0, 0, 0, 255]]);
    }
}
