//! Cameras of a glTF file, which are offered as views.

use std::f64::consts::FRAC_PI_4;

use glam::{DMat4, DVec3};
use serde_json::{Map, Value};

use crate::scene::assemble::Assembly;
use crate::scene::error::FileLocation;
use crate::scene::file_camera::Lens;

/// A camera and the nodes that carry it.
pub(super) struct Camera {
    name: String,
    /// Vertical field of view in radians, of a perspective camera.
    fov_y: Option<f64>,
    /// Half the height of the view, of an orthographic camera.
    half_height: Option<f64>,
    nodes: Vec<usize>,
}

/// Takes the cameras out of a repaired document, with the indices that name them.
pub(super) fn take(document: &mut Map<String, Value>) -> Vec<Camera> {
    let list = document.remove("cameras");
    let camera = |value: &Value| {
        let number = |kind: &str, field: &str| value.get(kind)?.get(field)?.as_f64();
        Camera {
            name: value.get("name").and_then(Value::as_str).unwrap_or_default().to_owned(),
            fov_y: number("perspective", "yfov"),
            half_height: number("orthographic", "ymag").map(f64::abs).filter(|&half| half > 0.0),
            nodes: Vec::new(),
        }
    };
    let mut cameras: Vec<Camera> = list.iter().filter_map(Value::as_array).flatten().map(camera).collect();
    let nodes = document.get_mut("nodes").and_then(Value::as_array_mut);
    for (index, node) in nodes.into_iter().flatten().enumerate() {
        let camera = node.as_object_mut().and_then(|node| node.remove("camera")?.as_u64());
        let camera = camera.and_then(|camera| cameras.get_mut(usize::try_from(camera).ok()?));
        if let Some(camera) = camera {
            camera.nodes.push(index);
        }
    }
    cameras
}

/// Adds each camera, wherever a node of the scene carries it, which is where `worlds` has the node's transform. It looks along -z, with
/// y up.
pub(super) fn place(cameras: &[Camera], worlds: &[Option<DMat4>], assembly: &mut Assembly) {
    for (index, camera) in cameras.iter().enumerate() {
        let worlds = || camera.nodes.iter().filter_map(|&node| worlds.get(node).copied().flatten());
        let is_sound = camera.fov_y.is_some() || camera.half_height.is_some();
        if !is_sound || worlds().next().is_none() {
            let what = "cameras without a view or a place in the scene left out";
            assembly.warnings.add(what, || FileLocation::Json(format!("cameras[{index}]")));
            continue;
        }
        assembly.lenses.extend(worlds().map(|world: DMat4| Lens {
            name: camera.name.clone(),
            eye: world.transform_point3(DVec3::ZERO),
            forward: world.transform_vector3(DVec3::NEG_Z),
            up: world.transform_vector3(DVec3::Y),
            fov_y: camera.fov_y.unwrap_or(FRAC_PI_4),
            half_height: if camera.fov_y.is_some() { None } else { camera.half_height },
            distance: None,
        }));
    }
}
