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
/// Largest joint weight, of which there are at most eight a vertex.
const MAX_WEIGHT: f32 = 1e37;
/// How far the weights of a vertex may be from adding up to 1: those of eight bits are rounded.
const WEIGHTS_SLACK: f32 = 0.05;
/// Bytes of a vertex in a morph target.
const TARGET_BYTES: u64 = 3 * size_of::<Vec3>() as u64;

/// The joints that hold each vertex, and their shares: one list for each set of four; none without a skin.
pub(super) fn holds(attributes: &mut Attributes) -> Result<Vec<Vec<Hold>>, Cancelled> {
    let mut sets = Vec::new();
    for set in 0..MAX_SETS {
        let [of_joints, of_weights] = [Semantic::Joints(set), Semantic::Weights(set)];
        // Draco decodes them as floats, whatever the file says.
        let declared = attributes.json.get(&of_joints).map(|json| json.data_type());
        let is_whole = matches!(declared, Some(DataType::U8 | DataType::U16));
        let is_joint = |accessor: &Accessor| accessor.width == 4 && is_whole && !accessor.normalized;
        let joints = attributes.open(&of_joints, "joints", is_joint)?;
        let weights = attributes.open(&of_weights, "weights", |found| found.width == 4 && is_unit(found))?;
        for (own, other) in [(&of_joints, &of_weights), (&of_weights, &of_joints)] {
            if attributes.json.get(own).is_some() && attributes.json.get(other).is_none() {
                let what = "primitives shown without joints or weights that are there alone".to_owned();
                attributes.faults.push((1, what, at(&format!("attributes.{}", own.to_string()), "")));
            }
        }
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        let gather = attributes.gather;
        let joints = gather.all(&joints, |joints: [f32; 4]| joints.map(|joint| joint as u16))?;
        let weights = gather.all(&weights, |weights: [f32; 4]| weights)?;
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
    let mut faults = [0_u64; 3];
    for vertex in 0..attributes.gather.len() {
        attributes.gather.token.check_every(crate::scene::assemble::BATCH_SIZE, vertex)?;
        let [bad, none, uneven] = share_weights(sets.iter_mut().map(|set| &mut set[vertex]));
        for (count, is_faulty) in faults.iter_mut().zip([bad, none, uneven]) {
            *count = count.saturating_add(u64::from(is_faulty));
        }
    }
    let kinds = [
        "vertices with joint weights that are negative or no numbers, which count as 0",
        "vertices without a joint weight held by the first joint",
        "vertices whose joint weights do not add up to 1 held by each in proportion",
    ];
    for (count, kind) in faults.into_iter().zip(kinds) {
        if count > 0 {
            attributes.faults.push((count, kind.to_owned(), at("attributes.WEIGHTS_0", "")));
        }
    }
    Ok(sets)
}

/// Makes shares of the weights of a vertex. Whether some were negative or no numbers, none was above 0, or the sum was not 1.
fn share_weights<'a>(holds: impl Iterator<Item = &'a mut Hold>) -> [bool; 3] {
    let mut holds: arrayvec::ArrayVec<&mut Hold, { MAX_SETS as usize }> = holds.collect();
    let (mut is_bad, mut total) = (false, 0.0_f32);
    for hold in &mut holds {
        for weight in &mut hold.weights {
            if !(weight.is_finite() && *weight >= 0.0) {
                (is_bad, *weight) = (true, 0.0);
            }
            // So that the sum is a number.
            *weight = weight.min(MAX_WEIGHT);
            total += *weight;
        }
    }
    share(holds.into_iter(), total);
    [is_bad, total == 0.0 && !is_bad, total > 0.0 && !is_bad && (total - 1.0).abs() > WEIGHTS_SLACK]
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
