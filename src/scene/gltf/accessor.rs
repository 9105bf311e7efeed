//! Reads accessors of every component type: normalised, interleaved and sparse ones included. Everything the crate's reader
//! would panic on is checked here first, with checked arithmetic.

use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::json::accessor::Accessor;
use gltf::json::validation::Checked;

use super::document::{Document, entry};
use crate::budget::Budget;
use crate::scene::assemble::collect_cancellable;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The reason why an accessor was not read.
pub(super) enum AccessorError {
    /// Loading was cancelled.
    Cancelled(Cancelled),
    /// The accessor cannot be read; the text says why.
    Unreadable(String),
}

impl From<Cancelled> for AccessorError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl From<String> for AccessorError {
    fn from(reason: String) -> Self {
        Self::Unreadable(reason)
    }
}

impl From<&str> for AccessorError {
    fn from(reason: &str) -> Self {
        Self::Unreadable(reason.to_owned())
    }
}

/// The elements of an accessor as consecutive floats.
pub(super) struct Elements {
    /// Components per element.
    pub(super) width: usize,
    /// The components; normalised integers are mapped to 0..1 or -1..1.
    pub(super) numbers: Vec<f32>,
}

/// An accessor that has passed all checks.
struct CheckedAccessor<'a> {
    reader: gltf::Accessor<'a>,
    kind: DataType,
    width: usize,
    count: usize,
    /// `count` times `width`.
    numbers: usize,
    /// Neither a view nor sparse values: all zero by definition, a case that the crate does not read.
    all_zero: bool,
}

/// Reads an accessor as floats.
pub(super) fn read(document: &Document, index: usize, token: &CancelToken) -> Result<Elements, AccessorError> {
    let accessor = check(document, index)?;
    let normalized = accessor.reader.normalized();
    let scaled = |number: f32, max: f32| if normalized { (number / max).max(-1.0) } else { number };
    let numbers = match accessor.kind {
        _ if accessor.all_zero => vec![0.0; accessor.numbers],
        DataType::I8 => components(document, &accessor, |number: i8| scaled(f32::from(number), 127.0), token)?,
        DataType::U8 => components(document, &accessor, |number: u8| scaled(f32::from(number), 255.0), token)?,
        DataType::I16 => components(document, &accessor, |number: i16| scaled(f32::from(number), 32_767.0), token)?,
        DataType::U16 => components(document, &accessor, |number: u16| scaled(f32::from(number), 65_535.0), token)?,
        DataType::U32 => components(document, &accessor, |number: u32| number as f32, token)?,
        DataType::F32 => components(document, &accessor, |number: f32| number, token)?,
    };
    Ok(Elements { width: accessor.width, numbers })
}

/// Reads an accessor as vertex indices.
pub(super) fn read_indices(document: &Document, index: usize, token: &CancelToken) -> Result<Vec<u32>, AccessorError> {
    let accessor = check(document, index)?;
    match accessor.kind {
        _ if accessor.width != 1 => Err(format!("accessors[{index}] holds vectors, no indices").into()),
        DataType::U8 | DataType::U16 | DataType::U32 if accessor.all_zero => Ok(vec![0; accessor.count]),
        DataType::U8 => Ok(components(document, &accessor, |number: u8| u32::from(number), token)?),
        DataType::U16 => Ok(components(document, &accessor, |number: u16| u32::from(number), token)?),
        DataType::U32 => Ok(components(document, &accessor, |number: u32| number, token)?),
        kind => Err(format!("accessors[{index}] holds numbers of type {kind:?}, no indices").into()),
    }
}

/// Every component of a checked accessor.
fn components<T: Item + Copy, N>(
    document: &Document,
    accessor: &CheckedAccessor,
    convert: impl Fn(T) -> N,
    token: &CancelToken,
) -> Result<Vec<N>, Cancelled> {
    let bytes = |buffer: gltf::Buffer<'_>| document.buffers.get(buffer.index())?.as_deref().ok();
    let reader = || accessor.reader.clone();
    let count = accessor.numbers;
    match accessor.width {
        1 => collect_cancellable(count, Iter::<T>::new(reader(), bytes).into_iter().flatten().map(convert), token),
        2 => collect_cancellable(
            count,
            Iter::<[T; 2]>::new(reader(), bytes).into_iter().flatten().flatten().map(convert),
            token,
        ),
        3 => collect_cancellable(
            count,
            Iter::<[T; 3]>::new(reader(), bytes).into_iter().flatten().flatten().map(convert),
            token,
        ),
        _ => collect_cancellable(
            count,
            Iter::<[T; 4]>::new(reader(), bytes).into_iter().flatten().flatten().map(convert),
            token,
        ),
    }
}

/// Checks everything that reading relies on.
fn check<'a>(document: &'a Document, index: usize) -> Result<CheckedAccessor<'a>, String> {
    let fault = |what: &str| format!("accessors[{index}] {what}");
    let accessor: &Accessor = entry(&document.root().accessors, "accessors", index)?;
    let Checked::Valid(kind) = accessor.component_type else { return Err(fault("has an unknown componentType")) };
    let width = match accessor.type_ {
        Checked::Valid(Dimensions::Scalar) => 1,
        Checked::Valid(Dimensions::Vec2) => 2,
        Checked::Valid(Dimensions::Vec3) => 3,
        Checked::Valid(Dimensions::Vec4) => 4,
        _ => return Err(fault("has a type that no attribute has")),
    };
    // At most four components of four bytes.
    let size = kind.0.size().saturating_mul(width);
    let count = match usize::try_from(accessor.count.0) {
        Ok(0) => return Err(fault("has no elements")),
        Ok(count) => count,
        Err(_) => return Err(fault("has a count too large")),
    };
    if let Some(view) = accessor.buffer_view {
        let offset = accessor.byte_offset.unwrap_or_default().0;
        span(document, view.value(), offset, size, count).map_err(|reason| fault(&reason))?;
    }
    if let Some(sparse) = &accessor.sparse {
        let sparse_fault = |reason: String| fault(&format!("(sparse) {reason}"));
        let changes = match usize::try_from(sparse.count.0) {
            Ok(changes) if (1..=count).contains(&changes) => changes,
            _ => return Err(sparse_fault(format!("changes {} of {count} elements", sparse.count.0))),
        };
        let Checked::Valid(index_kind) = sparse.indices.component_type else {
            return Err(sparse_fault("has unknown indices".to_owned()));
        };
        let (values, index_size) = (&sparse.values, index_kind.0.size());
        let view = sparse.indices.buffer_view.value();
        let (bytes, stride) =
            span(document, view, sparse.indices.byte_offset.0, index_size, changes).map_err(sparse_fault)?;
        span(document, values.buffer_view.value(), values.byte_offset.0, size, changes).map_err(sparse_fault)?;
        // The crate silently skips values whose indices are out of order.
        let mut previous = None;
        for index_bytes in bytes.chunks(stride) {
            let mut word = [0; 4];
            word[..index_size].copy_from_slice(&index_bytes[..index_size]);
            let target = u32::from_le_bytes(word);
            if target as usize >= count || previous.is_some_and(|previous| previous >= target) {
                return Err(sparse_fault(format!("has index {target}, which is out of order or of range")));
            }
            previous = Some(target);
        }
    }
    // Zeros without a view take no bytes in the file, so only the budget limits their count.
    let numbers = count.checked_mul(width).ok_or_else(|| fault("has a count too large"))?;
    let bytes = (numbers as u64).saturating_mul(size_of::<f32>() as u64);
    Budget::of_process()
        .check("the vertices of one accessor", bytes)
        .map_err(|error| format!("accessors[{index}]: {error}"))?;
    let all_zero = accessor.buffer_view.is_none() && accessor.sparse.is_none();
    let reader = document.parsed.accessors().nth(index).ok_or_else(|| fault("does not exist"))?;
    Ok(CheckedAccessor { reader, kind: kind.0, width, count, numbers, all_zero })
}

/// The bytes of `count` elements of `size` bytes in a view, and their stride.
fn span<'a>(
    document: &'a Document,
    view: usize,
    offset: u64,
    size: usize,
    count: usize,
) -> Result<(&'a [u8], usize), String> {
    let bytes = document.view(view)?;
    let stride = entry(&document.root().buffer_views, "bufferViews", view)?.byte_stride.map_or(0, |stride| stride.0);
    let stride = if stride == 0 { size } else { stride };
    if stride < size {
        return Err(format!("has elements of {size} bytes every {stride} bytes in bufferViews[{view}]"));
    }
    let start = usize::try_from(offset).ok();
    let length = count.saturating_sub(1).checked_mul(stride).and_then(|length| length.checked_add(size));
    let range = start.zip(length).and_then(|(start, length)| bytes.get(start..start.checked_add(length)?));
    let range = range.ok_or_else(|| {
        format!(
            "needs {count} elements of {size} bytes every {stride} bytes from {offset}, bufferViews[{view}] has {} bytes",
            bytes.len()
        )
    })?;
    Ok((range, stride))
}
