//! Converts glTF materials: base colour, metal, roughness, normals, occlusion and emission with their textures, alpha cut-off,
//! unlit.

use std::collections::HashMap;

use glam::{Affine2, Vec2, Vec3};

use super::announced::UNPACK_TEXTURES;
use super::document::{Document, Fault, NO_SUCH_ENTRY, entry};
use super::json::{Real, Whole};
use super::place::place;
use super::primitive::MaterialUse;
use super::schema::{Material as JsonMaterial, Texture as JsonTexture, TextureInfo};
use super::uri::{file_name, read_uri};
use crate::scene::images::{Content, Images, TextureUse};
use crate::scene::material::{Material, WrapMode};

/// Every material of the file followed by the default material, and what their primitives need to know of them.
pub(super) fn read_all(document: &Document, images: &mut Images) -> (Vec<Material>, Vec<MaterialUse>) {
    let mut reader = Reader { document, images, pictures: HashMap::new(), views: HashMap::new() };
    let (mut materials, mut uses) = (Vec::new(), Vec::new());
    for (index, json) in document.root.materials.iter().enumerate() {
        if reader.images.token.is_cancelled() {
            break;
        }
        let (material, used) = reader.read(json, index);
        materials.push(material);
        uses.push(used);
    }
    materials.push(Material::clay());
    uses.push(MaterialUse::default());
    (materials, uses)
}

struct Reader<'a, 'b> {
    document: &'a Document<'a>,
    images: &'a mut Images<'b>,
    /// Textures by image of the file; `None` for unusable ones.
    pictures: HashMap<usize, Option<u32>>,
    /// Textures by buffer view.
    views: HashMap<usize, Option<u32>>,
}

impl Reader<'_, '_> {
    fn read(&mut self, json: &JsonMaterial, index: usize) -> (Material, MaterialUse) {
        let surface = &json.pbr_metallic_roughness;
        let mut maps = Maps { reader: self, material: index, uv_sets: Vec::new() };
        let base_color_texture =
            maps.map(surface.base_color_texture.as_deref(), "pbrMetallicRoughness.baseColorTexture", false);
        let metallic_roughness = maps.map(
            surface.metallic_roughness_texture.as_deref(),
            "pbrMetallicRoughness.metallicRoughnessTexture",
            true,
        );
        let normal_texture = maps.map(json.normal_texture.as_deref(), "normalTexture", true);
        let occlusion_texture = maps.map(json.occlusion_texture.as_deref(), "occlusionTexture", true);
        let emissive_texture = maps.map(json.emissive_texture.as_deref(), "emissiveTexture", false);
        let uv_sets = maps.uv_sets;
        let strength = json.extensions.strength.emissive_strength.map_or(1.0, |strength| strength.0);
        // Without its texture, the factor alone would make the whole surface emit.
        let is_emissive = json.emissive_texture.is_some() == emissive_texture.is_some() && strength.is_finite();
        let emissive = json.emissive_factor.filter(|_| is_emissive).and_then(|factor| finite(factor.0));
        let [r, g, b, _] = surface.base_color_factor.map_or([1.0; 4], |factor| factor.0);
        let number =
            |real: Option<Real>, default: f32| real.map(|real| real.0).filter(|x| x.is_finite()).unwrap_or(default);
        let fraction = |real: Option<Real>| number(real, 1.0).clamp(0.0, 1.0);
        let material = Material {
            name: json.name.as_ref().map(|name| name.0.clone()).unwrap_or_default(),
            base_color: finite([r, g, b]).unwrap_or(Vec3::ONE).max(Vec3::ZERO),
            base_color_texture,
            metallic: fraction(surface.metallic_factor),
            metallic_texture: metallic_roughness,
            roughness: fraction(surface.roughness_factor),
            roughness_texture: metallic_roughness,
            specular: Material::DIELECTRIC,
            specular_texture: None,
            normal_texture,
            normal_scale: json.normal_texture.as_deref().map_or(1.0, |info| number(info.scale, 1.0)),
            occlusion_texture,
            occlusion_strength: json.occlusion_texture.as_deref().map_or(1.0, |info| fraction(info.strength)),
            emissive: emissive.unwrap_or(Vec3::ZERO) * strength,
            emissive_texture,
            alpha_cutoff: match json.alpha_mode.as_deref() {
                Some("MASK") => json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0),
                _ => 0.0,
            },
            unlit: json.extensions.unlit.is_some(),
        };
        let set = |slot: usize| uv_sets.get(slot).copied();
        (material, MaterialUse { uv_set: set(0).unwrap_or(0), second_uv_set: set(1), has_texture: set(0).is_some() })
    }

    fn texture(&mut self, info: &TextureInfo, path: &str, uv_set: u8, is_linear: bool) -> Option<u32> {
        let root = &self.document.root;
        let index = info.index.map_or(usize::MAX, Whole::get);
        let Some(texture) = root.textures.get(index) else {
            let detail = match info.index {
                Some(_) => format!("textures[{index}] does not exist, there are {}", root.textures.len()),
                None => "names no texture".to_owned(),
            };
            let what = "materials shown without a texture that does not exist";
            self.images.warn_at(what, || place(format!("{path}.index"), &detail));
            return None;
        };
        let picture = self.picture(texture, index)?;
        let wrap = match texture.sampler.map(Whole::get) {
            None => [WrapMode::Repeat; 2],
            Some(index_of_sampler) => match entry(&root.samplers, "samplers", index_of_sampler) {
                Ok(sampler) => [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode.map_or(10_497, |mode| mode.0) {
                    33_071 => WrapMode::ClampToEdge,
                    33_648 => WrapMode::MirroredRepeat,
                    _ => WrapMode::Repeat,
                }),
                Err(fault) => {
                    let what = "textures whose sampler does not exist repeated";
                    self.images.warn_at(what, || place(format!("textures[{index}].sampler"), &fault.detail));
                    [WrapMode::Repeat; 2]
                }
            },
        };
        let transform = info.extensions.transform.as_ref().map_or(Affine2::IDENTITY, |transform| {
            let scale = transform.scale.map_or(Vec2::ONE, |scale| Vec2::from_array(scale.0));
            let offset = transform.offset.map_or(Vec2::ZERO, |offset| Vec2::from_array(offset.0));
            // v points down, so a counter-clockwise rotation has a negative angle.
            Affine2::from_scale_angle_translation(scale, -transform.rotation.0, offset)
        });
        self.images.variant(picture, TextureUse { wrap, uv_transform: transform, uv_set, is_linear })
    }

    /// The texels of a texture, repeated.
    fn picture(&mut self, texture: &JsonTexture, index: usize) -> Option<u32> {
        let Some(source) = texture.source.map(Whole::get) else {
            let detail = match (&texture.extensions.basisu, &texture.extensions.webp) {
                (Some(_), _) => format!("it is a KTX2 file; {UNPACK_TEXTURES}"),
                (None, Some(_)) => "it is a WebP file; convert them with 'gltf-transform png IN OUT'".to_owned(),
                (None, None) => "it has no source".to_owned(),
            };
            self.images
                .warn_at("textures without an image that can be read", || place(format!("textures[{index}]"), &detail));
            return None;
        };
        if let Some(&known) = self.pictures.get(&source) {
            return known;
        }
        let picture = self.decode(source, index);
        self.pictures.insert(source, picture);
        picture
    }

    fn decode(&mut self, source: usize, texture: usize) -> Option<u32> {
        let path = || format!("images[{source}]");
        let image = match entry(&self.document.root.images, "images", source) {
            Ok(image) => image,
            Err(Fault { kind, detail }) => {
                debug_assert_eq!(kind, NO_SUCH_ENTRY);
                let what = "textures without an image that can be read";
                self.images.warn_at(what, || place(format!("textures[{texture}].source"), &detail));
                return None;
            }
        };
        match (image.uri.as_deref(), image.buffer_view.map(Whole::get)) {
            (Some(uri), _) if uri.starts_with("data:") => {
                let bytes = read_uri(uri, self.images);
                self.images.texture(bytes, Content::Texels, "", || place(path(), ""))
            }
            (Some(uri), _) => match file_name(uri, self.images.token) {
                Ok(name) => self.images.texture_named(&name, Content::Texels, || place(path(), "")),
                Err(reason) => self.images.texture(Err(reason), Content::Texels, uri, || place(path(), "")),
            },
            (None, Some(view)) => {
                if let Some(&known) = self.views.get(&view) {
                    return known;
                }
                let bytes = self.document.view(view).map(<[u8]>::to_vec).map_err(|fault| fault.detail);
                let picture = self.images.texture(bytes, Content::Texels, "", || place(path(), ""));
                self.views.insert(view, picture);
                picture
            }
            (None, None) => {
                let reason = Err("it has neither data nor a uri".to_owned());
                self.images.texture(reason, Content::Texels, "", || place(path(), ""))
            }
        }
    }
}

/// The textures of one material.
struct Maps<'a, 'b, 'c> {
    reader: &'a mut Reader<'b, 'c>,
    /// Index of the material.
    material: usize,
    /// The sets of texture coordinates of its usable textures, at most two.
    uv_sets: Vec<u64>,
}

impl Maps<'_, '_, '_> {
    /// Index of a texture; `None`, with a warning where one is named, if it cannot be used.
    fn map(&mut self, info: Option<&TextureInfo>, field: &str, is_linear: bool) -> Option<u32> {
        let info = info?;
        let path = format!("materials[{}].{field}", self.material);
        let moved = info.extensions.transform.as_ref().and_then(|transform| transform.tex_coord);
        let set = moved.unwrap_or(info.tex_coord).0;
        let slot = self.uv_sets.iter().position(|&known| known == set).unwrap_or(self.uv_sets.len());
        if slot > 1 {
            let what = "textures left out: their material has textures of two other sets of coordinates";
            self.reader.images.warn_at(what, || place(format!("{path}.texCoord"), &set.to_string()));
            return None;
        }
        let texture = self.reader.texture(info, &path, slot as u8, is_linear)?;
        if slot == self.uv_sets.len() {
            self.uv_sets.push(set);
        }
        Some(texture)
    }
}

fn finite(numbers: [f32; 3]) -> Option<Vec3> {
    Some(Vec3::from_array(numbers)).filter(|vector| vector.is_finite())
}
