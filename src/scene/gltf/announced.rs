//! What a file says about itself: its version, the extensions that it requires, and what it announces that no scene here holds.

use std::path::Path;

use super::advice::{UNPACK, UPGRADE};
use super::place::place;
use super::schema::{Asset, Root};
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A version "major.minor".
fn version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.trim().split_once('.').unwrap_or((text.trim(), "0"));
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Refuses versions that cannot be read as glTF 2.0.
pub(super) fn check_version(path: &Path, asset: &Asset, warnings: &mut Warnings) -> Result<(), LoadError> {
    let refuse = |field: &str, problem: String, advice: &str| {
        Err(LoadError::at(path, FileLocation::Json(format!("asset.{field}")), problem, advice))
    };
    let Some(label) = &asset.version else {
        let problem = "is missing, so this is not glTF 2.0".to_owned();
        return refuse("version", problem, "export the model as glTF 2.0");
    };
    let too_new = "export the model as glTF 2.0, or look for a newer version of this program";
    let is_too_new = |version: (u32, u32)| version > (2, 0);
    let minimum = asset.min_version.as_ref().and_then(|label| version(&label.0).map(|version| (version, label)));
    if let Some((needed, label)) = minimum
        && is_too_new(needed)
    {
        let problem =
            format!("is {}: a reader of at least that version is needed, this one reads 2.0", quoted(&label.0));
        return refuse("minVersion", problem, too_new);
    }
    match version(&label.0) {
        Some((2, 0)) => {}
        Some((0 | 1, _)) => {
            let problem = format!("is {}, only glTF 2.0 is read", quoted(&label.0));
            return refuse("version", problem, UPGRADE);
        }
        Some(found) if found.0 > 2 && minimum.is_none() => {
            let problem = format!("is {}, only glTF 2.0 is read", quoted(&label.0));
            return refuse("version", problem, too_new);
        }
        _ => {
            let place = place("asset.version", &quoted(&label.0));
            warnings.add("versions other than 2.0 read as 2.0", || place);
        }
    }
    Ok(())
}

/// Checks that every required extension is supported.
pub(super) fn check_extensions(path: &Path, root: &Root) -> Result<(), LoadError> {
    const SUPPORTED: [&str; 4] =
        ["KHR_mesh_quantization", "KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_lights_punctual"];
    for (index, name) in root.extensions_required.iter().enumerate() {
        let name = &**name;
        if SUPPORTED.contains(&name) || name.starts_with("KHR_materials_") {
            continue;
        }
        let (what, advice) = match name {
            "KHR_draco_mesh_compression" => ("meshes compressed by Draco", UNPACK),
            "EXT_meshopt_compression" | "KHR_meshopt_compression" => ("data compressed by meshopt", UNPACK),
            "KHR_texture_basisu" => ("KTX2 textures", UNPACK_TEXTURES),
            "EXT_texture_webp" => ("WebP textures", "convert them with 'gltf-transform png IN OUT'"),
            "EXT_texture_avif" => ("AVIF textures", "convert them with 'gltf-transform png IN OUT'"),
            _ => ("something unknown to this program", UNPACK),
        };
        let problem = format!("the extension {} is required but not supported: {what}", quoted(name));
        return Err(LoadError::at(path, FileLocation::Json(format!("extensionsRequired[{index}]")), problem, advice));
    }
    Ok(())
}

/// What to do about textures in KTX2 files.
pub(super) const UNPACK_TEXTURES: &str = "convert them with 'gltf-transform ktxdecompress IN OUT'";

/// Counts what the file announces and no scene here holds.
pub(super) fn warn(root: &Root, warnings: &mut Warnings, token: &CancelToken) -> Result<(), Cancelled> {
    let first = |list: &'static str| move || FileLocation::Json(format!("{list}[0]"));
    warnings.add_many(root.animations.len() as u64, "animations not played", first("animations"));
    warnings.add_many(root.cameras.len() as u64, "cameras not used", first("cameras"));
    let lights = "extensions.KHR_lights_punctual.lights";
    warnings.add_many(root.extensions.lights.lights.len() as u64, "lights not used", first(lights));
    for (index, mesh) in root.meshes.iter().enumerate() {
        token.check()?;
        if let Some(k) = mesh.primitives.iter().position(|primitive| !primitive.targets.is_empty()) {
            let what = "meshes with morph targets shown in the basic form";
            warnings.add(what, || FileLocation::Json(format!("meshes[{index}].primitives[{k}].targets")));
        }
    }
    for (index, material) in root.materials.iter().enumerate() {
        token.check()?;
        let place = |field: &str| FileLocation::Json(format!("materials[{index}].{field}"));
        match material.alpha_mode.as_deref() {
            None | Some("OPAQUE" | "MASK") => {}
            Some("BLEND") => warnings.add("materials with transparency shown opaque", || place("alphaMode")),
            Some(other) => {
                let detail = quoted(other);
                warnings.add("materials with an unknown alphaMode shown opaque", || {
                    super::place::place(format!("materials[{index}].alphaMode"), &detail)
                });
            }
        }
        let surface = &material.pbr_metallic_roughness;
        if material.extensions.specular_glossiness.is_some()
            && surface.base_color_factor.is_none()
            && surface.base_color_texture.is_none()
        {
            warnings.add("materials of specular and glossiness shown without colours", || {
                place("extensions.KHR_materials_pbrSpecularGlossiness")
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::version;

    #[test]
    fn versions_have_two_numbers() {
        for (text, expected) in [
            ("2.0", Some((2, 0))),
            (" 2.10 ", Some((2, 10))),
            ("3", Some((3, 0))),
            ("two", None),
            ("2.0.1", None),
            ("", None),
        ] {
            assert_eq!(version(text), expected, "{text}");
        }
    }
}
