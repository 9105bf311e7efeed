//! Joints and morph targets of a primitive, which move its vertices.

use glam::Vec3;
use gltf::Semantic;
use gltf::accessor::DataType;

use super::accessor::Accessor;
use super::attributes::{Attributes, at, is_unit, reserve_memory};
use crate::scene::motion::{Hold, MorphTarget, share};
use bvhscope_engine::cancel::Cancelled;

/// Sets of four joints that are read; files with more are not known.
const MAX_SETS: u32 = 2;
/// Bytes of a vertex in a morph target.
const TARGET_BYTES: u64 = 3 * size_of::<Vec3>() as u64;

/// The joints that hold each vertex, and their shares: one list for each set of four; none without a skin.
pub(super) fn holds(attributes: &mut Attributes) -> Result<Vec<Vec<Hold>>, Cancelled> {
    let is_joint = |accessor: &Accessor| {
        // Those that Draco has compressed were decoded as floats.
        let is_whole = matches!(accessor.component, DataType::U8 | DataType::U16 | DataType::F32);
        accessor.width == 4 && is_whole && !accessor.normalized
    };
    let mut sets = Vec::new();
    for set in 0..MAX_SETS {
        let joints = attributes.open(&Semantic::Joints(set), "joints", is_joint)?;
        let weights =
            attributes.open(&Semantic::Weights(set), "weights", |found| found.width == 4 && is_unit(found))?;
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        let gather = attributes.gather;
        let joints = gather.all(&joints, |joints: [f32; 4]| joints.map(|joint| joint as u16))?;
        // Of a negative share, or of one that is no number, nothing is left.
        let weights =
            gather.all(&weights, |weights: [f32; 4]| weights.map(|weight| weight.clamp(0.0, f32::MAX).max(0.0)))?;
        sets.push(
            joints.into_iter().zip(weights).map(|(joints, weights)| Hold { joints, weights }).collect::<Vec<_>>(),
        );
    }
    if attributes.json.get(&Semantic::Joints(MAX_SETS)).is_some() {
        let what = format!("primitives whose joints beyond the first {} of a vertex are ignored", 4 * MAX_SETS);
        attributes.faults.push((1, what, at(&format!("attributes.JOINTS_{MAX_SETS}"), "")));
    }
    if sets.is_empty() {
        return Ok(sets);
    }
    for vertex in 0..attributes.gather.len() {
        if vertex.is_multiple_of(crate::scene::assemble::BATCH_SIZE) {
            attributes.gather.token.check()?;
        }
        let total = sets.iter().flat_map(|set| set[vertex].weights).sum();
        share(sets.iter_mut().map(|set| &mut set[vertex]), total);
    }
    Ok(sets)
}

/// The morph targets; those that cannot be read move nothing.
pub(super) fn targets<'a>(
    attributes: &mut Attributes<'a, '_>,
    has_tangents: bool,
) -> Result<Vec<MorphTarget>, Cancelled> {
    let mut targets = Vec::new();
    let is_vector = |accessor: &Accessor| accessor.width == 3 && accessor.component != DataType::U32;
    for (index, json) in attributes.json.morph_targets().enumerate() {
        let gather = attributes.gather;
        gather.token.check()?;
        if let Err(fault) = reserve_memory("the morph targets of one primitive", gather.len(), TARGET_BYTES) {
            let lost = format!("morph targets left out: {}", fault.kind);
            attributes.faults.push((1, lost, at(&format!("targets[{index}]"), &fault.detail)));
            break;
        }
        let mut vectors = |accessor: Option<gltf::Accessor<'a>>, name: &str| -> Result<Vec<Vec3>, Cancelled> {
            let Some(json) = accessor else { return Ok(Vec::new()) };
            let place = format!("targets[{index}].{name}");
            let what = ["elements of morph targets", "morph targets left out"];
            let found = attributes.open_accessor(&json, &place, what, is_vector)?;
            found.map_or(Ok(Vec::new()), |found| gather.all(&found, |[x, y, z]| Vec3::new(x, y, z)))
        };
        let positions = vectors(json.positions(), "POSITION")?;
        let normals = vectors(json.normals(), "NORMAL")?;
        // Of surfaces without tangents they change nothing.
        let tangents = if has_tangents { vectors(json.tangents(), "TANGENT")? } else { Vec::new() };
        targets.push(MorphTarget { positions, normals, tangents });
    }
    Ok(targets)
}
