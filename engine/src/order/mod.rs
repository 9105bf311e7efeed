//! Primitives sorted along a space-filling curve: the first half of figure 5, before anything is clustered. Each primitive gets
//! a 63-bit code of its container's centroid, a parallel radix sort orders the codes, and [`SortedPrimitives::make_partition`]
//! finds where a range of them splits. Knows nothing of clusters and trees to be built.

mod input_bounds;

mod morton;

mod curve;

mod curve_cells;

mod triangle_spheres;

mod primitive_container;

mod radix_sort;

mod sorted_primitives;

pub(crate) use curve::CurveGrid;
pub(crate) use curve_cells::CellBox;
pub(crate) use input_bounds::{InputBounds, input_bounds};
pub(crate) use morton::CODE_BITS;
pub(crate) use primitive_container::PrimitiveContainer;
pub(crate) use radix_sort::radix_sort;
pub(crate) use sorted_primitives::{SortedPrimitives, sort_primitives};
