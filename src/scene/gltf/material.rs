//! Converts glTF materials: base colour, metal, roughness, normals, occlusion and emission with their textures, alpha cut-off,
//! unlit.

use std::collections::HashMap;

use glam::{Affine2, Vec2, Vec3};
use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::{Texture, WrappingMode};
use serde_json::Value;

use super::document::Document;
use super::primitive::MaterialUse;
use super::table::{NO_IMAGE, extension};
use super::transform::numbers;
use super::uri::{file_name, is_data, read_uri};
use crate::scene::error::FileLocation;
use crate::scene::images::{Content, Images, READS_KTX2, TextureUse, UNPACK_TEXTURES};
use crate::scene::material::{Material, WrapMode};

/// Every material of the file followed by the default material, and how primitives use each.
pub(super) fn read_all(document: &Document, images: &mut Images) -> (Vec<Material>, Vec<MaterialUse>) {
    let mut reader = Reader { document, images, pictures: HashMap::new(), views: HashMap::new() };
    let (mut materials, mut uses) = (Vec::new(), Vec::new());
    for (index, json) in document.gltf.materials().enumerate() {
        if reader.images.token.is_cancelled() {
            break;
        }
        let (material, used) = reader.read(&json, index);
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

/// A material's reference to a texture.
struct Reference<'a> {
    texture: Texture<'a>,
    uv_set: u32,
    transform: Affine2,
}

impl<'a> Reference<'a> {
    fn new(texture: Texture<'a>, uv_set: u32, transform: Option<&Value>) -> Self {
        let field = |name: &str| transform.and_then(|transform| transform.get(name));
        let vector = |name: &str| numbers(field(name)).map(|[u, v]| Vec2::new(u as f32, v as f32));
        let angle = field("rotation").and_then(Value::as_f64).unwrap_or(0.0) as f32;
        let moved = field("texCoord").and_then(Value::as_u64).and_then(|set| u32::try_from(set).ok());
        // v points down, so a counter-clockwise rotation has a negative angle.
        let transform = Affine2::from_scale_angle_translation(
            vector("scale").unwrap_or(Vec2::ONE),
            -angle,
            vector("offset").unwrap_or(Vec2::ZERO),
        );
        Self { texture, uv_set: moved.unwrap_or(uv_set), transform }
    }

    fn color(info: gltf::texture::Info<'a>) -> Self {
        Self::new(info.texture(), info.tex_coord(), info.extension_value(extension::TRANSFORM))
    }
}

impl Reader<'_, '_> {
    #[expect(clippy::too_many_lines, reason = "a list of fields")]
    fn read(&mut self, json: &gltf::Material, index: usize) -> (Material, MaterialUse) {
        let surface = json.pbr_metallic_roughness();
        let mut maps = Maps { reader: self, material: index, uv_sets: Vec::new() };
        let base_color_texture = maps.map(
            surface.base_color_texture().map(Reference::color),
            "pbrMetallicRoughness.baseColorTexture",
            false,
        );
        let metallic_roughness = maps.map(
            surface.metallic_roughness_texture().map(Reference::color),
            "pbrMetallicRoughness.metallicRoughnessTexture",
            true,
        );
        let (normal, occlusion) = (json.normal_texture(), json.occlusion_texture());
        let of_normal = normal
            .as_ref()
            .map(|info| Reference::new(info.texture(), info.tex_coord(), info.extension_value(extension::TRANSFORM)));
        let normal_texture = maps.map(of_normal, "normalTexture", true);
        let of_occlusion = occlusion
            .as_ref()
            .map(|info| Reference::new(info.texture(), info.tex_coord(), info.extension_value(extension::TRANSFORM)));
        let occlusion_texture = maps.map(of_occlusion, "occlusionTexture", true);
        let emissive_texture = maps.map(json.emissive_texture().map(Reference::color), "emissiveTexture", false);
        let uv_sets = maps.uv_sets;
        let strength = json.emissive_strength().unwrap_or(1.0);
        // Without its texture, the factor alone would make the whole surface emit.
        let is_emissive = json.emissive_texture().is_some() == emissive_texture.is_some() && strength.is_finite();
        let emissive = Some(json.emissive_factor()).filter(|_| is_emissive).and_then(finite);
        let [r, g, b, alpha] = surface.base_color_factor();
        let fraction = |number: f32| if number.is_finite() { number.clamp(0.0, 1.0) } else { 1.0 };
        let alpha_cutoff = match json.alpha_mode() {
            AlphaMode::Mask => json.alpha_cutoff().unwrap_or(0.5),
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        };
        let transmission = json.extension_value(extension::TRANSMISSION);
        let material = Material {
            name: json.name().unwrap_or_default().to_owned(),
            base_color: finite([r, g, b]).unwrap_or(Vec3::ONE).max(Vec3::ZERO),
            base_color_texture,
            alpha: if alpha.is_finite() { alpha } else { 1.0 },
            metallic: fraction(surface.metallic_factor()),
            metallic_texture: metallic_roughness,
            roughness: fraction(surface.roughness_factor()),
            roughness_texture: metallic_roughness,
            specular: Material::DIELECTRIC,
            specular_texture: None,
            normal_texture,
            normal_scale: normal.map(|info| info.scale()).filter(|scale| scale.is_finite()).unwrap_or(1.0),
            occlusion_texture,
            occlusion_strength: occlusion.map_or(1.0, |info| fraction(info.strength())),
            emissive: emissive.unwrap_or(Vec3::ZERO) * strength,
            emissive_texture,
            alpha_cutoff,
            transmission: transmission
                .and_then(|value| value.get("transmissionFactor")?.as_f64())
                .map_or(0.0, |factor| fraction(factor as f32)),
            unlit: json.unlit(),
        };
        let set = |slot: usize| uv_sets.get(slot).copied();
        let used = MaterialUse {
            uv_set: set(0).unwrap_or(0),
            second_uv_set: set(1),
            has_texture: set(0).is_some(),
            has_normal_map: material.normal_texture.is_some(),
            is_cut_out: alpha_cutoff > 0.0,
        };
        (material, used)
    }

    fn texture(&mut self, reference: &Reference, uv_set: u8, is_linear: bool) -> Option<u32> {
        let texture = &reference.texture;
        let picture = self.picture(texture)?;
        let wrap = [texture.sampler().wrap_s(), texture.sampler().wrap_t()].map(|mode| match mode {
            WrappingMode::ClampToEdge => WrapMode::ClampToEdge,
            WrappingMode::MirroredRepeat => WrapMode::MirroredRepeat,
            WrappingMode::Repeat => WrapMode::Repeat,
        });
        self.images.variant(picture, TextureUse { wrap, uv_transform: reference.transform, uv_set, is_linear })
    }

    /// The texels of a texture, repeated.
    fn picture(&mut self, texture: &Texture) -> Option<u32> {
        let index = texture.index();
        let named_by = |extension: &str| {
            let source = texture.extension_value(extension)?.get("source")?.as_u64()?;
            self.document.gltf.images().nth(usize::try_from(source).ok()?)
        };
        let ktx2 = if READS_KTX2 { named_by(extension::BASISU) } else { None };
        let named = [ktx2, named_by(extension::WEBP), texture.source()];
        // The last entries stand for images and textures that do not exist, which are counted already.
        let exists = |image: &gltf::Image| image.index().saturating_add(1) < self.document.gltf.images().len();
        let is_counted = named.iter().flatten().any(|image| !exists(image));
        let Some(image) = named.into_iter().flatten().find(exists) else {
            if !is_counted && index.saturating_add(1) < self.document.gltf.textures().len() {
                let detail = match texture.extension_value(extension::BASISU) {
                    Some(_) if !READS_KTX2 => format!("it is a KTX2 file; {UNPACK_TEXTURES}"),
                    _ => "it has no source".to_owned(),
                };
                self.images.warn_at(NO_IMAGE, || FileLocation::in_json(format!("textures[{index}]"), detail));
            }
            return None;
        };
        if let Some(&known) = self.pictures.get(&image.index()) {
            return known;
        }
        let picture = self.decode(&image);
        self.pictures.insert(image.index(), picture);
        picture
    }

    fn decode(&mut self, image: &gltf::Image) -> Option<u32> {
        let place = || FileLocation::Json(format!("images[{}]", image.index()));
        match image.source() {
            Source::Uri { uri: "", .. } => {
                let reason = Err("it has neither data nor a uri".to_owned());
                self.images.texture(reason, Content::Texels, "", place)
            }
            Source::Uri { uri, .. } if is_data(uri) => {
                let bytes = read_uri(uri, self.images);
                self.images.texture(bytes, Content::Texels, "", place)
            }
            Source::Uri { uri, .. } => match file_name(uri, self.images) {
                Ok(name) => self.images.texture_named(&name, Content::Texels, place),
                Err(reason) => self.images.texture(Err(reason), Content::Texels, uri, place),
            },
            Source::View { view, .. } => {
                if let Some(&known) = self.views.get(&view.index()) {
                    return known;
                }
                let bytes = self.document.view(&view).map(<[u8]>::to_vec).map_err(|fault| fault.detail);
                let picture = self.images.texture(bytes, Content::Texels, "", place);
                self.views.insert(view.index(), picture);
                picture
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
    uv_sets: Vec<u32>,
}

impl Maps<'_, '_, '_> {
    /// Index of a texture; `None`, with a warning where one is named, if it cannot be used.
    fn map(&mut self, reference: Option<Reference>, field: &str, is_linear: bool) -> Option<u32> {
        let reference = reference?;
        let set = reference.uv_set;
        let slot = self.uv_sets.iter().position(|&known| known == set).unwrap_or(self.uv_sets.len());
        if slot > 1 {
            let what = "textures left out: their material has textures of two other sets of coordinates";
            let path = format!("materials[{}].{field}.texCoord", self.material);
            self.reader.images.warn_at(what, || FileLocation::in_json(path, set));
            return None;
        }
        let texture = self.reader.texture(&reference, slot as u8, is_linear)?;
        if slot == self.uv_sets.len() {
            self.uv_sets.push(set);
        }
        Some(texture)
    }
}

fn finite(numbers: [f32; 3]) -> Option<Vec3> {
    Some(Vec3::from_array(numbers)).filter(|vector| vector.is_finite())
}
