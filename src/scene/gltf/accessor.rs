//! Accessors: elements of any component type, normalised, interleaved and sparse ones included, read one by one from the bytes of
//! the file. Opening an accessor checks all that reading it relies on.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;

use super::document::{BEYOND_THE_END, Document, Fault, NO_SUCH_ENTRY, entry};
use super::json::Whole;
use super::schema::{Accessor as JsonAccessor, Sparse as JsonSparse};
use crate::scene::assemble::BATCH_SIZE;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The reason why an accessor was not read.
pub(super) enum AccessorError {
    /// Loading was cancelled.
    Cancelled(Cancelled),
    /// The accessor cannot be read.
    Unreadable(Fault),
}

impl From<Cancelled> for AccessorError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl From<Fault> for AccessorError {
    fn from(fault: Fault) -> Self {
        Self::Unreadable(fault)
    }
}

/// Type of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// Bytes of a component.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Whether vertex indices may have this type.
    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }

    /// The number at the start of `bytes`.
    fn number(self, bytes: &[u8], normalized: bool) -> f32 {
        let scaled = |number: f32, max: f32| if normalized { (number / max).max(-1.0) } else { number };
        let [a, b, c, d] = first(bytes);
        match self {
            Self::I8 => scaled(f32::from(a.cast_signed()), 127.0),
            Self::U8 => scaled(f32::from(a), 255.0),
            Self::I16 => scaled(f32::from(i16::from_le_bytes([a, b])), 32_767.0),
            Self::U16 => scaled(f32::from(u16::from_le_bytes([a, b])), 65_535.0),
            Self::U32 => u32::from_le_bytes([a, b, c, d]) as f32,
            Self::F32 => f32::from_le_bytes([a, b, c, d]),
        }
    }

    /// The index at the start of `bytes`.
    fn index(self, bytes: &[u8]) -> u32 {
        let [a, b, c, d] = first(bytes);
        match self {
            Self::U8 => u32::from(a),
            Self::U16 => u32::from(u16::from_le_bytes([a, b])),
            _ => u32::from_le_bytes([a, b, c, d]),
        }
    }
}

/// The first four bytes, followed by zeros where there are fewer.
fn first(bytes: &[u8]) -> [u8; 4] {
    if let Some(word) = bytes.first_chunk::<4>() {
        return *word;
    }
    let mut word = [0; 4];
    word.iter_mut().zip(bytes).for_each(|(byte, &from)| *byte = from);
    word
}

/// Equally spaced elements in a buffer view.
#[derive(Clone, Copy)]
struct Span<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Span<'a> {
    /// The bytes from element `index` on; its existence was checked when the accessor was opened.
    fn at(self, index: usize) -> &'a [u8] {
        self.bytes.get(index.saturating_mul(self.stride)..).unwrap_or_default()
    }
}

/// Elements that replace others.
struct Sparse<'a> {
    count: usize,
    /// In ascending order.
    indices: Span<'a>,
    index_type: Component,
    values: Span<'a>,
}

/// An accessor that has passed all checks.
pub(super) struct Accessor<'a> {
    /// Number of elements.
    pub(super) count: usize,
    /// Components per element.
    pub(super) width: usize,
    pub(super) component: Component,
    pub(super) normalized: bool,
    /// Without it, all elements are zero.
    base: Option<Span<'a>>,
    sparse: Option<Sparse<'a>>,
}

impl Accessor<'_> {
    /// The bytes from element `index` on; `None` for zeros.
    fn bytes(&self, index: usize) -> Option<&[u8]> {
        if let Some(sparse) = &self.sparse {
            let (mut low, mut high) = (0, sparse.count);
            while low < high {
                let middle = low.midpoint(high);
                match (sparse.index_type.index(sparse.indices.at(middle)) as usize).cmp(&index) {
                    std::cmp::Ordering::Equal => return Some(sparse.values.at(middle)),
                    std::cmp::Ordering::Less => low = middle.saturating_add(1),
                    std::cmp::Ordering::Greater => high = middle,
                }
            }
        }
        self.base.map(|base| base.at(index))
    }

    /// Element `index`, which is less than `count`; components that it lacks are 0.
    pub(super) fn element(&self, index: usize) -> [f32; 4] {
        let mut numbers = [0.0; 4];
        if let Some(bytes) = self.bytes(index) {
            let parts = bytes.chunks(self.component.size());
            for (number, part) in numbers.iter_mut().take(self.width).zip(parts) {
                *number = self.component.number(part, self.normalized);
            }
        }
        numbers
    }

    /// The vertex index at `index`, which is less than `count`.
    pub(super) fn vertex_index(&self, index: usize) -> u32 {
        self.bytes(index).map_or(0, |bytes| self.component.index(bytes))
    }
}

/// Address, stride and size of an index of a list of sparse indices.
type IndexList = (usize, usize, usize);

/// Opens the accessors of a document.
pub(super) struct Accessors<'a> {
    document: &'a Document<'a>,
    /// How many indices are known to ascend, and whether the next does not: accessors that share a list are checked once.
    ascending: RefCell<HashMap<IndexList, (usize, bool)>>,
    /// Number of sparse indices that may still be checked: lists that overlap would else cost the product of their number and
    /// their length.
    checks_left: Cell<usize>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(document: &'a Document<'a>) -> Self {
        // Lists that do not overlap have no more indices than there are bytes.
        let checks_left = Cell::new(document.bytes().saturating_mul(2));
        Self { document, ascending: RefCell::default(), checks_left }
    }

    /// The number of elements that accessor `index` declares.
    pub(super) fn declared(&self, index: usize) -> u64 {
        self.document.root.accessors.get(index).map_or(0, |accessor| accessor.count.0)
    }

    /// Opens an accessor of vertex indices.
    pub(super) fn open_indices(&self, index: usize, token: &CancelToken) -> Result<Accessor<'a>, AccessorError> {
        let accessor = self.open(index, token)?;
        let fault =
            |detail: &str| Fault::new(WRONG_TYPE, format!("accessors[{index}]: {detail}, which are no indices"));
        match accessor.component {
            _ if accessor.width != 1 => Err(fault("holds vectors").into()),
            component if component.is_index() && !accessor.normalized => Ok(accessor),
            _ => Err(fault("holds numbers that are not unsigned integers").into()),
        }
    }

    /// Opens an accessor.
    pub(super) fn open(&self, index: usize, token: &CancelToken) -> Result<Accessor<'a>, AccessorError> {
        let fault = |kind, what: &str| Fault::new(kind, format!("accessors[{index}]: {what}"));
        let about = |Fault { kind, detail }: Fault| fault(kind, &detail);
        let json: &JsonAccessor = entry(&self.document.root.accessors, "accessors", index)?;
        let code = json.component_type.unwrap_or_default().0;
        let Some(component) = Component::from_code(code) else {
            return Err(fault(WRONG_TYPE, &format!("has the unknown componentType {code}")).into());
        };
        let width = match json.shape.as_deref() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            _ => return Err(fault(WRONG_TYPE, "has a type that no attribute has").into()),
        };
        let size = component.size().saturating_mul(width);
        let count = match u32::try_from(json.count.0) {
            Ok(0) => return Err(fault("no elements", "has no elements").into()),
            Ok(count) => count as usize,
            Err(_) => {
                let detail = format!("needs {} elements, more than 32 bits can count", json.count.0);
                return Err(fault(BEYOND_THE_END, &detail).into());
            }
        };
        let span = |view, offset, size, count| self.span(view, offset, size, count);
        let base = json.buffer_view.map(|view| span(view, json.byte_offset, size, count).map_err(about)).transpose()?;
        let sparse = json.sparse.as_deref().map(|sparse| self.open_sparse(sparse, size, count, token)).transpose();
        let sparse = sparse.map_err(|error| match error {
            AccessorError::Unreadable(Fault { kind, detail }) => fault(kind, &format!("(sparse) {detail}")).into(),
            cancelled @ AccessorError::Cancelled(_) => cancelled,
        })?;
        Ok(Accessor { count, width, component, normalized: json.normalized.0, base, sparse })
    }

    fn open_sparse(
        &self,
        json: &JsonSparse,
        size: usize,
        count: usize,
        token: &CancelToken,
    ) -> Result<Sparse<'a>, AccessorError> {
        let changes = json.count.get();
        if !(1..=count).contains(&changes) {
            return Err(Fault::new(BAD_SPARSE, format!("changes {} of {count} elements", json.count.0)).into());
        }
        let code = json.indices.component_type.unwrap_or_default().0;
        let Some(index_type) = Component::from_code(code).filter(|component| component.is_index()) else {
            return Err(Fault::new(WRONG_TYPE, format!("has indices of the unknown componentType {code}")).into());
        };
        let (Some(index_view), Some(value_view)) = (json.indices.buffer_view, json.values.buffer_view) else {
            return Err(Fault::new(NO_SUCH_ENTRY, "names no bufferView for its indices or values").into());
        };
        let indices = self.span(index_view, json.indices.byte_offset, index_type.size(), changes)?;
        let values = self.span(value_view, json.values.byte_offset, size, changes)?;
        let key = (indices.bytes.as_ptr().addr(), indices.stride, index_type.size());
        let (mut known, mut broken) = self.ascending.borrow().get(&key).copied().unwrap_or_default();
        let target = |k: usize| index_type.index(indices.at(k));
        while known < changes && !broken {
            if known.is_multiple_of(BATCH_SIZE) {
                token.check()?;
            }
            let Some(left) = self.checks_left.get().checked_sub(1) else {
                let detail = "shares parts of its indices with too many others; export the model again";
                return Err(Fault::new("sparse changes left out, since their lists overlap", detail).into());
            };
            self.checks_left.set(left);
            broken = known > 0 && target(known.saturating_sub(1)) >= target(known);
            known = known.saturating_add(usize::from(!broken));
        }
        self.ascending.borrow_mut().insert(key, (known, broken));
        // Of ascending indices the last is the largest.
        let suspect = known.min(changes.saturating_sub(1));
        if known < changes || target(suspect) as usize >= count {
            let detail = format!("has index {}, which is out of order or of range", target(suspect));
            return Err(Fault::new(BAD_SPARSE, detail).into());
        }
        Ok(Sparse { count: changes, indices, index_type, values })
    }

    /// The `count` elements of `size` bytes from `offset` of a view.
    fn span(&self, view: Whole, offset: Whole, size: usize, count: usize) -> Result<Span<'a>, Fault> {
        let (view, offset) = (view.get(), offset.0);
        let bytes = self.document.view(view)?;
        let stride = entry(&self.document.root.buffer_views, "bufferViews", view)?.byte_stride.map_or(0, Whole::get);
        let stride = if stride == 0 { size } else { stride };
        if stride < size {
            let detail = format!("has elements of {size} bytes every {stride} bytes in bufferViews[{view}]");
            return Err(Fault::new("elements that overlap", detail));
        }
        let start = usize::try_from(offset).ok();
        let length = count.saturating_sub(1).checked_mul(stride).and_then(|length| length.checked_add(size));
        let range = start.zip(length).and_then(|(start, length)| bytes.get(start..start.checked_add(length)?));
        let bytes = range.ok_or_else(|| {
            let has = bytes.len();
            let detail = format!(
                "needs {count} elements of {size} bytes every {stride} bytes from {offset}, bufferViews[{view}] has {has} bytes"
            );
            Fault::new(BEYOND_THE_END, detail)
        })?;
        Ok(Span { bytes, stride })
    }
}

/// Kind of a fault: numbers of a type that does not belong there.
pub(super) const WRONG_TYPE: &str = "numbers of a wrong type";
const BAD_SPARSE: &str = "sparse changes that are out of order or of range";
