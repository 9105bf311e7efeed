//! Bump maps: heights become normals when an image is decoded, so that shading needs normal maps only.

use glam::Vec3;

use bvhscope_engine::cancel::CancelToken;

/// Height of white over black as a fraction of the texture's width on the surface: formats leave the unit open, and a hundredth
/// makes mortar joints and cloth look as deep as they are, whatever the resolution of the image.
const HEIGHT: f32 = 0.01;
/// Number of texels by which a normal map is recognised.
const PROBES: usize = 4096;
/// Fraction of these that must be unit vectors away from the surface.
const UNIT_VECTORS: f32 = 0.9;

/// The normals of a bump map, as the texels of a normal map: by central differences of its heights; unchanged if the image is a
/// normal map already. `None` once cancelled.
pub(super) fn normals([width, height]: [u32; 2], texels: Vec<[u8; 4]>, token: &CancelToken) -> Option<Vec<[u8; 4]>> {
    if is_normal_map(&texels) {
        return Some(texels);
    }
    let (columns, rows) = (width as usize, height as usize);
    let at = |x: usize, y: usize| texels.get(y % rows * columns + x % columns).map_or(0.0, |&texel| luminance(texel));
    let mut normals = Vec::with_capacity(texels.len());
    for y in 0..rows {
        if token.is_cancelled() {
            return None;
        }
        for x in 0..columns {
            let along_u = (at(x + 1, y) - at(x + columns - 1, y)) * 0.5 * width as f32;
            let along_v = (at(x, y + 1) - at(x, y + rows - 1)) * 0.5 * height as f32;
            // y of tangent space points against v.
            let normal = Vec3::new(-HEIGHT * along_u, HEIGHT * along_v, 1.0).normalize();
            let [r, g, b] = (normal * 127.5 + 128.0).to_array().map(|x| x as u8);
            normals.push([r, g, b, 255]);
        }
    }
    Some(normals)
}

fn luminance([r, g, b, _]: [u8; 4]) -> f32 {
    (0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)) / 255.0
}

/// Whether texels are unit vectors, and not grey.
fn is_normal_map(texels: &[[u8; 4]]) -> bool {
    let probes = || texels.iter().step_by(texels.len().div_ceil(PROBES).max(1));
    let is_vector = |&&[r, g, b, _]: &&[u8; 4]| {
        let vector = Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 127.5 - 1.0;
        (vector.length() - 1.0).abs() < 0.15 && vector.z > 0.2
    };
    probes().filter(is_vector).count() as f32 >= UNIT_VECTORS * probes().count() as f32
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn made(size: [u32; 2], texels: Vec<[u8; 4]>) -> Vec<[u8; 4]> {
        normals(size, texels, &CancelToken::new()).unwrap()
    }

    #[test]
    fn a_ridge_faces_both_ways_and_a_plane_none() {
        let grey = |byte: u8| [byte, byte, byte, 255];
        assert_eq!(made([4, 2], vec![grey(77); 8]), vec![[128, 128, 255, 255]; 8]);
        // Dark, bright, dark, dark: the second texel is the ridge.
        let normals = made([4, 1], [0, 255, 0, 0].map(grey).to_vec());
        // 1 over two of four texels, so 2 for each unit of u: a slope of 0.02.
        let tilt = (0.02_f32 / 1.0004_f32.sqrt() * 127.5) as u8;
        assert_eq!(normals.iter().map(|normal| normal[0]).collect::<Vec<_>>(), [128 - tilt - 1, 128, 128 + tilt, 128]);
        assert!(normals.iter().all(|normal| normal[1] == 128));
        // Brighter further down: the surface faces up, against v.
        let normals = made([1, 4], [0, 100, 200, 100].map(grey).to_vec());
        assert!(normals[1][1] > 128 && normals[3][1] < 128, "{normals:?}");
    }

    #[test]
    fn normal_maps_stay_as_they_are() {
        let texels = vec![[128, 128, 255, 255], [200, 128, 230, 255], [128, 60, 235, 255], [140, 140, 254, 255]];
        assert_eq!(made([2, 2], texels.clone()), texels);
        let token = CancelToken::new();
        token.cancel();
        assert_eq!(normals([2, 2], vec![[9; 4]; 4], &token), None);
    }
}
