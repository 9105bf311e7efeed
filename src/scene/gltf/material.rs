//! Converts glTF materials: base colour and texture, emission, alpha cut-off, unlit.

use std::collections::HashMap;

use glam::{Affine2, Vec2, Vec3};

use super::announced::UNPACK_TEXTURES;
use super::document::{Document, Fault, NO_SUCH_ENTRY, entry};
use super::json::Whole;
use super::place::place;
use super::primitive::MaterialUse;
use super::schema::{Material as JsonMaterial, Texture as JsonTexture, TextureInfo};
use super::uri::{file_name, read_uri};
use crate::scene::images::Images;
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
        let path = |field: &str| format!("materials[{index}].{field}");
        let surface = &json.pbr_metallic_roughness;
        let info = surface.base_color_texture.as_deref();
        let set = info.map_or(0, |info| {
            let moved = info.extensions.transform.as_ref().and_then(|transform| transform.tex_coord);
            moved.unwrap_or(info.tex_coord).0
        });
        let texture = info.and_then(|info| self.texture(info, &path("pbrMetallicRoughness.baseColorTexture")));
        let strength = json.extensions.strength.emissive_strength.map_or(1.0, |strength| strength.0);
        // Emissive textures are not supported; the factor alone would make the whole surface emit.
        let is_emissive = json.emissive_texture.is_none() && strength.is_finite();
        let emissive = json.emissive_factor.filter(|_| is_emissive).and_then(|factor| finite(factor.0));
        let [r, g, b, _] = surface.base_color_factor.map_or([1.0; 4], |factor| factor.0);
        let material = Material {
            name: json.name.as_ref().map(|name| name.0.clone()).unwrap_or_default(),
            base_color: finite([r, g, b]).unwrap_or(Vec3::ONE).max(Vec3::ZERO),
            base_color_texture: texture,
            emissive: emissive.unwrap_or(Vec3::ZERO) * strength,
            alpha_cutoff: match json.alpha_mode.as_deref() {
                Some("MASK") => json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0),
                _ => 0.0,
            },
            unlit: json.extensions.unlit.is_some(),
        };
        (material, MaterialUse { uv_set: set, has_texture: texture.is_some() })
    }

    fn texture(&mut self, info: &TextureInfo, path: &str) -> Option<u32> {
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
        self.images.variant(picture, wrap, transform)
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
        const REPEAT: [WrapMode; 2] = [WrapMode::Repeat; 2];
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
                self.images.texture(bytes, REPEAT, "", || place(path(), ""))
            }
            (Some(uri), _) => match file_name(uri, self.images.token) {
                Ok(name) => self.images.texture_named(&name, REPEAT, || place(path(), "")),
                Err(reason) => self.images.texture(Err(reason), REPEAT, uri, || place(path(), "")),
            },
            (None, Some(view)) => {
                if let Some(&known) = self.views.get(&view) {
                    return known;
                }
                let bytes = self.document.view(view).map(<[u8]>::to_vec).map_err(|fault| fault.detail);
                let picture = self.images.texture(bytes, REPEAT, "", || place(path(), ""));
                self.views.insert(view, picture);
                picture
            }
            (None, None) => {
                let reason = Err("it has neither data nor a uri".to_owned());
                self.images.texture(reason, REPEAT, "", || place(path(), ""))
            }
        }
    }
}

fn finite(numbers: [f32; 3]) -> Option<Vec3> {
    Some(Vec3::from_array(numbers)).filter(|vector| vector.is_finite())
}
