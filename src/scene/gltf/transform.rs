//! Transforms of nodes and copies, in double precision.

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use crate::scene::motion::Local;

/// The transform of a node in repaired JSON, in double precision.
pub(super) fn local(node: &Value) -> Local {
    Local {
        scale: numbers(node.get("scale")).map_or(DVec3::ONE, DVec3::from_array),
        rotation: numbers(node.get("rotation")).map_or(DQuat::IDENTITY, rotation),
        translation: numbers(node.get("translation")).map_or(DVec3::ZERO, DVec3::from_array),
        matrix: numbers(node.get("matrix")).map(|matrix| DMat4::from_cols_array(&matrix)),
    }
}

/// The `N` numbers of a list.
pub(super) fn numbers<const N: usize>(list: Option<&Value>) -> Option<[f64; N]> {
    let numbers: Vec<f64> = list?.as_array()?.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}

/// The rotation by a quaternion, which is normalised first; none if it has no direction.
pub(super) fn rotation(numbers: [f64; 4]) -> DQuat {
    let quaternion = DQuat::from_array(numbers);
    let length = quaternion.length();
    if length > 0.0 && length.is_finite() { quaternion / length } else { DQuat::IDENTITY }
}
