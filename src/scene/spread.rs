//! Flat lists of what every copy of a mesh has.

use std::ops::Range;

use glam::{Mat4, Vec3, Vec4};

use super::attributes::Attributes;
use super::motion::{Columns, columns, scale_of, turned, turned_tangent};
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::parallel::par_collect;
use bvhscope_engine::{Copies, Placed};

/// Elements of a flat list between two entries of [`Layout::coarse`]: few copies to step over, and a small table.
const COARSE: usize = 64;

/// The triangles of all copies at their `places`, from the `triangles` of all `meshes`.
pub(super) fn flat_triangles(
    triangles: &[Triangle],
    meshes: &[Range<u32>],
    placed: &[Placed],
    places: &Copies,
    token: &CancelToken,
) -> Result<Vec<Triangle>, Cancelled> {
    let of_copy = |copy: usize, triangle: &Triangle| places.place(copy as u32).triangle(triangle);
    Layout::new(meshes, placed, token)?.spread(triangles, None, token, of_copy)
}

/// Normals and tangents of all copies; `vertices` are those of each mesh.
pub(super) fn flat_vectors(
    attributes: &Attributes,
    vertices: &[Range<u32>],
    placed: &[Placed],
    token: &CancelToken,
) -> Result<(Vec<Vec3>, Vec<Vec4>), Cancelled> {
    let layout = Layout::new(vertices, placed, token)?;
    let transforms = par_collect(placed.len(), token, |copy| {
        let matrix = Mat4::from(placed[copy].transform);
        (columns(&matrix), scale_of(&[matrix]))
    })?;
    let of = |copy: usize| -> (Columns, f32) { transforms[copy] };
    let normals = layout.spread(&attributes.normals, Some(Vec3::ZERO), token, |copy, normal| {
        let (columns, scale) = of(copy);
        turned(columns, scale, *normal)
    })?;
    let tangents = attributes.tangents.first().copied();
    let tangents =
        layout.spread(&attributes.tangents, tangents, token, |copy, tangent| turned_tangent(of(copy).0, *tangent))?;
    Ok((normals, tangents))
}

/// Which copy each element of a flat list belongs to.
pub(super) struct Layout<'a> {
    /// The elements of each mesh in the list of the prototypes.
    ranges: &'a [Range<u32>],
    pub(super) placed: &'a [Placed],
    /// Index of the first element of each copy, and the number of all.
    pub(super) starts: Vec<u32>,
    /// The copy of every [`COARSE`]-th element.
    coarse: Vec<u32>,
}

impl<'a> Layout<'a> {
    /// The sum of the lengths must fit into 32 bits.
    pub(super) fn new(ranges: &'a [Range<u32>], placed: &'a [Placed], token: &CancelToken) -> Result<Self, Cancelled> {
        let (mut starts, mut coarse, mut end) = (Vec::with_capacity(placed.len() + 1), Vec::new(), 0);
        starts.push(0);
        for (copy, Placed { mesh, .. }) in placed.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, copy)?;
            end += ranges[*mesh as usize].len() as u32;
            starts.push(end);
            coarse.resize((end as usize).div_ceil(COARSE), copy as u32);
        }
        Ok(Self { ranges, placed, starts, coarse })
    }

    /// The flat list that `of` makes of the elements of `list`, with their copies; empty if `list` is. `first` comes before all.
    pub(super) fn spread<T: Sync, R: Copy + Send + Sync>(
        &self,
        list: &[T],
        first: Option<R>,
        token: &CancelToken,
        of: impl Fn(usize, &T) -> R + Sync,
    ) -> Result<Vec<R>, Cancelled> {
        let total = self.starts[self.placed.len()] as usize;
        if list.is_empty() {
            return Ok(Vec::new());
        }
        let at = |index: usize| {
            let mut copy = self.coarse[index / COARSE] as usize;
            while self.starts[copy + 1] as usize <= index {
                copy += 1;
            }
            let element =
                self.ranges[self.placed[copy].mesh as usize].start as usize + index - self.starts[copy] as usize;
            of(copy, &list[element])
        };
        match first {
            None => par_collect(total, token, at),
            Some(first) => par_collect(total + 1, token, |index| index.checked_sub(1).map_or(first, at)),
        }
    }

    /// [`Layout::spread`] of elements that are the same in every copy.
    pub(super) fn copied<T: Copy + Send + Sync>(
        &self,
        list: &[T],
        first: Option<&T>,
        token: &CancelToken,
    ) -> Result<Vec<T>, Cancelled> {
        self.spread(list, first.copied(), token, |_, element| *element)
    }
}
