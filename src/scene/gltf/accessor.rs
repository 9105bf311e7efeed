//! Accessors: elements of any component type, normalised, interleaved and sparse ones included. Opening an accessor checks all that
//! reading it relies on.
//!
//! The readers of the crate go through accessors from the start and know no quantised positions. Here elements are read one by one,
//! so that the work is bounded by the number of elements in use, also where many primitives share one long accessor.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;

use gltf::accessor::{DataType, Dimensions, Item};
use gltf::buffer::View;

use super::document::{BEYOND_THE_END, Document, Fault};
use crate::scene::assemble::BATCH_SIZE;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Kind of a fault: data compressed by Draco that are damaged or of an unknown kind.
pub(super) const DAMAGED_DRACO: &str = "data compressed by Draco that cannot be read";

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

/// The number that `bytes`, which are those of one component, hold.
fn number(component: DataType, bytes: &[u8]) -> f32 {
    match component {
        DataType::I8 => i8::from_slice(bytes).into(),
        DataType::U8 => u8::from_slice(bytes).into(),
        DataType::I16 => i16::from_slice(bytes).into(),
        DataType::U16 => u16::from_slice(bytes).into(),
        DataType::U32 => u32::from_slice(bytes) as f32,
        DataType::F32 => f32::from_slice(bytes),
    }
}

/// A number of a normalised component as a fraction.
pub(super) fn normalized(component: DataType, number: f32) -> f32 {
    let most = match component {
        DataType::I8 => 127.0,
        DataType::U8 => 255.0,
        DataType::I16 => 32_767.0,
        DataType::U16 => 65_535.0,
        DataType::U32 | DataType::F32 => return number,
    };
    (number / most).max(-1.0)
}

/// The index at the start of `bytes`, which hold at least one component.
fn index(component: DataType, bytes: &[u8]) -> u32 {
    match component {
        DataType::U8 => u8::from_slice(bytes).into(),
        DataType::U16 => u16::from_slice(bytes).into(),
        _ => u32::from_slice(bytes),
    }
}

/// Equally spaced elements in a buffer view.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Elements<'a> {
    /// The bytes from element `index` on; its existence was checked when the accessor was opened.
    fn at(self, index: usize) -> &'a [u8] {
        self.bytes.get(index.saturating_mul(self.stride)..).unwrap_or_default()
    }
}

/// Elements that replace others.
struct Sparse<'a> {
    count: usize,
    /// In ascending order.
    indices: Elements<'a>,
    index_type: DataType,
    values: Elements<'a>,
}

/// An accessor that has passed all checks.
pub(super) struct Accessor<'a> {
    /// Number of elements.
    pub(super) count: usize,
    /// Components per element.
    pub(super) width: usize,
    pub(super) component: DataType,
    pub(super) normalized: bool,
    /// Without it, all elements are zero.
    base: Option<Elements<'a>>,
    sparse: Option<Sparse<'a>>,
}

impl Accessor<'_> {
    /// The bytes from element `index` on; `None` for zeros.
    fn bytes(&self, index_of_element: usize) -> Option<&[u8]> {
        if let Some(sparse) = &self.sparse {
            let (mut low, mut high) = (0, sparse.count);
            while low < high {
                let middle = low.midpoint(high);
                match (index(sparse.index_type, sparse.indices.at(middle)) as usize).cmp(&index_of_element) {
                    std::cmp::Ordering::Equal => return Some(sparse.values.at(middle)),
                    std::cmp::Ordering::Less => low = middle.saturating_add(1),
                    std::cmp::Ordering::Greater => high = middle,
                }
            }
        }
        self.base.map(|base| base.at(index_of_element))
    }

    /// Element `index`, which is less than `count`; components that it lacks are 0.
    pub(super) fn element<const N: usize>(&self, index: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        if let Some(bytes) = self.bytes(index) {
            let parts = bytes.chunks_exact(self.component.size());
            for (result, part) in numbers.iter_mut().take(self.width).zip(parts) {
                let number = number(self.component, part);
                *result = if self.normalized { normalized(self.component, number) } else { number };
            }
        }
        numbers
    }

    /// The vertex index at `place`, which is less than `count`.
    pub(super) fn vertex_index(&self, place: usize) -> u32 {
        self.bytes(place).map_or(0, |bytes| index(self.component, bytes))
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

    /// The number of elements that an accessor declares.
    pub(super) fn declared(&self, json: &gltf::Accessor) -> u64 {
        self.document.gltf.as_json().accessors.get(json.index()).map_or(0, |accessor| accessor.count.0)
    }

    /// Opens an accessor of vertex indices.
    pub(super) fn open_indices(
        &self,
        json: &gltf::Accessor<'a>,
        token: &CancelToken,
    ) -> Result<Accessor<'a>, AccessorError> {
        let accessor = self.open(json, token)?;
        let fault =
            |detail| Fault::new(WRONG_TYPE, format!("accessors[{}]: {detail}, which are no indices", json.index()));
        match accessor.component {
            _ if accessor.width != 1 => Err(fault("holds vectors").into()),
            DataType::U8 | DataType::U16 | DataType::U32 if !accessor.normalized => Ok(accessor),
            _ => Err(fault("holds numbers that are not unsigned integers").into()),
        }
    }

    /// Opens an accessor of numbers or vectors.
    pub(super) fn open(&self, json: &gltf::Accessor<'a>, token: &CancelToken) -> Result<Accessor<'a>, AccessorError> {
        match json.dimensions() {
            Dimensions::Scalar | Dimensions::Vec2 | Dimensions::Vec3 | Dimensions::Vec4 => self.open_any(json, token),
            _ => {
                let detail = format!("accessors[{}]: has a type that no attribute has", json.index());
                Err(Fault::new(WRONG_TYPE, detail).into())
            }
        }
    }

    /// Opens an accessor of any type. The columns of matrices must have a multiple of four bytes.
    pub(super) fn open_any(
        &self,
        json: &gltf::Accessor<'a>,
        token: &CancelToken,
    ) -> Result<Accessor<'a>, AccessorError> {
        let fault = |kind, what: &str| Fault::new(kind, format!("accessors[{}]: {what}", json.index()));
        let (component, width) = (json.data_type(), json.dimensions().multiplicity());
        let size = component.size().saturating_mul(width);
        let declared = self.declared(json);
        let count = match u32::try_from(declared) {
            Ok(0) => return Err(fault("no elements", "has no elements").into()),
            Ok(count) => count as usize,
            Err(_) => {
                let detail = format!("needs {declared} elements, more than 32 bits can count");
                return Err(fault(BEYOND_THE_END, &detail).into());
            }
        };
        if let Some(decoded) = self.document.decoded.get(&json.index()) {
            let data = decoded.as_ref().map_err(|reason| fault(DAMAGED_DRACO, reason))?;
            if data.count != count {
                let detail = format!("declares {count} elements, {} were decoded", data.count);
                return Err(fault(DAMAGED_DRACO, &detail).into());
            }
            let base = Some(Elements { bytes: &data.bytes, stride: data.component.size().saturating_mul(width) });
            return Ok(Accessor { count, width, component: data.component, normalized: false, base, sparse: None });
        }
        let offset = self.document.gltf.as_json().accessors.get(json.index()).and_then(|accessor| accessor.byte_offset);
        let base = json.view().map(|view| self.elements(&view, offset.unwrap_or_default().0, size, count)).transpose();
        let base = base.map_err(|Fault { kind, detail }| fault(kind, &detail))?;
        let sparse = json.sparse().map(|_| self.open_sparse(json, size, count, token)).transpose();
        let sparse = sparse.map_err(|error| match error {
            AccessorError::Unreadable(Fault { kind, detail }) => fault(kind, &format!("(sparse) {detail}")).into(),
            cancelled @ AccessorError::Cancelled(_) => cancelled,
        })?;
        Ok(Accessor { count, width, component, normalized: json.normalized(), base, sparse })
    }

    fn open_sparse(
        &self,
        json: &gltf::Accessor<'a>,
        size: usize,
        count: usize,
        token: &CancelToken,
    ) -> Result<Sparse<'a>, AccessorError> {
        let accessors = &self.document.gltf.as_json().accessors;
        let numbers = accessors.get(json.index()).and_then(|accessor| accessor.sparse.as_ref());
        let (Some(numbers), Some(sparse)) = (numbers, json.sparse()) else {
            return Err(Fault::new(BAD_SPARSE, "has no changes").into());
        };
        let changes = usize::try_from(numbers.count.0).unwrap_or(usize::MAX);
        if !(1..=count).contains(&changes) {
            return Err(Fault::new(BAD_SPARSE, format!("changes {} of {count} elements", numbers.count.0)).into());
        }
        let index_type = match sparse.indices().index_type() {
            gltf::accessor::sparse::IndexType::U8 => DataType::U8,
            gltf::accessor::sparse::IndexType::U16 => DataType::U16,
            gltf::accessor::sparse::IndexType::U32 => DataType::U32,
        };
        let (index_view, value_view) = (sparse.indices().view(), sparse.values().view());
        let indices = self.elements(&index_view, numbers.indices.byte_offset.0, index_type.size(), changes)?;
        let values = self.elements(&value_view, numbers.values.byte_offset.0, size, changes)?;
        let key = (indices.bytes.as_ptr().addr(), indices.stride, index_type.size());
        let (mut known, mut broken) = self.ascending.borrow().get(&key).copied().unwrap_or_default();
        let target = |k: usize| index(index_type, indices.at(k));
        while known < changes && !broken {
            token.check_every(BATCH_SIZE, known)?;
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
    fn elements(&self, view: &View<'a>, offset: u64, size: usize, count: usize) -> Result<Elements<'a>, Fault> {
        let bytes = self.document.view(view)?;
        let (index, stride) = (view.index(), view.stride().unwrap_or(size));
        if stride < size {
            let detail = format!("has elements of {size} bytes every {stride} bytes in bufferViews[{index}]");
            return Err(Fault::new("elements that overlap", detail));
        }
        let start = usize::try_from(offset).ok();
        let length = count.saturating_sub(1).checked_mul(stride).and_then(|length| length.checked_add(size));
        let range = start.zip(length).and_then(|(start, length)| bytes.get(start..start.checked_add(length)?));
        let bytes = range.ok_or_else(|| {
            let has = bytes.len();
            let detail = format!(
                "needs {count} elements of {size} bytes every {stride} bytes from {offset}, bufferViews[{index}] has {has} bytes"
            );
            Fault::new(BEYOND_THE_END, detail)
        })?;
        Ok(Elements { bytes, stride })
    }
}

/// Kind of a fault: numbers of a type that does not belong there.
pub(super) const WRONG_TYPE: &str = "numbers of a wrong type";
const BAD_SPARSE: &str = "sparse changes that are out of order or of range";
