//! Cameras of a glTF file, which are offered as views, and its lights (KHR_lights_punctual).

use std::f64::consts::FRAC_PI_4;

use glam::{DMat4, DVec3};
use serde_json::{Map, Value};

use super::table::{LIGHTS_LIST, extension};
use super::transform::numbers;
use crate::scene::assemble::Assembly;
use crate::scene::error::FileLocation;
use crate::scene::file_camera::Lens;
use crate::scene::file_light::Lamp;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A camera and the nodes that carry it.
pub(super) struct Camera {
    name: String,
    /// Vertical field of view in radians, of a perspective camera.
    fov_y: Option<f64>,
    /// Half the height of the view, of an orthographic camera.
    half_height: Option<f64>,
    pub(super) nodes: Vec<usize>,
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

/// Adds each light, wherever a node of the scene carries it.
pub(super) fn place_lights(
    document: &gltf::Document,
    worlds: &[Option<DMat4>],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let list = document.extension_value(extension::LIGHTS).and_then(|all| all.get(LIGHTS_LIST)?.as_array());
    let Some(list) = list else { return Ok(()) };
    let mut is_placed = vec![false; list.len()];
    for (node, world) in document.nodes().zip(worlds) {
        token.check()?;
        let carried = node.extension_value(extension::LIGHTS).and_then(|carried| carried.get("light")?.as_u64());
        let Some(index) = carried.and_then(|index| usize::try_from(index).ok()) else { continue };
        if let (Some(light), Some(is_placed), Some(world)) = (list.get(index), is_placed.get_mut(index), world) {
            assembly.lamps.extend(lamp(light, *world));
            *is_placed = true;
        }
    }
    for (index, light) in list.iter().enumerate() {
        token.check()?;
        if !is_placed[index] && light.get("type").is_some() {
            let place = || FileLocation::Json(format!("extensions.{}.{LIGHTS_LIST}[{index}]", extension::LIGHTS));
            assembly.warnings.add("lights without a place in the scene left out", place);
        }
    }
    Ok(())
}

/// A light at the place of a node; `None` for one of an unknown type, which was counted.
fn lamp(light: &Value, world: DMat4) -> Option<Lamp> {
    let kind = light.get("type").and_then(Value::as_str)?;
    let number = |value: Option<&Value>| value.and_then(Value::as_f64);
    let angle = |name: &str| number(light.get("spot").and_then(|spot| spot.get(name)));
    let color = numbers(light.get("color")).map_or(DVec3::ONE, DVec3::from_array);
    Some(Lamp {
        name: light.get("name").and_then(Value::as_str).unwrap_or_default().to_owned(),
        color: color * number(light.get("intensity")).unwrap_or(1.0),
        world,
        is_directional: kind == "directional",
        cone: (kind == "spot")
            .then(|| [angle("innerConeAngle").unwrap_or(0.0), angle("outerConeAngle").unwrap_or(FRAC_PI_4)]),
        range: number(light.get("range")).filter(|&range| range > 0.0),
    })
}
