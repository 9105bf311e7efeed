//! Copies of a node's mesh by EXT_mesh_gpu_instancing.

use glam::{Mat4, Quat, Vec3};
use serde_json::Value;

use super::accessor::{Accessor, AccessorError, Accessors, WRONG_TYPE};
use super::document::Fault;
use super::table::extension;
use super::transform::rotation;
use crate::scene::error::{FileLocation, Warnings};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The transforms of a node's copies, which are read one by one.
pub(super) enum Instances<'a> {
    /// The mesh as it is.
    One,
    /// Copies by the extension.
    Many {
        /// Number of copies.
        count: usize,
        /// Translations, rotations and scales.
        parts: Box<[Option<Accessor<'a>>; 3]>,
    },
}

impl Instances<'_> {
    /// Number of copies.
    pub(super) fn count(&self) -> usize {
        match self {
            Self::One => 1,
            Self::Many { count, .. } => *count,
        }
    }

    /// The transform of copy `k`, to be applied before the node's.
    pub(super) fn transform(&self, k: usize) -> Mat4 {
        let Self::Many { parts, .. } = self else { return Mat4::IDENTITY };
        let [translations, rotations, scales] = &**parts;
        let element = |part: &Option<Accessor>| part.as_ref().filter(|part| k < part.count).map(|part| part.element(k));
        let vector = |[x, y, z, _]: [f32; 4]| Vec3::new(x, y, z);
        Mat4::from_scale_rotation_translation(
            element(scales).map_or(Vec3::ONE, vector),
            element(rotations).map_or(Quat::IDENTITY, |numbers: [f32; 4]| rotation(numbers.map(f64::from)).as_quat()),
            element(translations).map_or(Vec3::ZERO, vector),
        )
    }
}

/// The copies of a node; those that cannot be read are left out with a warning.
pub(super) fn read<'a>(
    node: &gltf::Node<'a>,
    document: &'a gltf::Document,
    accessors: &Accessors<'a>,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Instances<'a>, Cancelled> {
    let Some(instancing) = node.extension_value(extension::INSTANCING) else { return Ok(Instances::One) };
    let place = |field: &str, detail: &str| {
        let path = format!("nodes[{}].extensions.EXT_mesh_gpu_instancing{field}", node.index());
        FileLocation::in_json(path, detail)
    };
    let attribute = |name: &str| {
        let index = instancing.get("attributes").and_then(|attributes| attributes.get(name)).and_then(Value::as_u64);
        document.accessors().nth(usize::try_from(index?).ok()?)
    };
    let mut parts = [None, None, None];
    for (part, (name, width)) in parts.iter_mut().zip([("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)]) {
        let Some(json) = attribute(name) else { continue };
        let fault = match accessors.open(&json, token) {
            Ok(accessor) if accessor.width == width => {
                *part = Some(accessor);
                continue;
            }
            Ok(found) => {
                let detail = format!("accessors[{}]: {} components instead of {width}", json.index(), found.width);
                Fault::new(WRONG_TYPE, detail)
            }
            Err(AccessorError::Unreadable(fault)) => fault,
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
        };
        let what = format!("lists of instances left out: {}", fault.kind);
        warnings.add(&what, || place(&format!(".attributes.{name}"), &fault.detail));
    }
    let counts = parts.iter().flatten().map(|part| part.count);
    let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    if least != most {
        let missing = most.saturating_sub(least) as u64;
        let detail = format!("{least} and {most}");
        warnings.add_many(missing, "instances without all of translation, rotation and scale", || {
            place(".attributes", &detail)
        });
    }
    if most == 0 {
        warnings.add("nodes without any of the announced instances left out", || place("", ""));
    }
    Ok(Instances::Many { count: most, parts: Box::new(parts) })
}
