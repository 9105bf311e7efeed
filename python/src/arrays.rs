//! Arrays of NumPy as lists of numbers: without a copy where they are contiguous and of a type that the engine reads.
//!
//! While a query runs, other threads of Python may write to its arrays. Numbers are therefore read one at a time through atomic cells:
//! a number that changes meanwhile is the old or the new one, and whatever it is, it is checked after it has been read.

use std::sync::atomic::{AtomicI32, AtomicI64, AtomicU32, AtomicU64, Ordering};

use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyWeakrefReference};

use crate::error::value_error;

/// A type of numbers in arrays.
pub(crate) trait Number: Element + Copy {
    /// A cell of the same size and alignment.
    type Cell: Sync + 'static;
    /// The number in a cell.
    fn load(cell: &Self::Cell) -> Self;
}

impl Number for f32 {
    type Cell = AtomicU32;
    #[inline(always)]
    fn load(cell: &AtomicU32) -> Self {
        Self::from_bits(cell.load(Ordering::Relaxed))
    }
}

impl Number for f64 {
    type Cell = AtomicU64;
    #[inline(always)]
    fn load(cell: &AtomicU64) -> Self {
        Self::from_bits(cell.load(Ordering::Relaxed))
    }
}

impl Number for i32 {
    type Cell = AtomicI32;
    #[inline(always)]
    fn load(cell: &AtomicI32) -> Self {
        cell.load(Ordering::Relaxed)
    }
}

impl Number for i64 {
    type Cell = AtomicI64;
    #[inline(always)]
    fn load(cell: &AtomicI64) -> Self {
        cell.load(Ordering::Relaxed)
    }
}

impl Number for u32 {
    type Cell = AtomicU32;
    #[inline(always)]
    fn load(cell: &AtomicU32) -> Self {
        cell.load(Ordering::Relaxed)
    }
}

/// The numbers of an array in C order, in the memory of the array.
pub(crate) struct Cells<T: Number> {
    cells: &'static [T::Cell],
    /// The array and those that it is a view of, with a weak reference to each: NumPy resizes no array that has one.
    _owners: Vec<(Py<PyAny>, Py<PyWeakrefReference>)>,
}

impl<T: Number> Cells<T> {
    /// The cells of an array of this type; `None` where it has another type or gaps.
    #[allow(unsafe_code, reason = "the memory of an array of NumPy has no safe type that may change")]
    fn of(array: &Bound<'_, PyAny>) -> PyResult<Option<Self>> {
        let Ok(array) = array.cast::<PyArrayDyn<T>>() else { return Ok(None) };
        let first = array.data().cast::<T::Cell>();
        if !(array.is_c_contiguous() && array.is_aligned() && first.is_aligned()) {
            return Ok(None);
        }
        let mut owners = Vec::new();
        let mut next = array.as_any().clone();
        while next.is_instance_of::<PyUntypedArray>() {
            let base = next.getattr(intern!(next.py(), "base"))?;
            owners.push((next.clone().unbind(), PyWeakrefReference::new(&next)?.unbind()));
            next = base;
        }
        let cells = if array.is_empty() {
            &[][..]
        } else {
            // SAFETY: a contiguous, aligned array of `len` numbers begins at `first`, and cells have their size. It outlives the cells, as
            // its owners are kept in the same value, private to this module, and are not resized. Others may write to it: hence cells.
            unsafe { std::slice::from_raw_parts(first, array.len()) }
        };
        Ok(Some(Self { cells, _owners: owners }))
    }

    #[inline(always)]
    fn at(&self, index: usize) -> T {
        T::load(&self.cells[index])
    }
}

/// The shape of an array.
pub(crate) type Shape = Vec<usize>;

/// Real numbers of an argument.
pub(crate) enum Floats {
    /// In single precision.
    F32(Cells<f32>),
    /// In double precision.
    F64(Cells<f64>),
}

impl Floats {
    /// The numbers of the argument `field`: of any array or list of real numbers.
    pub(crate) fn read(field: &str, value: &Bound<'_, PyAny>) -> PyResult<(Self, Shape)> {
        let array = as_array(field, value)?;
        let shape = array.cast::<PyUntypedArray>()?.shape().to_vec();
        if let Some(floats) = Self::in_place(&array)? {
            return Ok((floats, shape));
        }
        let kind = array.cast::<PyUntypedArray>()?.dtype();
        let copy = match (numpy::PyArrayDescrMethods::kind(&kind), numpy::PyArrayDescrMethods::itemsize(&kind)) {
            (b'f', ..=4) => copied(&array, "float32")?,
            (b'f' | b'i' | b'u', _) => copied(&array, "float64")?,
            _ => {
                return Err(value_error(
                    field,
                    format!("an array of {kind}: give real numbers, as float32 or float64"),
                ));
            }
        };
        let floats =
            Self::in_place(&copy)?.ok_or_else(|| value_error(field, "cannot be copied: give a NumPy array"))?;
        Ok((floats, shape))
    }

    fn in_place(array: &Bound<'_, PyAny>) -> PyResult<Option<Self>> {
        Ok(match Cells::of(array)? {
            Some(cells) => Some(Self::F32(cells)),
            None => Cells::of(array)?.map(Self::F64),
        })
    }

    /// The number at `index` less `offset`, which is subtracted in double precision.
    #[inline(always)]
    pub(crate) fn less(&self, index: usize, offset: f64) -> f32 {
        match self {
            Self::F32(cells) if offset == 0.0 => cells.at(index),
            Self::F32(cells) => (f64::from(cells.at(index)) - offset) as f32,
            Self::F64(cells) => (cells.at(index) - offset) as f32,
        }
    }

    /// The number at `index`.
    #[inline(always)]
    pub(crate) fn exact(&self, index: usize) -> f64 {
        match self {
            Self::F32(cells) => f64::from(cells.at(index)),
            Self::F64(cells) => cells.at(index),
        }
    }
}

/// Whole numbers of an argument.
pub(crate) enum Integers {
    /// Of 32 bits.
    I32(Cells<i32>),
    /// Of 64 bits.
    I64(Cells<i64>),
    /// Of 32 bits without sign.
    U32(Cells<u32>),
}

impl Integers {
    /// The numbers of the argument `field`: of any array or list of whole numbers.
    pub(crate) fn read(field: &str, value: &Bound<'_, PyAny>) -> PyResult<(Self, Shape)> {
        let array = as_array(field, value)?;
        let untyped = array.cast::<PyUntypedArray>()?;
        let (kind, shape) = (untyped.dtype(), untyped.shape().to_vec());
        if let Some(integers) = Self::in_place(&array)? {
            return Ok((integers, shape));
        }
        // An empty list is one of floats.
        if !matches!(numpy::PyArrayDescrMethods::kind(&kind), b'i' | b'u') && !untyped.is_empty() {
            return Err(value_error(field, format!("an array of {kind}: give whole numbers, as int32 or int64")));
        }
        let copy = copied(&array, "int64")?;
        let integers =
            Self::in_place(&copy)?.ok_or_else(|| value_error(field, "cannot be copied: give a NumPy array"))?;
        Ok((integers, shape))
    }

    fn in_place(array: &Bound<'_, PyAny>) -> PyResult<Option<Self>> {
        if let Some(cells) = Cells::of(array)? {
            return Ok(Some(Self::I32(cells)));
        }
        if let Some(cells) = Cells::of(array)? {
            return Ok(Some(Self::I64(cells)));
        }
        Ok(Cells::of(array)?.map(Self::U32))
    }

    /// The number at `index`.
    #[inline(always)]
    pub(crate) fn at(&self, index: usize) -> i64 {
        match self {
            Self::I32(cells) => i64::from(cells.at(index)),
            Self::I64(cells) => cells.at(index),
            Self::U32(cells) => i64::from(cells.at(index)),
        }
    }
}

/// `value` as an array of NumPy, itself if it is one.
fn as_array<'py>(field: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if value.is_instance_of::<PyUntypedArray>() {
        return Ok(value.clone());
    }
    let numpy = value.py().import(intern!(value.py(), "numpy"))?;
    let array = numpy.call_method1(intern!(value.py(), "asarray"), (value,));
    array.map_err(|error| value_error(field, format!("cannot become an array: {}", error.value(value.py()))))
}

/// A contiguous copy of an array.
fn copied<'py>(array: &Bound<'py, PyAny>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    let options = PyDict::new(array.py());
    options.set_item("order", "C")?;
    options.set_item("subok", false)?;
    array.call_method("astype", (kind,), Some(&options))
}

/// A shape as Python writes it.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}
