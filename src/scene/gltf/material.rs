//! Base colours, their textures, and what little else of a material shows.

use glam::{Affine2, Vec2, Vec3};
use serde_json::Value;

use super::container::{Document, number, read_uri};
use crate::scene::images::Images;
use crate::scene::{Material, WrapMode};

/// Every material of the file and, at the end, the one of primitives that have none. Beside each, the set of texture
/// coordinates that it uses.
pub(super) fn read_all(document: &Document, images: &mut Images) -> (Vec<Material>, Vec<usize>) {
    let list = document.json["materials"].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut pictures = vec![None; document.json["images"].as_array().map_or(0, Vec::len)];
    let mut sets = Vec::new();
    let mut materials: Vec<_> = list
        .iter()
        .map(|json| {
            let (material, set) = read(json, document, images, &mut pictures);
            sets.push(set);
            material
        })
        .collect();
    materials.push(Material::clay());
    sets.push(0);
    (materials, sets)
}

type Pictures = [Option<Option<u32>>];

fn read(json: &Value, document: &Document, images: &mut Images, pictures: &mut Pictures) -> (Material, usize) {
    let surface = &json["pbrMetallicRoughness"];
    let texture = &surface["baseColorTexture"];
    let extensions = &json["extensions"];
    let transform = &texture["extensions"]["KHR_texture_transform"];
    let set = number(transform, "texCoord").or(number(texture, "texCoord")).unwrap_or(0);
    let strength = extensions["KHR_materials_emissive_strength"]["emissiveStrength"].as_f64().unwrap_or(1.0) as f32;
    // A texture would say where it glows; without it, better nowhere than everywhere.
    let glows = json["emissiveTexture"].is_null() && strength.is_finite();
    let material = Material {
        name: json["name"].as_str().unwrap_or_default().to_owned(),
        base_color: vector(&surface["baseColorFactor"]).unwrap_or(Vec3::ONE).max(Vec3::ZERO),
        base_color_texture: number(texture, "index")
            .and_then(|index| read_texture(index, transform, document, images, pictures)),
        emissive: if glows { vector(&json["emissiveFactor"]).unwrap_or(Vec3::ZERO) * strength } else { Vec3::ZERO },
        alpha_cutoff: match json["alphaMode"].as_str() {
            Some("MASK") => json["alphaCutoff"].as_f64().unwrap_or(0.5) as f32,
            _ => 0.0,
        },
        unlit: extensions["KHR_materials_unlit"].is_object(),
    };
    (material, set)
}

/// Three finite numbers.
pub(super) fn vector(json: &Value) -> Option<Vec3> {
    let number = |k: usize| json.get(k)?.as_f64().map(|number| number as f32);
    let vector = Vec3::new(number(0)?, number(1)?, number(2)?);
    vector.is_finite().then_some(vector)
}

fn read_texture(
    index: usize,
    transform: &Value,
    document: &Document,
    images: &mut Images,
    pictures: &mut Pictures,
) -> Option<u32> {
    let texture = document.entry("textures", index).ok()?;
    let source = number(texture, "source")?;
    let known = pictures.get_mut(source)?;
    let picture = *known.get_or_insert_with(|| {
        let name = format!("images[{source}]");
        let image = document.entry("images", source).ok()?;
        let decoded = match (image["uri"].as_str(), number(image, "bufferView")) {
            (Some(uri), _) => read_uri(uri, images),
            (None, Some(view)) => document.view(view).map(<[u8]>::to_vec),
            (None, None) => Err("it has neither data nor a uri".to_owned()),
        };
        match decoded {
            Ok(bytes) => images.texture(&bytes, [WrapMode::Repeat; 2], &name),
            Err(reason) => {
                images.warn(&name, &reason);
                None
            }
        }
    });
    let sampler = number(texture, "sampler").and_then(|sampler| document.entry("samplers", sampler).ok());
    let wrap = ["wrapS", "wrapT"].map(|key| match sampler.and_then(|sampler| number(sampler, key)) {
        Some(33071) => WrapMode::ClampToEdge,
        Some(33648) => WrapMode::MirroredRepeat,
        _ => WrapMode::Repeat,
    });
    let pair = |key: &str, default: Vec2| {
        let number = |k: usize| transform[key].get(k).and_then(Value::as_f64).map(|number| number as f32);
        number(0).zip(number(1)).map_or(default, |(x, y)| Vec2::new(x, y))
    };
    // v points down, so that a turn against the clock is a negative one.
    let angle = -transform["rotation"].as_f64().unwrap_or(0.0) as f32;
    let transform = Affine2::from_scale_angle_translation(pair("scale", Vec2::ONE), angle, pair("offset", Vec2::ZERO));
    images.variant(picture?, wrap, transform)
}
