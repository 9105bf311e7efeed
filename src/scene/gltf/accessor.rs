//! Accessors: every component type, normalised or not, interleaved or not, sparse or not, with checked arithmetic.

use super::container::{Document, number};

/// Bytes that an accessor without a view may take.
const MAX_BYTES: usize = 1 << 30;

/// Elements one after the other, as in the file.
pub(super) struct Elements {
    kind: usize,
    /// Numbers an element.
    pub(super) width: usize,
    normalized: bool,
    bytes: Vec<u8>,
}

impl Elements {
    /// Every number as a float; normalised integers become 0 to 1 or -1 to 1.
    pub(super) fn floats(&self) -> Vec<f32> {
        let bytes = &self.bytes;
        let scale = |most: f32| if self.normalized { 1.0 / most } else { 1.0 };
        match self.kind {
            5120 => {
                bytes.iter().map(|&b| (f32::from(b.cast_signed()) * scale(127.0)).max(-128.0 * scale(128.0))).collect()
            }
            5121 => bytes.iter().map(|&b| f32::from(b) * scale(255.0)).collect(),
            5122 => bytes.as_chunks().0.iter().map(|&b| f32::from(i16::from_le_bytes(b)) * scale(32_767.0)).collect(),
            5123 => bytes.as_chunks().0.iter().map(|&b| f32::from(u16::from_le_bytes(b)) * scale(65_535.0)).collect(),
            5125 => bytes.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b) as f32).collect(),
            _ => bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        }
    }

    /// Every number as an index; `None` where they are no indices.
    pub(super) fn indices(&self) -> Option<Vec<u32>> {
        let bytes = &self.bytes;
        match self.kind {
            _ if self.width != 1 => None,
            5121 => Some(bytes.iter().map(|&b| u32::from(b)).collect()),
            5123 => Some(bytes.as_chunks().0.iter().map(|&b| u32::from(u16::from_le_bytes(b))).collect()),
            5125 => Some(bytes.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect()),
            _ => None,
        }
    }
}

fn component_size(kind: usize) -> Option<usize> {
    match kind {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

/// Reads an accessor.
pub(super) fn read(document: &Document, index: usize) -> Result<Elements, String> {
    let accessor = document.entry("accessors", index)?;
    let place = |what: &str| format!("accessors[{index}] {what}");
    let kind = number(accessor, "componentType").unwrap_or(0);
    let size = component_size(kind).ok_or_else(|| place("has an unknown componentType"))?;
    let width = match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => return Err(place("has a type that no attribute has")),
    };
    let count = number(accessor, "count").ok_or_else(|| place("has no count"))?;
    let size = size * width;
    let total = count.checked_mul(size).ok_or_else(|| place("has a count too large"))?;
    let mut bytes = match number(accessor, "bufferView") {
        Some(view) => {
            let stride = number(document.entry("bufferViews", view)?, "byteStride").unwrap_or(size);
            let start = number(accessor, "byteOffset").unwrap_or(0);
            strided(document.view(view)?, start, stride, size, count)
                .map_err(|reason| place(&format!("{reason}, bufferViews[{view}]")))?
        }
        None if total <= MAX_BYTES => vec![0; total],
        None => return Err(place("has a count too large")),
    };
    let sparse = &accessor["sparse"];
    if sparse.is_object() {
        let changes = number(sparse, "count").unwrap_or(0);
        let part = |part: &str, size: usize| -> Result<Vec<u8>, String> {
            let part = &sparse[part];
            let view = number(part, "bufferView").ok_or_else(|| place("has a sparse part without data"))?;
            strided(document.view(view)?, number(part, "byteOffset").unwrap_or(0), size, size, changes)
                .map_err(|reason| place(&format!("(sparse) {reason}, bufferViews[{view}]")))
        };
        let index_kind = number(&sparse["indices"], "componentType").unwrap_or(0);
        let index_size = component_size(index_kind).ok_or_else(|| place("has unknown sparse indices"))?;
        let indices = part("indices", index_size)?;
        let indices = Elements { kind: index_kind, width: 1, normalized: false, bytes: indices }.indices();
        let values = part("values", size)?;
        for (target, value) in indices.ok_or_else(|| place("has wrong sparse indices"))?.iter().zip(values.chunks(size))
        {
            let start = (*target as usize).checked_mul(size);
            let range = start.and_then(|start| bytes.get_mut(start..start.checked_add(size)?));
            range.ok_or_else(|| place("has a sparse index out of range"))?.copy_from_slice(value);
        }
    }
    Ok(Elements { kind, width, normalized: accessor["normalized"].as_bool().unwrap_or(false), bytes })
}

fn strided(bytes: &[u8], start: usize, stride: usize, size: usize, count: usize) -> Result<Vec<u8>, String> {
    if count == 0 {
        return Ok(Vec::new());
    }
    if stride < size {
        return Err(format!("has elements of {size} bytes every {stride} bytes"));
    }
    let end = (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)).and_then(|n| n.checked_add(start));
    let Some(source) = end.and_then(|end| bytes.get(start..end)) else {
        return Err(format!(
            "needs {count} elements of {size} bytes from {start}, but there are {} bytes",
            bytes.len()
        ));
    };
    if stride == size {
        return Ok(source.to_vec());
    }
    Ok(source.chunks(stride).flat_map(|element| &element[..size]).copied().collect())
}
