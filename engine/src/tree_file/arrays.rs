//! The arrays as they stand in the file: where each is, and their rows as numbers.

use serde_json::{Map, Value};

use super::error::TreeFileError;
use super::header::{Header, LevelCounts, Parsed, shown};
use super::layout::ArrayName;
use super::which_tree::Items;
use crate::tree::ContainerKind;

/// Bytes of an f32 and of a u32.
const NUMBER: usize = 4;

/// A child that is none.
pub(super) const EMPTY_SLOT: u32 = u32::MAX;

/// Numbers of rows and of columns of an array.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub rows: u32,
    pub columns: usize,
}

impl Shape {
    /// Size in bytes: at most 2^32 · 32 · 4.
    pub const fn bytes(self) -> u64 {
        (self.rows as u64).saturating_mul(self.columns as u64).saturating_mul(NUMBER as u64)
    }
}

/// Numbers in the bounds of a node.
pub(super) const fn numbers_of(kind: ContainerKind) -> usize {
    match kind {
        ContainerKind::Aabb => 6,
        ContainerKind::Sphere => 4,
        ContainerKind::Dop14 => 14,
        ContainerKind::Oriented => 21,
    }
}

/// The shapes of the arrays of a file, in the order of [`ArrayName::ALL`].
pub(super) const fn shapes(
    kind: ContainerKind,
    nodes: u32,
    indices: u32,
    header: &Header,
    LevelCounts { trees, instances }: LevelCounts,
) -> [Shape; ArrayName::ALL.len()] {
    [
        Shape { rows: nodes, columns: numbers_of(kind) },
        Shape { rows: nodes, columns: header.arity as usize },
        Shape { rows: nodes, columns: 2 },
        Shape { rows: indices, columns: 1 },
        Shape { rows: header.triangles, columns: 9 },
        Shape { rows: trees, columns: 3 },
        Shape { rows: instances, columns: 1 },
        Shape { rows: instances, columns: 12 },
        Shape { rows: instances, columns: 1 },
    ]
}

/// An array in the file, which need not be aligned.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows<'a> {
    bytes: &'a [u8],
    row_bytes: usize,
}

impl<'a> Rows<'a> {
    const NONE: Self = Self { bytes: &[], row_bytes: 0 };

    /// `count` rows from `first` on.
    fn part(self, first: u64, count: u32) -> Self {
        let byte = |row: u64| row.saturating_mul(self.row_bytes as u64) as usize;
        let end = first.saturating_add(u64::from(count));
        Self { bytes: self.bytes.get(byte(first)..byte(end)).unwrap_or_default(), ..self }
    }

    /// The bytes of a row, in numbers of four each; none behind the last.
    #[inline(always)]
    pub fn row(self, row: u32) -> &'a [[u8; NUMBER]] {
        let begin = (row as usize).saturating_mul(self.row_bytes);
        let bytes = self.bytes.get(begin..begin.saturating_add(self.row_bytes)).unwrap_or_default();
        bytes.as_chunks().0
    }

    /// A row of whole numbers.
    #[inline(always)]
    pub fn whole(self, row: u32) -> impl DoubleEndedIterator<Item = u32> + 'a {
        self.row(row).iter().map(|&bytes| u32::from_le_bytes(bytes))
    }

    /// The first numbers of a row, 0 for what it lacks.
    #[inline(always)]
    pub fn floats<const N: usize>(self, row: u32) -> [f32; N] {
        let mut numbers = [0.0; N];
        numbers.iter_mut().zip(self.row(row)).for_each(|(number, &bytes)| *number = f32::from_le_bytes(bytes));
        numbers
    }
}

/// The arrays of a tree, none of which ends behind the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrays<'a> {
    pub nodes: u32,
    pub indices: u32,
    /// Number of things that are in its leaves: triangles of a mesh, or instances.
    pub items: u32,
    /// Their kind.
    pub kind: Items,
    pub bounds: Rows<'a>,
    children: Rows<'a>,
    leaves: Rows<'a>,
    indices_rows: Rows<'a>,
    pub corners: Option<Rows<'a>>,
}

/// The arrays of trees in two levels. Those of all trees follow one another.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelArrays<'a> {
    pub all: Arrays<'a>,
    pub trees: Rows<'a>,
    pub instances: Rows<'a>,
    pub matrices: Rows<'a>,
    pub ids: Option<Rows<'a>>,
}

impl<'a> Arrays<'a> {
    /// Finds the arrays of the tree of a file that holds one.
    pub fn find(parsed: &Parsed<'a>) -> Result<Self, TreeFileError> {
        if parsed.levels.is_some() {
            return Err(TreeFileError::TwoLevels);
        }
        LevelArrays::find_all(parsed, LevelCounts::default()).map(|arrays| arrays.all)
    }

    /// Those of one of the trees whose arrays follow one another: from these rows of nodes, indices and triangles on.
    pub fn part(&self, [node, index, item]: [u64; 3], [nodes, indices, items]: [u32; 3], kind: Items) -> Self {
        let corners = self.corners.filter(|_| kind == Items::Triangles);
        Self {
            nodes,
            indices,
            items,
            kind,
            bounds: self.bounds.part(node, nodes),
            children: self.children.part(node, nodes),
            leaves: self.leaves.part(node, nodes),
            indices_rows: self.indices_rows.part(index, indices),
            corners: corners.map(|corners| corners.part(item, items)),
        }
    }
    /// First index and number of indices of a node: 0 for an interior one.
    #[inline(always)]
    pub fn leaf(&self, node: u32) -> [u32; 2] {
        let mut numbers = self.leaves.whole(node);
        [numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)]
    }

    /// The children of an interior node, without empty slots.
    #[inline(always)]
    pub fn children(&self, node: u32) -> impl DoubleEndedIterator<Item = u32> + 'a {
        self.children.whole(node).filter(|&child| child != EMPTY_SLOT)
    }

    /// The item at a position of `indices`.
    #[inline(always)]
    pub fn item_at(&self, index: u32) -> u32 {
        self.indices_rows.whole(index).next().unwrap_or(0)
    }
}

impl<'a> LevelArrays<'a> {
    /// Finds the arrays of trees in two levels.
    pub fn find(parsed: &Parsed<'a>) -> Result<(Self, LevelCounts), TreeFileError> {
        let counts = parsed.levels.ok_or(TreeFileError::OneLevel)?;
        Ok((Self::find_all(parsed, counts)?, counts))
    }

    /// Finds the arrays that the header names.
    fn find_all(parsed: &Parsed<'a>, counts: LevelCounts) -> Result<Self, TreeFileError> {
        let shapes = shapes(parsed.kind, parsed.nodes, parsed.indices, &parsed.header, counts);
        let mut found: Vec<(u64, u64, ArrayName)> = Vec::with_capacity(shapes.len());
        let mut at = |array: ArrayName, shape: Shape| -> Result<Option<Rows<'a>>, TreeFileError> {
            let Some(begin) = begin_of(&parsed.arrays, array)? else {
                return if array.is_optional() { Ok(None) } else { Err(TreeFileError::NoArray(array)) };
            };
            let (bytes, length) = (shape.bytes(), parsed.data.len() as u64);
            let beyond = TreeFileError::ArrayEnd { array, begin, bytes, length };
            let end = begin.checked_add(bytes).filter(|&end| end <= length).ok_or(beyond)?;
            if bytes > 0 {
                found.push((begin, end, array));
            }
            // Both fit, because the file does.
            let bytes = parsed.data.get(begin as usize..end as usize).unwrap_or_default();
            Ok(Some(Rows { bytes, row_bytes: shape.columns.saturating_mul(NUMBER) }))
        };
        let mut rows = [None; ArrayName::ALL.len()];
        for ((row, array), shape) in rows.iter_mut().zip(ArrayName::ALL).zip(shapes) {
            if parsed.levels.is_some() || !array.is_of_two_levels() {
                *row = at(array, shape)?;
            }
        }
        found.sort_by_key(|&(begin, ..)| begin);
        for pair in found.windows(2) {
            let [(_, end, first), (begin, _, second)] = [pair[0], pair[1]];
            if begin < end {
                return Err(TreeFileError::ArrayOverlap { first, end, second, begin });
            }
        }
        let [bounds, children, leaves, indices_rows, corners, trees, instances, matrices, ids] = rows;
        let [bounds, children, leaves, indices_rows, trees, instances, matrices] =
            [bounds, children, leaves, indices_rows, trees, instances, matrices].map(|rows| rows.unwrap_or(Rows::NONE));
        let (nodes, indices, items) = (parsed.nodes, parsed.indices, parsed.header.triangles);
        let kind = Items::Triangles;
        let all = Arrays { nodes, indices, items, kind, bounds, children, leaves, indices_rows, corners };
        Ok(Self { all, trees, instances, matrices, ids })
    }
}

/// Where an array begins, in bytes from the start of the data; `None` where the header does not say.
fn begin_of(arrays: &Map<String, Value>, array: ArrayName) -> Result<Option<u64>, TreeFileError> {
    let Some(value) = arrays.get(array.name()).filter(|value| !value.is_null()) else { return Ok(None) };
    let begin = value.as_u64().ok_or_else(|| TreeFileError::ArrayBegin { array, found: shown(value) });
    begin.map(Some)
}
