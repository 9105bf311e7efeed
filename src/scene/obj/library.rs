//! Material libraries (MTL): colours, highlights, textures, bump maps and cut-outs. Never fails; problems become warnings. What
//! describes refraction, mirrored pictures and coats is skipped without a word.

use std::collections::HashMap;

use glam::Vec3;

use super::super::assemble::Assembly;
use super::super::error::FileLocation;
use super::super::exponents::roughness;
use super::super::images::{Content, Images, TextureUse};
use super::super::material::Material;
use super::super::read::lines;
use super::library_values::{TextureName, color, first_number, texture_name};
use super::statement::number;
use crate::budget::Budget;
use crate::text::quoted;

/// Bytes per material: in a list that doubles as it grows, and its name in a table.
const BYTES_PER_MATERIAL: u64 = 4 * size_of::<Material>() as u64;
/// Maximum number of materials of a model; more are taken for a mistake or an attack.
const MAX_MATERIALS: usize = 1 << 16;
/// Bytes between two checks of the memory budget and of cancellation.
const POLL_INTERVAL_BYTES: usize = 1 << 16;

/// Statements, in lower case, about what surfaces here do not have or what is the same without them.
const WITHOUT_EFFECT: [&[u8]; 16] = [
    b"",
    b"ka",
    b"tf",
    b"ni",
    b"illum",
    b"sharpness",
    b"map_ka",
    b"map_aat",
    b"refl",
    b"map_refl",
    b"ps",
    b"pc",
    b"pcr",
    b"aniso",
    b"anisor",
    b"map_ps",
];

/// A library while it is read.
struct Library<'a, 'b> {
    /// Its name in the model.
    name: &'a str,
    line: u64,
    images: &'a mut Images<'b>,
    assembly: &'a mut Assembly,
    /// The material being defined.
    current: Option<Definition>,
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
}

/// A material being defined.
struct Definition {
    index: usize,
    /// Name of its diffuse texture.
    texture: Vec<u8>,
    /// Name of its mask and the line that names it.
    mask: Option<(Vec<u8>, u64)>,
    is_translucent: bool,
    /// Ks, unless roughness or metal are given.
    highlight: Option<Vec3>,
    /// Ns.
    exponent: Option<f32>,
    /// What `map_Ns` says, with its line: it multiplies Ns, which may come later.
    exponent_map: Option<(Vec<u8>, u64)>,
    /// Pr, Pm or one of their textures stands in the definition.
    is_physical: bool,
    /// Roughness is given by Pr or its texture.
    has_roughness: bool,
}

/// Exponent of white in a `map_Ns` without Ns.
const DEFAULT_EXPONENT: f32 = 100.0;

/// Reflectance at normal incidence for Ks: 0.5 is that of common dielectrics, 0.04, as Disney's *specular* has it (Burley,
/// *Physically-Based Shading at Disney*, 2012). Where nothing is scattered the surface is a metal, and Ks its reflectance.
fn reflectance(highlight: Vec3, base_color: Vec3) -> Vec3 {
    if base_color.max_element() <= MAX_METAL_DIFFUSE {
        highlight.min(Vec3::ONE)
    } else {
        (highlight * 0.08).min(Vec3::ONE)
    }
}

/// Kd up to which a material with highlights is a metal.
const MAX_METAL_DIFFUSE: f32 = 0.01;

/// Appends the materials in the text of a library, in file order, and their names; stops once cancelled.
pub(super) fn read(
    text: &[u8],
    name: &str,
    images: &mut Images,
    by_name: &mut HashMap<Vec<u8>, u32>,
    assembly: &mut Assembly,
) {
    let mut library = Library { name, line: 0, images, assembly, current: None, not_understood: None };
    if text.starts_with(b"\xFF\xFE") || text.starts_with(b"\xFE\xFF") {
        library.line = 1;
        library.warn("libraries in UTF-16 not used; save them as UTF-8");
        return;
    }
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    let (mut at, mut next_poll) = (0_usize, 0);
    for line in lines(text) {
        library.line = library.line.saturating_add(1);
        if at >= next_poll {
            next_poll = at.saturating_add(POLL_INTERVAL_BYTES);
            if library.images.token.is_cancelled() {
                return;
            }
            let bytes = (library.assembly.materials.len() as u64).saturating_mul(BYTES_PER_MATERIAL);
            if let Err(error) = Budget::of_process().check("the materials", bytes) {
                library.warn(&format!("libraries cut off: {error}"));
                break;
            }
        }
        at = at.saturating_add(line.len()).saturating_add(1);
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let rest = rest.trim_ascii();
        if keyword == b"newmtl" {
            library.begin(rest, by_name);
        } else if keyword.first() != Some(&b'#') {
            library.statement(keyword, rest);
        }
    }
    library.end();
}

impl Library<'_, '_> {
    fn warn(&mut self, what: &str) {
        let (name, line) = (self.name, self.line);
        self.assembly.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
    }

    /// Begins the definition of a material.
    fn begin(&mut self, name: &[u8], by_name: &mut HashMap<Vec<u8>, u32>) {
        self.end();
        let index = self.assembly.materials.len();
        if index >= MAX_MATERIALS {
            self.warn(&format!("materials beyond {MAX_MATERIALS} left out"));
            return;
        }
        if by_name.insert(name.to_vec(), index as u32).is_some() {
            self.warn("materials defined again, of which the last definition is used");
        }
        let name = String::from_utf8_lossy(name).into_owned();
        self.assembly.materials.push(Material { name, base_color: Vec3::splat(0.6), ..Material::clay() });
        self.current = Some(Definition {
            index,
            texture: Vec::new(),
            mask: None,
            is_translucent: false,
            highlight: None,
            exponent: None,
            exponent_map: None,
            is_physical: false,
            has_roughness: false,
        });
    }

    /// Ends the definition: highlights become reflectance and roughness, and a mask is the alpha of the diffuse texture.
    fn end(&mut self) {
        let Some(definition) = self.current.take() else { return };
        let Some(material) = self.assembly.materials.get_mut(definition.index) else { return };
        if definition.is_physical {
            material.specular_texture = None;
        } else {
            // A map without a colour, or with black, which many files have, stands for itself.
            let own = definition.highlight.filter(|&color| material.specular_texture.is_none() || color != Vec3::ZERO);
            if let Some(highlight) = own.or(material.specular_texture.map(|_| Vec3::ONE)) {
                let scattered = if material.base_color_texture.is_some() { Vec3::ONE } else { material.base_color };
                material.specular = reflectance(highlight, scattered);
            }
        }
        if let Some(exponent) = definition.exponent.filter(|_| !definition.has_roughness) {
            material.roughness = roughness(exponent);
        }
        if let Some((map, line)) = definition.exponent_map.filter(|_| !definition.has_roughness) {
            let here = std::mem::replace(&mut self.line, line);
            let exponent = definition.exponent.filter(|&exponent| exponent > 0.0).unwrap_or(DEFAULT_EXPONENT);
            let texture = self.texture("map_Ns", &map, Content::Exponents(exponent.to_bits()), true);
            self.line = here;
            if let (Some(material), Some(texture)) = (self.assembly.materials.get_mut(definition.index), texture) {
                (material.roughness, material.roughness_texture) = (1.0, Some(texture));
            }
        }
        let Some(material) = self.assembly.materials.get_mut(definition.index) else { return };
        let Some((mask, line)) = definition.mask else { return };
        let is_own = !mask.eq_ignore_ascii_case(&definition.texture);
        if material.base_color_texture.is_some() {
            material.alpha_cutoff = 0.5;
        }
        if is_own {
            let name = self.name;
            let what = "masks (map_d) in a file of their own not used";
            self.assembly.warnings.add(what, || FileLocation::LineIn(name.to_owned(), line));
        }
    }

    /// A statement within the definition of a material.
    fn statement(&mut self, keyword: &[u8], rest: &[u8]) {
        // Longer words are no keywords.
        let mut lower = keyword.get(..16.min(keyword.len())).unwrap_or_default().to_vec();
        lower.make_ascii_lowercase();
        if WITHOUT_EFFECT.contains(&&lower[..]) {
            return;
        }
        let Some(definition) = &mut self.current else {
            if self.assembly.materials.len() < MAX_MATERIALS {
                self.warn("statements before the first 'newmtl' skipped");
            }
            return;
        };
        let index = definition.index;
        let Some(material) = self.assembly.materials.get_mut(index) else { return };
        match &lower[..] {
            b"kd" => match color(rest) {
                Some(color) => material.base_color = color,
                None => self.warn("colours (Kd) not understood"),
            },
            b"ke" => match color(rest) {
                Some(color) => material.emissive = color,
                None => self.warn("colours (Ke) not understood"),
            },
            b"map_kd" => {
                definition.texture = texture_name(rest).name.to_vec();
                let texture = self.texture("map_Kd", rest, Content::Texels, false);
                let Some(material) = self.assembly.materials.get_mut(index) else { return };
                material.base_color_texture = texture;
                if texture.is_some() && material.base_color == Vec3::ZERO {
                    material.base_color = Vec3::ONE;
                }
            }
            b"ks" => match color(rest) {
                Some(color) => definition.highlight = Some(color),
                None => self.warn("colours (Ks) not understood"),
            },
            b"ns" => match first_number(rest) {
                Some(exponent) => definition.exponent = Some(exponent),
                None => self.warn("exponents (Ns) not understood"),
            },
            b"pr" | b"pm" => match first_number(rest) {
                Some(value) => {
                    definition.is_physical = true;
                    let value = value.clamp(0.0, 1.0);
                    if lower == b"pr" {
                        definition.has_roughness = true;
                        material.roughness = value;
                    } else {
                        material.metallic = value;
                    }
                }
                None => self.warn("fractions (Pr, Pm) not understood"),
            },
            b"map_ns" => definition.exponent_map = Some((rest.to_vec(), self.line)),
            b"map_pr" | b"map_pm" | b"map_ks" | b"map_ke" | b"map_bump" | b"bump" | b"norm" | b"map_norm"
            | b"map_kn" => {
                self.map(&lower, rest, index);
            }
            b"map_d" => definition.mask = Some((texture_name(rest).name.to_vec(), self.line)),
            b"d" | b"tr" => {
                let value = rest.split(u8::is_ascii_whitespace).rev().find_map(number);
                // Programs disagree on whether Tr 1 is clear or opaque.
                let is_translucent = value.is_some_and(|value| value < 1.0 && (value > 0.0 || lower == b"d"));
                if is_translucent && !std::mem::replace(&mut definition.is_translucent, true) {
                    self.warn("materials with transparency shown opaque");
                } else if value.is_none() {
                    self.warn("opacities (d, Tr) not understood");
                }
            }
            b"disp" | b"map_disp" => self.warn("displacements (disp) not shown"),
            b"decal" => self.warn("decals not shown"),
            _ => {
                let first = || format!("statements not understood and skipped, {} being the first", quoted(keyword));
                let what = self.not_understood.get_or_insert_with(first).clone();
                self.warn(&what);
            }
        }
    }
}

impl Library<'_, '_> {
    /// A statement that names a texture other than that of the base colour, with its keyword in lower case.
    fn map(&mut self, keyword: &[u8], rest: &[u8], index: usize) {
        let (name, content, is_linear) = match keyword {
            b"map_ke" => ("map_Ke", Content::Texels, false),
            b"map_pr" => ("map_Pr", Content::Texels, true),
            b"map_pm" => ("map_Pm", Content::Texels, true),
            b"map_ks" => ("map_Ks", Content::Texels, false),
            b"map_bump" | b"bump" => ("bump", Content::Bump, true),
            _ => ("norm", Content::Texels, true),
        };
        let texture = self.texture(name, rest, content, is_linear);
        let (Some(material), Some(definition)) = (self.assembly.materials.get_mut(index), &mut self.current) else {
            return;
        };
        if texture.is_none() {
            return;
        }
        match name {
            "map_Ke" => {
                material.emissive_texture = texture;
                if material.emissive == Vec3::ZERO {
                    material.emissive = Vec3::ONE;
                }
            }
            "map_Pr" => {
                // A factor of its own would darken it; many files have one of 0 or none.
                (material.roughness, material.roughness_texture) = (1.0, texture);
                (definition.is_physical, definition.has_roughness) = (true, true);
            }
            "map_Ks" => material.specular_texture = texture,
            "map_Pm" => {
                (material.metallic, material.metallic_texture) = (1.0, texture);
                definition.is_physical = true;
            }
            _ => {
                material.normal_texture = texture;
                material.normal_scale = texture_name(rest).bump_multiplier;
            }
        }
    }

    /// The texture that a statement names; `None`, with a warning, if it cannot be used.
    fn texture(&mut self, keyword: &str, rest: &[u8], content: Content, is_linear: bool) -> Option<u32> {
        let TextureName { name, ignored, .. } = texture_name(rest);
        let location = || FileLocation::LineIn(self.name.to_owned(), self.line);
        let image = self.images.texture_named(&String::from_utf8_lossy(name), content, location);
        if ignored {
            self.warn(&format!("textures ({keyword}) shown without their options"));
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
