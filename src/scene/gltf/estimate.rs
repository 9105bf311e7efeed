//! Estimate of the triangle count from the JSON alone.

use gltf::json::Root;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use serde_json::Value;

use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Approximate number of triangles that the nodes of `root` instance, according to its unchecked counts. A capacity hint, which
/// avoids reallocating the list of triangles.
pub(super) fn estimate_triangles(root: &Root, token: &CancelToken) -> Result<u64, Cancelled> {
    let count = |accessor: usize| root.accessors.get(accessor).map_or(0, |accessor| accessor.count.0);
    let mut triangles = Vec::with_capacity(root.meshes.len());
    for mesh in &root.meshes {
        token.check()?;
        let corners = mesh.primitives.iter().map(|primitive| {
            let positions = || primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied();
            primitive.indices.or_else(positions).map_or(0, |accessor| count(accessor.value()))
        });
        triangles.push(corners.fold(0, u64::saturating_add) / 3);
    }
    let mut all = 0_u64;
    for node in &root.nodes {
        token.check()?;
        let Some(&once) = node.mesh.and_then(|mesh| triangles.get(mesh.value())) else { continue };
        let instancing = node.extensions.as_ref().and_then(|others| others.others.get("EXT_mesh_gpu_instancing"));
        let copies = instancing.and_then(|extension| extension["attributes"].as_object()).map_or(1, |attributes| {
            let accessors = attributes.values().filter_map(Value::as_u64);
            accessors.map(|accessor| usize::try_from(accessor).map_or(0, count)).max().unwrap_or(0)
        });
        all = all.saturating_add(once.saturating_mul(copies));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_counted_with_their_copies() {
        let text = r#"{
            "asset": { "version": "2.0" },
            "accessors": [
                { "componentType": 5126, "count": 30, "type": "VEC3" },
                { "componentType": 5125, "count": 12, "type": "SCALAR" },
                { "componentType": 5126, "count": 100, "type": "VEC3" },
                { "componentType": 5126, "count": 18446744073709551615, "type": "VEC3" }
            ],
            "meshes": [
                { "primitives": [{ "attributes": { "POSITION": 0 } }, { "attributes": { "POSITION": 0 }, "indices": 1 }] },
                { "primitives": [{ "attributes": { "POSITION": 77 } }, { "attributes": {} }] },
                { "primitives": [{ "attributes": { "POSITION": 3 } }, { "attributes": { "POSITION": 3 } }] }
            ],
            "nodes": [
                { "mesh": 0 }, { "mesh": 1 }, { "mesh": 9 }, {},
                { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 2, "SCALE": 99 } } } }
                HUGE
            ]
        }"#;
        let announced = |huge: &str| {
            let root = Root::from_str(&text.replace("HUGE", huge)).ok()?;
            estimate_triangles(&root, &CancelToken::new()).ok()
        };
        assert_eq!(announced(""), Some(14 + 14 * 100));
        let all = announced(r#", { "mesh": 2 }, { "mesh": 2 }, { "mesh": 2 }, { "mesh": 2 }"#);
        assert_eq!(all, Some(u64::MAX), "no sum wraps");
    }
}
