//! Skins: a vertex stands where the joints that hold it are, and not where the node of its mesh is.

use glam::{DMat4, Mat4};
use gltf::accessor::{DataType, Dimensions};

use super::accessor::{AccessorError, Accessors, WRONG_TYPE};
use super::document::Fault;
use super::primitive::Primitive;
use crate::scene::error::{FileLocation, Warnings};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// From mesh space to the world by each joint, in the pose of the nodes; `None`, with a warning, where the skin cannot be read.
pub(super) fn joint_transforms<'a>(
    skin: &gltf::Skin<'a>,
    worlds: &[Option<DMat4>],
    accessors: &Accessors<'a>,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Option<Vec<DMat4>>, Cancelled> {
    let count = skin.joints().len();
    let inverse = skin.inverse_bind_matrices().map(|json| -> Result<_, AccessorError> {
        let accessor = accessors.open_any(&json, token)?;
        if json.dimensions() != Dimensions::Mat4 || accessor.component != DataType::F32 || accessor.count < count {
            let detail = format!("accessors[{}]: no {count} matrices of floats", json.index());
            return Err(Fault::new(WRONG_TYPE, detail).into());
        }
        Ok(accessor)
    });
    let fault = match inverse.transpose() {
        Ok(inverse) => {
            let bind = |k| inverse.as_ref().map_or(Mat4::IDENTITY, |list| Mat4::from_cols_array(&list.element(k)));
            let joints = skin.joints().enumerate();
            let transforms: Option<Vec<DMat4>> =
                joints.map(|(k, joint)| Some((*worlds.get(joint.index())?)? * bind(k).as_dmat4())).collect();
            match transforms {
                // The entry for skins that do not exist has no joints.
                Some(transforms) => return Ok(Some(transforms).filter(|transforms| !transforms.is_empty())),
                None => Fault::new("joints outside the scene", ""),
            }
        }
        Err(AccessorError::Unreadable(fault)) => fault,
        Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
    };
    let what = format!("skeletons left out: {}", fault.kind);
    warnings.add(&what, || FileLocation::in_json(format!("skins[{}]", skin.index()), &fault.detail));
    Ok(None)
}

/// The transform of vertex `k` by its joints; that of the first joint where nothing holds it.
pub(super) fn blend(primitive: &Primitive, transforms: &[Mat4], k: usize) -> Mat4 {
    let joints = primitive.joints.get(k).copied().unwrap_or_default();
    let weights = primitive.weights.get(k).copied().unwrap_or_default();
    let held = joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
    let (mut sum, mut total) = (Mat4::ZERO, 0.0);
    for (joint, weight) in held {
        let Some(transform) = transforms.get(joint as usize) else { continue };
        sum += *transform * weight;
        total += weight;
    }
    if total > 0.0 { sum * (1.0 / total) } else { transforms.first().copied().unwrap_or_default() }
}
