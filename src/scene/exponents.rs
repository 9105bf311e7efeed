//! Exponents of Blinn-Phong highlights as roughness, as numbers and as textures.

/// Perceptual roughness of a Blinn-Phong exponent: the microfacet width α = √(2 / (n + 2)) of Walter et al. (*Microfacet Models
/// for Refraction through Rough Surfaces*, 2007) is the square of it.
pub(super) fn roughness(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
}

/// Turns the texels of a map of exponents, whose white is `exponent`, into those of a map of roughness, which is in the green
/// channel.
pub(super) fn to_roughness(texels: &mut [[u8; 4]], exponent: f32) {
    let byte = |red: usize| (roughness(exponent * red as f32 / 255.0) * 255.0).round() as u8;
    let roughness: [u8; 256] = std::array::from_fn(byte);
    for texel in texels {
        *texel = [roughness[usize::from(texel[0])]; 4];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn high_exponents_are_smooth() {
        // α = √(2/4) for 2, and √(2/1002) for 1000.
        assert!((roughness(0.0) - 1.0).abs() < 1e-6);
        assert!((roughness(2.0) - 0.840_896).abs() < 1e-5);
        assert!((roughness(1000.0) - 0.211_371).abs() < 1e-5);
        assert!((roughness(-5.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn white_is_the_exponent_of_the_material_and_black_is_rough() {
        let mut texels = [[255, 9, 9, 9], [0, 9, 9, 9], [51, 9, 9, 9]];
        to_roughness(&mut texels, 1000.0);
        // 0.211371 · 255 = 53.9; α² = 2/202 for a fifth of it, so 0.31544 · 255 = 80.4.
        assert_eq!(texels.map(|texel| texel[1]), [54, 255, 80]);
    }
}
