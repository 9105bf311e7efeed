//! A material as tobj reads it from a library, made one of this renderer: highlights become reflectance and roughness.

use glam::Vec3;

use super::super::error::{FileLocation, Warnings};
use super::super::exponents::roughness;
use super::super::images::{Content, Images, TextureUse};
use super::super::material::Material;
use super::library_values::{TextureName, texture_name};

/// Exponent of white in a `map_Ns` without Ns.
const DEFAULT_EXPONENT: f32 = 100.0;

/// Kd up to which a material with highlights is a metal.
const MAX_METAL_DIFFUSE: f32 = 0.01;

/// Reflectance at normal incidence for Ks: 0.5 is that of common dielectrics, 0.04, as Disney's *specular* has it (Burley,
/// *Physically-Based Shading at Disney*, 2012). Where nothing is scattered the surface is a metal, and Ks its reflectance.
fn reflectance(highlight: Vec3, base_color: Vec3) -> Vec3 {
    if base_color.max_element() <= MAX_METAL_DIFFUSE {
        highlight.min(Vec3::ONE)
    } else {
        (highlight * 0.08).min(Vec3::ONE)
    }
}

/// A definition in the library called `name`.
pub(super) struct Definition<'a, 'b> {
    pub(super) read: &'a tobj::Material,
    pub(super) name: &'a str,
    /// Line of the texture with a keyword.
    pub(super) line: &'a dyn Fn(&'static str) -> u64,
    pub(super) images: &'a mut Images<'b>,
    pub(super) warnings: &'a mut Warnings,
}

impl Definition<'_, '_> {
    /// Gives a new material what is defined.
    pub(super) fn apply(mut self, material: &mut Material) {
        let color = |read: Option<[f64; 3]>| read.map(|color| Vec3::from_array(color.map(|part| part as f32)));
        material.base_color = color(self.read.diffuse).unwrap_or(material.base_color);
        material.emissive = color(self.read.emissive).unwrap_or(material.emissive);
        material.base_color_texture = self.texture("map_Kd", Content::Texels, false);
        material.emissive_texture = self.texture("map_Ke", Content::Texels, false);
        // A map is drawn where exporters write black beside it.
        if material.base_color_texture.is_some() && material.base_color == Vec3::ZERO {
            material.base_color = Vec3::ONE;
        }
        if material.emissive_texture.is_some() && material.emissive == Vec3::ZERO {
            material.emissive = Vec3::ONE;
        }
        let has_roughness = self.roughness(material);
        let is_physical = self.metal(material) || has_roughness;
        if !is_physical {
            self.highlights(color(self.read.specular), material);
        }
        if !has_roughness {
            self.exponent(material);
        }
        self.normals(material);
        self.mask(material);
    }

    /// The text after a keyword: a field of tobj's material, or one that it does not know.
    fn text(&self, keyword: &str) -> Option<&str> {
        let read = &self.read;
        match keyword {
            "map_Kd" => &read.diffuse_texture,
            "map_Ks" => &read.specular_texture,
            "map_Ns" => &read.shininess_texture,
            "map_d" => &read.dissolve_texture,
            "bump" => &read.normal_texture,
            _ => return read.unknown_param.get(keyword).map(String::as_str),
        }
        .as_deref()
    }

    /// Pr and its texture; returns whether there is one of them.
    fn roughness(&mut self, material: &mut Material) -> bool {
        let value = self.fraction("Pr");
        material.roughness = value.unwrap_or(material.roughness);
        material.roughness_texture = self.texture("map_Pr", Content::Texels, true);
        // A factor of its own would darken the texture; many files have one of 0 or none.
        if material.roughness_texture.is_some() {
            material.roughness = 1.0;
        }
        value.is_some() || material.roughness_texture.is_some()
    }

    /// Pm and its texture; returns whether there is one of them.
    fn metal(&mut self, material: &mut Material) -> bool {
        let value = self.fraction("Pm");
        material.metallic = value.unwrap_or(material.metallic);
        material.metallic_texture = self.texture("map_Pm", Content::Texels, true);
        if material.metallic_texture.is_some() {
            material.metallic = 1.0;
        }
        value.is_some() || material.metallic_texture.is_some()
    }

    fn fraction(&self, keyword: &str) -> Option<f32> {
        self.text(keyword)?.parse().ok().map(|value: f32| value.clamp(0.0, 1.0))
    }

    /// Ks and its texture.
    fn highlights(&mut self, highlight: Option<Vec3>, material: &mut Material) {
        material.specular_texture = self.texture("map_Ks", Content::Texels, false);
        // A map without a colour, or with black, which many files have, stands for itself.
        let own = highlight.filter(|&color| material.specular_texture.is_none() || color != Vec3::ZERO);
        if let Some(highlight) = own.or(material.specular_texture.map(|_| Vec3::ONE)) {
            let scattered = if material.base_color_texture.is_some() { Vec3::ONE } else { material.base_color };
            material.specular = reflectance(highlight, scattered);
        }
    }

    /// Ns, which the texture multiplies.
    fn exponent(&mut self, material: &mut Material) {
        let exponent = self.read.shininess.map(|exponent| exponent as f32);
        if let Some(exponent) = exponent {
            material.roughness = roughness(exponent);
        }
        let white = exponent.filter(|&exponent| exponent > 0.0).unwrap_or(DEFAULT_EXPONENT);
        if let Some(texture) = self.texture("map_Ns", Content::Exponents(white.to_bits()), true) {
            (material.roughness, material.roughness_texture) = (1.0, Some(texture));
        }
    }

    /// A normal map, else a bump map.
    fn normals(&mut self, material: &mut Material) {
        for (keyword, content) in [("bump", Content::Bump), ("norm", Content::Texels)] {
            if let Some(texture) = self.texture(keyword, content, true) {
                material.normal_texture = Some(texture);
                let text = self.text(keyword).unwrap_or_default();
                material.normal_scale = texture_name(text.as_bytes(), |name| self.exists(name)).bump_multiplier;
            }
        }
    }

    /// A mask is the alpha of the texture of the base colour.
    fn mask(&mut self, material: &mut Material) {
        let file = |keyword| {
            let text = self.text(keyword).unwrap_or_default().as_bytes();
            texture_name(text, |name| self.exists(name)).name
        };
        let mask = file("map_d");
        if mask.is_empty() {
            return;
        }
        if material.base_color_texture.is_some() {
            material.alpha_cutoff = 0.5;
        }
        if !mask.eq_ignore_ascii_case(file("map_Kd")) {
            self.warn("masks (map_d) in a file of their own not used", (self.line)("map_d"));
        }
    }

    /// Whether a file of this name may be read.
    fn exists(&self, name: &[u8]) -> bool {
        self.images.resolve(&String::from_utf8_lossy(name)).is_ok()
    }

    fn warn(&mut self, what: &str, line: u64) {
        let name = self.name;
        self.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
    }

    /// The texture that a keyword names; `None`, with a warning, if it cannot be used.
    fn texture(&mut self, keyword: &'static str, content: Content, is_linear: bool) -> Option<u32> {
        let text = self.text(keyword)?.to_owned();
        let line = (self.line)(keyword);
        let TextureName { name, ignored, .. } = texture_name(text.as_bytes(), |name| self.exists(name));
        let library = self.name;
        let location = || FileLocation::LineIn(library.to_owned(), line);
        let image = self.images.texture_named(&String::from_utf8_lossy(name), content, location);
        if ignored {
            self.warn(&format!("textures ({keyword}) shown without their options"), line);
        }
        self.images.variant(image?, TextureUse::repeated(is_linear))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn highlights_become_reflectance() {
        let paint = Vec3::new(0.5, 0.1, 0.1);
        assert!((reflectance(Vec3::splat(0.5), paint) - Vec3::splat(0.04)).abs().max_element() < 1e-6);
        let gold = Vec3::new(1.2, 0.77, 0.34);
        assert_eq!(reflectance(gold, Vec3::ZERO), Vec3::new(1.0, 0.77, 0.34), "a metal");
    }
}
