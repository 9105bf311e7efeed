//! Opens the attributes of a primitive, and reads those of the vertices in use.

use gltf::Semantic;
use gltf::accessor::DataType;

use super::accessor::{Accessor, AccessorError, Accessors, WRONG_TYPE};
use super::document::Fault;
use crate::budget::Budget;
use crate::scene::assemble::collect_cancellable;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Opens the attributes of a primitive; those that cannot be read are left out with a warning.
pub(super) struct Attributes<'a, 'b> {
    pub(super) json: &'b gltf::Primitive<'a>,
    pub(super) accessors: &'b Accessors<'a>,
    pub(super) gather: &'b Gather<'b>,
    pub(super) faults: Vec<(u64, String, String)>,
}

impl<'a> Attributes<'a, '_> {
    /// The attribute of this meaning, if there is one that `accepts` takes and that has an element for each vertex. `what` names it in
    /// warnings.
    pub(super) fn open(
        &mut self,
        semantic: &Semantic,
        what: &str,
        accepts: impl Fn(&Accessor) -> bool,
    ) -> Result<Option<Accessor<'a>>, Cancelled> {
        let Some(attribute) = self.json.get(semantic) else { return Ok(None) };
        let place = format!("attributes.{}", semantic.to_string());
        let lost = format!("primitives shown without {what}");
        self.open_accessor(&attribute, &place, [what, &lost], accepts)
    }

    /// The accessor at `place` in the primitive. `lost` begins the warning where it cannot be read.
    pub(super) fn open_accessor(
        &mut self,
        json: &gltf::Accessor<'a>,
        place: &str,
        [what, lost]: [&str; 2],
        accepts: impl Fn(&Accessor) -> bool,
    ) -> Result<Option<Accessor<'a>>, Cancelled> {
        let (index, vertices) = (json.index(), self.gather.count);
        let fault = match self.accessors.open(json, self.gather.token) {
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
            Err(AccessorError::Unreadable(fault)) => fault,
            Ok(accessor) if !accepts(&accessor) => {
                let kind = if accessor.normalized { "normalised" } else { "plain" };
                let detail = format!("{} {kind} {:?} each", accessor.width, accessor.component);
                Fault::new(WRONG_TYPE, format!("accessors[{index}]: {detail}"))
            }
            Ok(accessor) if accessor.count < vertices => {
                let detail = format!("accessors[{index}]: {} for {vertices} vertices", accessor.count);
                Fault::new("fewer than vertices", detail)
            }
            Ok(accessor) => {
                if accessor.count > vertices {
                    let detail = format!("{} for {vertices} vertices", accessor.count);
                    self.faults.push((1, format!("primitives with more {what} than vertices"), at(place, &detail)));
                }
                return Ok(Some(accessor));
            }
        };
        self.faults.push((1, format!("{lost}: {}", fault.kind), at(place, &fault.detail)));
        Ok(None)
    }
}

/// Whether an accessor holds fractions.
pub(super) fn is_unit(accessor: &Accessor) -> bool {
    accessor.component == DataType::F32 || accessor.normalized
}

/// Reads the elements of the vertices in use.
pub(super) struct Gather<'a> {
    /// The vertices in use; `None` for all.
    pub(super) used: Option<&'a [u32]>,
    /// Number of vertices in the file.
    pub(super) count: usize,
    pub(super) token: &'a CancelToken,
}

impl Gather<'_> {
    /// Number of vertices in use.
    pub(super) fn len(&self) -> usize {
        self.used.map_or(self.count, <[u32]>::len)
    }

    /// The elements of all vertices in use.
    pub(super) fn all<T, const N: usize>(
        &self,
        accessor: &Accessor,
        convert: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, Cancelled> {
        let index = |k: usize| self.used.map_or(k, |used| used[k] as usize);
        collect_cancellable(self.len(), (0..self.len()).map(|k| convert(accessor.element(index(k)))), self.token)
    }
}

/// A place in a primitive with what is wrong there.
pub(super) fn at(place: &str, detail: &str) -> String {
    if detail.is_empty() { place.to_owned() } else { format!("{place}: {detail}") }
}

/// Checks the budget for `count` elements of `size` bytes.
pub(super) fn reserve_memory(what: &str, count: usize, size: u64) -> Result<(), Fault> {
    let bytes = (count as u64).saturating_mul(size);
    Budget::of_process().check(what, bytes).map_err(|error| Fault::new("too little memory", error.to_string()))
}
