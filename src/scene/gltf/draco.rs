//! Meshes compressed by Draco (KHR_draco_mesh_compression), which are decoded into the data of their accessors.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::Semantic;
use gltf::accessor::DataType;
use gltf::mesh::Mode;
use serde_json::Value;

use super::accessor::{AccessorError, DAMAGED_DRACO, normalized};
use super::document::{Decoded, DecodedData, Document, Fault};
use super::table::extension;
use crate::budget::Budget;
use crate::scene::assemble::collect_cancellable;
use crate::scene::images::run_on_thread;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Decodes every compressed primitive that has no uncompressed data.
pub(super) fn decode_all(document: &Document, token: &CancelToken) -> Result<Decoded, Cancelled> {
    let mut decoded = Decoded::new();
    for mesh in document.gltf.meshes() {
        for primitive in mesh.primitives() {
            token.check()?;
            let Some(compressed) = primitive.extension_value(extension::DRACO) else { continue };
            // Others are ordinary accessors, without bufferView zeros that sparse values may replace.
            let is_listed = |semantic: &Semantic| listed(compressed, semantic).is_some();
            let attributes = primitive.attributes().filter(|(semantic, _)| is_listed(semantic));
            let attributes = attributes.map(|(_, accessor)| accessor);
            let lacking: Vec<usize> = (primitive.indices().into_iter().chain(attributes))
                .filter(|accessor| accessor.view().is_none())
                .map(|accessor| accessor.index())
                .collect();
            if lacking.iter().all(|index| decoded.contains_key(index)) {
                continue;
            }
            match decode(document, &primitive, compressed, token) {
                Ok(mesh) => store(&primitive, compressed, &mesh, &mut decoded, token)?,
                Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
                Err(AccessorError::Unreadable(fault)) => {
                    decoded.extend(lacking.into_iter().map(|index| (index, Err(fault.detail.clone()))));
                }
            }
        }
    }
    Ok(decoded)
}

/// The number that the extension gives an attribute in the compressed data.
fn listed<'a>(compressed: &'a Value, semantic: &Semantic) -> Option<&'a Value> {
    compressed.get("attributes")?.get(semantic.to_string())
}

/// Decodes a primitive on a thread of its own, since the decoder cannot be interrupted.
fn decode(
    document: &Document,
    primitive: &gltf::Primitive,
    compressed: &Value,
    token: &CancelToken,
) -> Result<Mesh, AccessorError> {
    let fault = |detail: &str| Fault::new(DAMAGED_DRACO, detail);
    let view = compressed.get("bufferView").and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok());
    let view =
        view.and_then(|index| document.gltf.views().nth(index)).ok_or_else(|| fault("it names no bufferView"))?;
    let indices = primitive.indices().filter(|_| primitive.mode() == Mode::Triangles);
    let declared = indices.ok_or_else(|| fault("it has no indices of separate triangles"))?.count();
    let bytes = document.view(&view)?.to_vec();
    let mut limits = DecodeLimits::default();
    // Each corner is a point at most, and decoding holds several lists of the size of its result.
    limits.max_faces = declared as u64 / 3;
    limits.max_points = declared as u64;
    limits.max_decoded_bytes = Budget::of_process().allowance() / 8;
    let work = move || {
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(&bytes).with_limits(limits);
        let result = MeshDecoder::new().decode(&mut buffer, &mut mesh);
        result.map(|()| mesh).map_err(|error| error.to_string())
    };
    let mesh = run_on_thread(work, token)?.unwrap_or_else(|| Err("its decoder failed".to_owned()));
    mesh.map_err(|reason| fault(&reason).into())
}

/// Stores the data of a decoded primitive for those of its accessors that have none.
fn store(
    primitive: &gltf::Primitive,
    compressed: &Value,
    mesh: &Mesh,
    decoded: &mut Decoded,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let mut put = |accessor: &gltf::Accessor, data: Result<DecodedData, String>| {
        if accessor.view().is_none() {
            decoded.entry(accessor.index()).or_insert(data);
        }
    };
    if let Some(indices) = primitive.indices() {
        let corners = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes());
        let count = mesh.num_faces().saturating_mul(3);
        let bytes = collect_cancellable(count.saturating_mul(4), corners, token)?;
        put(&indices, Ok(DecodedData { bytes, component: DataType::U32, count }));
    }
    for (semantic, accessor) in primitive.attributes() {
        let Some(id) = listed(compressed, &semantic) else { continue };
        let attribute = id.as_u64().and_then(|id| mesh.attribute_by_unique_id(u32::try_from(id).ok()?));
        let Some(attribute) = attribute else {
            put(&accessor, Err(format!("it has no {}", semantic.to_string())));
            continue;
        };
        let (component, count) = (accessor.data_type(), mesh.num_points());
        let numbers = attribute.read_f32s(count, accessor.dimensions().multiplicity());
        let size = numbers.len().saturating_mul(4);
        let number = |number: f32| if accessor.normalized() { normalized(component, number) } else { number };
        let bytes = collect_cancellable(size, numbers.into_iter().flat_map(|x| number(x).to_le_bytes()), token)?;
        put(&accessor, Ok(DecodedData { bytes, component: DataType::F32, count }));
    }
    Ok(())
}
