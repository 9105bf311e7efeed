//! Materials and textures of PBRT scenes, as far as they have a colour.

use std::collections::HashMap;

use glam::{Affine2, Vec2, Vec3};

use super::parameters::{Parameter, Parameters, Values};
use crate::scene::assemble::Assembly;
use crate::scene::error::FileLocation;
use crate::scene::images::{Content, Images, TextureUse};
use crate::scene::material::{Material, WrapMode};
use crate::text::quoted;

/// Reflectance of metals at normal incidence, by the element in the names of their spectra: the values that are common in
/// physically based shading (Hoffman, *Crafting Physically Motivated Shading Models for Game Development*, 2010).
const METALS: [(&str, Vec3); 5] = [
    ("-CuZn-", Vec3::new(0.910, 0.778, 0.423)),
    ("-Cu-", Vec3::new(0.955, 0.638, 0.538)),
    ("-Au-", Vec3::new(1.0, 0.782, 0.344)),
    ("-Ag-", Vec3::new(0.972, 0.960, 0.915)),
    ("-Al-", Vec3::new(0.913, 0.922, 0.924)),
];

/// Names of the colour that a surface scatters, in versions 4 and 3 of the format.
const SCATTERED: [&str; 3] = ["reflectance", "Kd", "color"];

/// A colour, or an image that it multiplies.
#[derive(Clone, Copy)]
struct Picture {
    factor: Vec3,
    texture: Option<u32>,
}

/// The materials and textures so far.
pub(super) struct Surfaces<'a> {
    pub(super) images: Images<'a>,
    /// `None` for textures that cannot be shown, which was counted: materials keep their own colour.
    textures: HashMap<String, Option<Picture>>,
    /// Indices of named materials; `None` for one without a surface.
    named: HashMap<String, Option<u32>>,
    /// Indices of the materials of lamps, by those of their surfaces and the bits of what they emit.
    lamps: HashMap<(u32, [u32; 3]), u32>,
    /// Index of the material of shapes before any, once there is one.
    default: Option<u32>,
}

impl<'a> Surfaces<'a> {
    pub(super) fn new(images: Images<'a>) -> Self {
        Self { images, textures: HashMap::new(), named: HashMap::new(), lamps: HashMap::new(), default: None }
    }

    /// A statement `Texture`.
    pub(super) fn add_texture(
        &mut self,
        name: String,
        class: &str,
        parameters: &Parameters,
        place: &FileLocation,
        assembly: &mut Assembly,
    ) {
        let picture = match class {
            "imagemap" => self.image(parameters, place, assembly),
            "constant" => parameters.get("value").and_then(|value| self.picture_of(value, assembly)),
            "scale" => {
                let names = ["tex", "tex1", "scale", "tex2"];
                let parts = names.into_iter().filter_map(|name| self.picture_of(parameters.get(name)?, assembly));
                let multiply = |product: Picture, part: Picture| Picture {
                    factor: product.factor * part.factor,
                    texture: product.texture.or(part.texture),
                };
                parts.collect::<Vec<_>>().into_iter().reduce(multiply)
            }
            _ => {
                let what = format!("textures of the kind {} not shown", quoted(class));
                assembly.warnings.add(&what, || place.clone());
                None
            }
        };
        self.textures.insert(name, picture);
        if matches!(class, "imagemap" | "constant" | "scale") {
            parameters.count_unused("textures", &mut assembly.warnings);
        }
    }

    fn image(&mut self, parameters: &Parameters, place: &FileLocation, assembly: &mut Assembly) -> Option<Picture> {
        let number = |name: &str, default: f64| parameters.number(name).unwrap_or(default) as f32;
        let (scale_u, scale_v) = (number("uscale", 1.0), number("vscale", 1.0));
        let (move_u, move_v) = (number("udelta", 0.0), number("vdelta", 0.0));
        let wrap = match parameters.text("wrap") {
            Some("clamp") => WrapMode::ClampToEdge,
            Some("black") => {
                let what = "textures with black around them repeated";
                assembly.warnings.add(what, || place.clone());
                WrapMode::Repeat
            }
            _ => WrapMode::Repeat,
        };
        let is_linear = parameters.text("encoding") == Some("linear");
        let factor = Vec3::splat(number("scale", 1.0));
        let Some(file) = parameters.text("filename") else {
            assembly.warnings.add("textures without the name of an image", || place.clone());
            return None;
        };
        let image = self.images.texture_named(file, Content::Texels, || place.clone())?;
        // v points up in the file and down here.
        let uv_transform = Affine2::from_scale_angle_translation(
            Vec2::new(scale_u, scale_v),
            0.0,
            Vec2::new(move_u, 1.0 - scale_v - move_v),
        );
        let texture = self.images.variant(image, TextureUse { wrap: [wrap; 2], uv_transform, uv_set: 0, is_linear });
        Some(Picture { factor, texture })
    }

    /// The colour of a parameter, whether it is one or names a texture.
    fn picture_of(&self, parameter: &Parameter, assembly: &mut Assembly) -> Option<Picture> {
        match &parameter.values {
            Values::Texts(texts) if parameter.kind == "texture" => {
                let name = texts.first().map_or("", String::as_str);
                self.textures.get(name).copied().unwrap_or_else(|| {
                    let kind = ["uses of the texture ", " without a definition left out"];
                    assembly.warnings.add_named(kind, name, || parameter.place().clone());
                    None
                })
            }
            _ => color(parameter, assembly).map(|factor| Picture { factor, texture: None }),
        }
    }

    /// The first colour of these names.
    fn picture(&self, parameters: &Parameters, names: &[&str], assembly: &mut Assembly) -> Option<Picture> {
        names.iter().find_map(|name| self.picture_of(parameters.get(name)?, assembly))
    }

    /// A statement `MakeNamedMaterial`.
    pub(super) fn add_named(
        &mut self,
        name: String,
        parameters: &Parameters,
        place: &FileLocation,
        assembly: &mut Assembly,
    ) {
        let class = parameters.text("type").unwrap_or_default().to_owned();
        let material = self.add(&class, parameters, place, assembly);
        self.named.insert(name, material);
    }

    /// Index of a named material; `None` for one without a surface.
    pub(super) fn named(&self, name: &str, place: &FileLocation, assembly: &mut Assembly) -> Option<u32> {
        self.named.get(name).copied().unwrap_or_else(|| {
            let kind = ["materials ", " without a definition shown in clay"];
            assembly.warnings.add_named(kind, name, || place.clone());
            Some(push(assembly, Material::clay()))
        })
    }

    /// Index of a new material; `None` for one without a surface.
    pub(super) fn add(
        &mut self,
        class: &str,
        parameters: &Parameters,
        place: &FileLocation,
        assembly: &mut Assembly,
    ) -> Option<u32> {
        let mut material = Material { base_color: Vec3::splat(0.5), specular: Vec3::ZERO, ..Material::clay() };
        let scattered = self.picture(parameters, &SCATTERED, assembly);
        let is_metal = matches!(class, "conductor" | "coatedconductor" | "metal" | "mirror");
        match class {
            "" | "interface" | "none" => return None,
            "diffuse" | "matte" => {}
            "coateddiffuse" | "plastic" | "substrate" | "uber" | "disney" => material.specular = Material::DIELECTRIC,
            "diffusetransmission" | "translucent" => material.base_color = Vec3::splat(0.25),
            "mix" => return Some(self.mix(parameters, place, assembly)),
            "dielectric" | "thindielectric" | "glass" => {
                material.base_color = Vec3::ONE;
                material.specular = Material::DIELECTRIC;
                material.transmission = 1.0;
                // Thin glass does not refract.
                for name in ["eta", "Kr", "Kt"] {
                    let _ = parameters.get(name);
                }
            }
            _ if is_metal => {
                material.metallic = 1.0;
                let element = parameters.text("eta").or_else(|| parameters.text("conductor.eta")).unwrap_or("-Cu-");
                let known = METALS.iter().find(|(name, _)| element.contains(name)).map(|(_, color)| *color);
                material.base_color =
                    if class == "mirror" { Vec3::splat(0.9) } else { known.unwrap_or(Vec3::splat(0.7)) };
                // The extinction belongs to the same element.
                for name in ["k", "conductor.k", "Kr"] {
                    let _ = parameters.get(name);
                }
            }
            _ => {
                let what = format!("materials of the kind {} shown without what is special of them", quoted(class));
                assembly.warnings.add(&what, || place.clone());
            }
        }
        if let Some(Picture { factor, texture }) = scattered {
            (material.base_color, material.base_color_texture) = (factor, texture);
        }
        if material.specular != Vec3::ZERO || is_metal {
            material.roughness = roughness(parameters);
        }
        if let Some(file) = parameters.text("normalmap") {
            let image = self.images.texture_named(file, Content::Texels, || place.clone());
            material.normal_texture = image.and_then(|image| self.images.variant(image, TextureUse::repeated(true)));
        }
        parameters.count_unused("materials", &mut assembly.warnings);
        Some(push(assembly, material))
    }

    /// The first of the materials that are mixed.
    fn mix(&mut self, parameters: &Parameters, place: &FileLocation, assembly: &mut Assembly) -> u32 {
        assembly.warnings.add("mixtures of materials shown as their first", || place.clone());
        let first = parameters.text("materials").or_else(|| parameters.text("namedmaterial1"));
        let first = first.and_then(|name| self.named(name, place, assembly));
        first.unwrap_or_else(|| push(assembly, Material::clay()))
    }

    /// Index of the material of shapes before any.
    pub(super) fn default(&mut self, assembly: &mut Assembly) -> u32 {
        let matte = || Material { base_color: Vec3::splat(0.5), ..Material::clay() };
        *self.default.get_or_insert_with(|| push(assembly, matte()))
    }

    /// Index of a material that also emits light.
    pub(super) fn lamp(&mut self, material: u32, emission: Vec3, assembly: &mut Assembly) -> u32 {
        let key = (material, emission.to_array().map(f32::to_bits));
        *self.lamps.entry(key).or_insert_with(|| {
            let surface = assembly.materials.get(material as usize).cloned().unwrap_or_else(Material::clay);
            push(assembly, Material { emissive: emission, ..surface })
        })
    }
}

/// Appends a material and returns its index.
fn push(assembly: &mut Assembly, material: Material) -> u32 {
    let index = u32::try_from(assembly.materials.len()).unwrap_or(u32::MAX);
    assembly.materials.push(material);
    index
}

/// Linear RGB of a parameter that is a colour or a spectrum.
pub(super) fn color(parameter: &Parameter, assembly: &mut Assembly) -> Option<Vec3> {
    let Values::Numbers(numbers) = &parameter.values else { return None };
    let color = match (parameter.kind.as_str(), &numbers[..]) {
        ("rgb" | "color", &[r, g, b]) => Vec3::new(r as f32, g as f32, b as f32),
        ("float" | "spectrum", &[value]) => Vec3::splat(value as f32),
        ("spectrum", pairs) => {
            // Wavelengths and values in turn.
            let values = pairs.iter().skip(1).step_by(2);
            assembly.warnings.add("colours by wavelength shown in grey", || parameter.place().clone());
            Vec3::splat((values.clone().sum::<f64>() / values.count().max(1) as f64) as f32)
        }
        ("blackbody", _) => {
            assembly.warnings.add("lights of a temperature shown white", || parameter.place().clone());
            Vec3::ONE
        }
        _ => return None,
    };
    Some(color.max(Vec3::ZERO)).filter(|color| color.is_finite())
}

/// Perceptual roughness: the square root of the width of the microfacets, which is itself the root of the number in the file
/// unless that says otherwise.
fn roughness(parameters: &Parameters) -> f32 {
    let number = |name: &str| parameters.number(name);
    let along_u = ["uroughness", "conductor.roughness", "roughness"].into_iter().find_map(number).unwrap_or(0.0);
    let along = number("vroughness").map_or(along_u, |along_v| f64::midpoint(along_u, along_v));
    let is_remapped = parameters.text("remaproughness").is_none_or(|word| word == "true");
    let width = if is_remapped { along.max(0.0).sqrt() } else { along.max(0.0) };
    (width.sqrt() as f32).clamp(0.0, 1.0)
}
