//! The version and the extensions that a file announces, and contents that no scene here holds.

use std::path::Path;

use gltf::material::AlphaMode;
use serde_json::{Map, Value};

use super::table::extension;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::images::{READS_KTX2, UNPACK_TEXTURES};
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Remedy for unknown extensions.
const UNPACK: &str = "convert the file with 'gltf-transform optimize --compress false --texture-compress false IN OUT'";

/// Remedy for glTF 1.0.
pub(super) const UPGRADE: &str = "convert it with 'gltf-pipeline -i IN -o OUT', or export the model as glTF 2.0";

/// A version "major.minor".
fn version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.trim().split_once('.').unwrap_or((text.trim(), "0"));
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Refuses versions that cannot be read as glTF 2.0.
pub(super) fn check_version(
    path: &Path,
    document: &Map<String, Value>,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let refuse = |field: &str, problem: String, advice: &str| {
        Err(LoadError::at(path, FileLocation::Json(format!("asset.{field}")), problem, advice))
    };
    let asset = document.get("asset");
    let text = |field: &str| asset.and_then(|asset| asset.get(field)?.as_str());
    let Some(label) = text("version") else {
        let problem = "is missing, so this is not glTF 2.0".to_owned();
        return refuse("version", problem, "export the model as glTF 2.0");
    };
    let too_new = "export the model as glTF 2.0, or look for a newer version of this program";
    let minimum = text("minVersion").and_then(|label| Some((version(label)?, label)));
    if let Some((needed, label)) = minimum
        && needed > (2, 0)
    {
        let problem = format!("is {}: a reader of at least that version is needed, this one reads 2.0", quoted(label));
        return refuse("minVersion", problem, too_new);
    }
    match version(label) {
        Some((2, 0)) => {}
        Some((0 | 1, _)) => {
            let problem = format!("is {}, only glTF 2.0 is read", quoted(label));
            return refuse("version", problem, UPGRADE);
        }
        Some(found) if found.0 > 2 && minimum.is_none() => {
            let problem = format!("is {}, only glTF 2.0 is read", quoted(label));
            return refuse("version", problem, too_new);
        }
        _ => warnings
            .add("versions other than 2.0 read as 2.0", || FileLocation::in_json("asset.version", quoted(label))),
    }
    Ok(())
}

/// Checks that every required extension is supported.
pub(super) fn check_extensions(path: &Path, document: &Map<String, Value>) -> Result<(), LoadError> {
    const SUPPORTED: [&str; 10] = [
        "KHR_mesh_quantization",
        extension::TRANSFORM,
        extension::INSTANCING,
        extension::LIGHTS,
        extension::POINTER,
        extension::VISIBILITY,
        extension::WEBP,
        extension::DRACO,
        extension::MESHOPT[0],
        extension::MESHOPT[1],
    ];
    let required = document.get("extensionsRequired").and_then(Value::as_array);
    for (index, name) in required.into_iter().flatten().filter_map(Value::as_str).enumerate() {
        let reads_textures = READS_KTX2 && name == extension::BASISU;
        if reads_textures || SUPPORTED.contains(&name) || name.starts_with("KHR_materials_") {
            continue;
        }
        let (what, advice) = match name {
            extension::BASISU => ("KTX2 textures", UNPACK_TEXTURES),
            "EXT_texture_avif" => ("AVIF textures", "convert them with 'gltf-transform png IN OUT'"),
            _ => ("something unknown to this program", UNPACK),
        };
        let problem = format!("the extension {} is required but not supported: {what}", quoted(name));
        return Err(LoadError::at(path, FileLocation::Json(format!("extensionsRequired[{index}]")), problem, advice));
    }
    Ok(())
}

/// Counts what the file announces and no scene here holds.
pub(super) fn warn(document: &gltf::Document, warnings: &mut Warnings, token: &CancelToken) -> Result<(), Cancelled> {
    for (index, material) in document.materials().enumerate() {
        token.check()?;
        let place = |field: &str| FileLocation::Json(format!("materials[{index}].{field}"));
        let transmission = material.extension_value(extension::TRANSMISSION);
        if transmission.is_some_and(|value| value.get("transmissionTexture").is_some()) {
            warnings.add("materials shown as glass everywhere instead of by their texture", || {
                place("extensions.KHR_materials_transmission.transmissionTexture")
            });
        }
        if material.alpha_mode() == AlphaMode::Blend {
            warnings.add("materials with transparency shown opaque", || place("alphaMode"));
        }
        let surface = material.pbr_metallic_roughness();
        if material.extension_value(extension::SPECULAR_GLOSSINESS).is_some()
            && surface.base_color_factor() == [1.0; 4]
            && surface.base_color_texture().is_none()
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
