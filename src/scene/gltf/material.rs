//! Converts glTF materials: base colour and texture, emission, alpha cut-off, unlit.

use glam::{Affine2, Vec2, Vec3};
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::texture::{Info, WrappingMode};
use gltf::json::validation::Checked;

use super::document::{Document, entry, read_uri};
use crate::scene::images::Images;
use crate::scene::material::{Material, WrapMode};

/// Every material of the file followed by the default material, and for each the index of its texture coordinate set.
pub(super) fn read_all(document: &Document, images: &mut Images) -> (Vec<Material>, Vec<u32>) {
    let mut pictures = vec![None; document.root().images.len()];
    let (mut materials, mut sets) = (Vec::new(), Vec::new());
    for json in &document.root().materials {
        if images.token.is_cancelled() {
            break;
        }
        let (material, set) = read(json, document, images, &mut pictures);
        materials.push(material);
        sets.push(set);
    }
    materials.push(Material::clay());
    sets.push(0);
    (materials, sets)
}

/// For each image of the file: unread, unusable or an index into the textures.
type Pictures = [Option<Option<u32>>];

fn read(json: &JsonMaterial, document: &Document, images: &mut Images, pictures: &mut Pictures) -> (Material, u32) {
    let surface = &json.pbr_metallic_roughness;
    let texture = surface.base_color_texture.as_ref();
    let transform =
        texture.and_then(|info| info.extensions.as_ref()).and_then(|extensions| extensions.texture_transform.as_ref());
    let set = transform.and_then(|transform| transform.tex_coord).or(texture.map(|info| info.tex_coord)).unwrap_or(0);
    let extensions = json.extensions.as_ref();
    let strength = extensions
        .and_then(|extensions| extensions.emissive_strength.as_ref())
        .map_or(1.0, |emissive| emissive.emissive_strength.0);
    // Emissive textures are not supported; the factor alone would make the whole surface emit.
    let is_emissive = json.emissive_texture.is_none() && strength.is_finite();
    let [r, g, b, _] = surface.base_color_factor.0;
    let material = Material {
        name: json.name.clone().unwrap_or_default(),
        base_color: finite([r, g, b]).unwrap_or(Vec3::ONE).max(Vec3::ZERO),
        base_color_texture: texture.and_then(|info| read_texture(info, document, images, pictures)),
        emissive: if is_emissive {
            finite(json.emissive_factor.0).unwrap_or(Vec3::ZERO) * strength
        } else {
            Vec3::ZERO
        },
        alpha_cutoff: match json.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0),
            _ => 0.0,
        },
        unlit: extensions.is_some_and(|extensions| extensions.unlit.is_some()),
    };
    (material, set)
}

fn finite(numbers: [f32; 3]) -> Option<Vec3> {
    Some(Vec3::from_array(numbers)).filter(|vector| vector.is_finite())
}

fn read_texture(info: &Info, document: &Document, images: &mut Images, pictures: &mut Pictures) -> Option<u32> {
    let root = document.root();
    let texture = root.textures.get(info.index.value())?;
    let source = texture.source.value();
    let known = pictures.get_mut(source)?;
    let picture = *known.get_or_insert_with(|| {
        let name = format!("images[{source}]");
        let image = entry(&root.images, "images", source).ok()?;
        let decoded = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => read_uri(uri, images),
            (None, Some(view)) => document.view(view.value()).map(<[u8]>::to_vec),
            (None, None) => Err("it has neither data nor a uri".to_owned()),
        };
        match decoded {
            Ok(bytes) => images.texture(bytes, [WrapMode::Repeat; 2], &name),
            Err(reason) => {
                images.warn(&name, &reason);
                None
            }
        }
    });
    let sampler = texture.sampler.and_then(|sampler| root.samplers.get(sampler.value()));
    let wrap = sampler.map_or([WrapMode::Repeat; 2], |sampler| {
        [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => WrapMode::ClampToEdge,
            Checked::Valid(WrappingMode::MirroredRepeat) => WrapMode::MirroredRepeat,
            _ => WrapMode::Repeat,
        })
    });
    let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
    let transform = transform.map_or(Affine2::IDENTITY, |transform| {
        let (scale, offset) = (Vec2::from_array(transform.scale.0), Vec2::from_array(transform.offset.0));
        // v points down, so a counter-clockwise rotation has a negative angle.
        Affine2::from_scale_angle_translation(scale, -transform.rotation.0, offset)
    });
    images.variant(picture?, wrap, transform)
}
