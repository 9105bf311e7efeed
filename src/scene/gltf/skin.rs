//! Skins: a vertex is where the joints that hold it are, and not where the node of its mesh is.

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DMat4, Mat4};
use gltf::accessor::{DataType, Dimensions};

use super::accessor::{AccessorError, Accessors, WRONG_TYPE};
use super::document::Fault;
use crate::scene::error::{FileLocation, Warnings};
use crate::text::counted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A skin that has at least one joint, all of them in the scene.
pub(super) struct Skin {
    /// Nodes of the joints.
    pub(super) joints: Vec<usize>,
    /// From mesh space to that of each joint.
    pub(super) inverse_bind: Vec<DMat4>,
}

impl Skin {
    /// From mesh space to the world by each joint.
    pub(super) fn transforms(&self, worlds: &[Option<DMat4>]) -> Vec<DMat4> {
        let world = |joint: usize| worlds.get(joint).copied().flatten().unwrap_or_default();
        self.joints.iter().zip(&self.inverse_bind).map(|(&joint, inverse)| world(joint) * *inverse).collect()
    }
}

/// The skins that were read so far, by index; `None` for those that cannot be.
#[derive(Default)]
pub(super) struct Skins(HashMap<usize, Option<Rc<Skin>>>);

impl Skins {
    /// A skin; `None`, with a warning, where it cannot be read.
    pub(super) fn get<'a>(
        &mut self,
        skin: &gltf::Skin<'a>,
        worlds: &[Option<DMat4>],
        accessors: &Accessors<'a>,
        warnings: &mut Warnings,
        token: &CancelToken,
    ) -> Result<Option<Rc<Skin>>, Cancelled> {
        if let Some(known) = self.0.get(&skin.index()) {
            return Ok(known.clone());
        }
        let found = match read(skin, worlds, accessors, warnings, token) {
            // The entry for skins that do not exist has no joints.
            Ok(skin) => Some(Rc::new(skin)).filter(|skin| !skin.joints.is_empty()),
            Err(AccessorError::Unreadable(fault)) => {
                let what = format!("skeletons left out: {}", fault.kind);
                warnings.add(&what, || FileLocation::in_json(format!("skins[{}]", skin.index()), &fault.detail));
                None
            }
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
        };
        self.0.insert(skin.index(), found.clone());
        Ok(found)
    }
}

fn read<'a>(
    skin: &gltf::Skin<'a>,
    worlds: &[Option<DMat4>],
    accessors: &Accessors<'a>,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Skin, AccessorError> {
    let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
    let count = joints.len();
    let inverse = skin.inverse_bind_matrices().map(|json| -> Result<_, AccessorError> {
        let accessor = accessors.open_any(&json, token)?;
        if json.dimensions() != Dimensions::Mat4 || accessor.component != DataType::F32 {
            let detail = format!("accessors[{}]: no matrices of floats", json.index());
            return Err(Fault::new(WRONG_TYPE, detail).into());
        }
        Ok(accessor)
    });
    let inverse = inverse.transpose()?;
    let given = inverse.as_ref().map_or(count, |list| list.count);
    let lacking = count.saturating_sub(given) as u64;
    warnings.add_many(lacking, "joints without an inverse bind matrix, in place of which stands the identity", || {
        let detail = format!("{} for {}", counted(given as u64, "matrices"), counted(count as u64, "joints"));
        FileLocation::in_json(format!("skins[{}].inverseBindMatrices", skin.index()), detail)
    });
    let bind = |k| match &inverse {
        Some(list) if k < list.count => Mat4::from_cols_array(&list.element(k)),
        _ => Mat4::IDENTITY,
    };
    let inverse_bind: Vec<DMat4> = (0..count).map(|k| bind(k).as_dmat4()).collect();
    if let Some(joint) = inverse_bind.iter().position(|matrix| !matrix.is_finite()) {
        return Err(Fault::new("matrices that are not finite", format!("the one of joints[{joint}]")).into());
    }
    if joints.iter().any(|&joint| worlds.get(joint).is_none_or(Option::is_none)) {
        return Err(Fault::new("joints outside the scene", "").into());
    }
    Ok(Skin { joints, inverse_bind })
}
