//! Material libraries (MTL) of OBJ files: colours, diffuse textures and cut-outs. Never fails; problems become warnings.

use glam::Vec3;

use crate::budget::Budget;
use crate::scene::error::{FileLocation, Warnings};
use crate::scene::images::Images;
use crate::scene::material::{Material, WrapMode};

/// Bytes per material: in a list that doubles as it grows and in the list of the scene.
const BYTES_PER_MATERIAL: u64 = 4 * size_of::<Material>() as u64;

/// Maximum number of materials; more are taken for a mistake or an attack.
const MAX_MATERIALS: usize = 1 << 16;

/// The materials of a library, in file order.
pub(super) fn load(name: &str, images: &mut Images, warnings: &mut Warnings) -> Vec<Material> {
    let bytes = match images.read_relative(name) {
        Ok(bytes) => bytes,
        Err(reason) => {
            // One statement may name several libraries.
            let names: Vec<_> = name.split_whitespace().collect();
            if names.len() > 1 {
                return names.into_iter().flat_map(|name| load(name, images, warnings)).collect();
            }
            warnings.add(&format!("material library '{name}' not used: {reason}"), || FileLocation::File);
            return Vec::new();
        }
    };
    let text = String::from_utf8_lossy(&bytes);
    let mut materials: Vec<Material> = Vec::new();
    let mut next_poll = 0;
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        // Every line may define a material, which takes far more memory than the line.
        if number == next_poll {
            if images.token.is_cancelled() {
                break;
            }
            let bytes = (materials.len() as u64).saturating_mul(BYTES_PER_MATERIAL);
            if let Err(error) = Budget::of_process().check("the materials", bytes) {
                warnings.add(&format!("materials in '{name}' left out: {error}"), || FileLocation::File);
                break;
            }
            next_poll = number.saturating_add(4096);
        }
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            if materials.len() >= MAX_MATERIALS {
                warnings.add(&format!("materials in '{name}' beyond {MAX_MATERIALS} left out"), || FileLocation::File);
                break;
            }
            materials.push(Material { name: rest.to_owned(), base_color: Vec3::splat(0.6), ..Material::clay() });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "kd" => match color(rest) {
                Some(color) => material.base_color = color,
                None => warnings.add(&format!("colours in '{name}' not understood"), || FileLocation::File),
            },
            "ke" => material.emissive = color(rest).unwrap_or(Vec3::ZERO),
            "map_kd" => {
                material.base_color_texture = images.texture_from_file(file_name(rest), [WrapMode::Repeat; 2]);
                if material.base_color_texture.is_some() && material.base_color == Vec3::ZERO {
                    material.base_color = Vec3::ONE;
                }
            }
            "map_d" => material.alpha_cutoff = 0.5,
            _ => {}
        }
    }
    for material in &mut materials {
        if material.base_color_texture.is_none() {
            material.alpha_cutoff = 0.0;
        }
    }
    materials
}

/// A colour of one number (grey) or three.
fn color(text: &str) -> Option<Vec3> {
    let numbers: Result<Vec<f32>, _> = text.split_whitespace().take(3).map(str::parse).collect();
    let color = match numbers.ok()?[..] {
        [grey] => Vec3::splat(grey),
        [r, g, b] => Vec3::new(r, g, b),
        _ => return None,
    };
    color.is_finite().then(|| color.max(Vec3::ZERO))
}

/// The file name of a texture statement, after its options.
fn file_name(mut rest: &str) -> &str {
    while rest.starts_with('-') {
        let (option, mut after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let (min_values, max_values) = match option {
            "-mm" => (2, 2),
            "-o" | "-s" | "-t" => (1, 3),
            _ => (1, 1),
        };
        for k in 0..max_values {
            let (word, next) = after.trim_start().split_once(char::is_whitespace).unwrap_or((after.trim(), ""));
            if k >= min_values && word.parse::<f32>().is_err() {
                break;
            }
            after = next;
        }
        rest = after.trim_start();
    }
    rest.trim()
}
