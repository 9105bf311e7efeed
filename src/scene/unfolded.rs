//! Copies of a scene in two levels below which the trees of their meshes are shown.

use serde::{Deserialize, Serialize};

use bvhscope_engine::UnfoldedCopy;

/// A set of copies, as ranges of their indices with both ends, in ascending order and apart from each other.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Vec<[u32; 2]>")]
pub struct CopyRanges(Vec<[u32; 2]>);

impl From<Vec<[u32; 2]>> for CopyRanges {
    fn from(mut ranges: Vec<[u32; 2]>) -> Self {
        ranges.retain(|[first, last]| first <= last);
        ranges.sort_unstable();
        let mut joined: Vec<[u32; 2]> = Vec::new();
        for [first, last] in ranges {
            match joined.last_mut() {
                Some(before) if first <= before[1].saturating_add(1) => before[1] = before[1].max(last),
                _ => joined.push([first, last]),
            }
        }
        Self(joined)
    }
}

impl FromIterator<u32> for CopyRanges {
    fn from_iter<I: IntoIterator<Item = u32>>(copies: I) -> Self {
        let mut copies: Vec<u32> = copies.into_iter().collect();
        copies.sort_unstable();
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for copy in copies {
            match ranges.last_mut() {
                Some([_, last]) if copy <= last.saturating_add(1) => *last = copy,
                _ => ranges.push([copy; 2]),
            }
        }
        Self(ranges)
    }
}

impl CopyRanges {
    /// True if it holds no copy.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// True if it holds the copy.
    pub fn contains(&self, copy: u32) -> bool {
        let after = self.0.partition_point(|[first, _]| *first <= copy);
        after.checked_sub(1).and_then(|at| self.0.get(at)).is_some_and(|[_, last]| copy <= *last)
    }

    /// The copies of a scene of `count`, in ascending order.
    pub fn iter(&self, count: u32) -> impl Iterator<Item = u32> {
        self.0.iter().flat_map(move |&[first, last]| first..last.saturating_add(1).min(count))
    }

    /// Those of a scene of `count`, whose other copies it does not have.
    #[must_use]
    pub fn within(&self, count: u32) -> Self {
        let Some(last) = count.checked_sub(1) else { return Self::default() };
        let inside = self.0.iter().filter(|range| range[0] <= last);
        Self(inside.map(|&[first, end]| [first, end.min(last)]).collect())
    }

    /// Both together.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        [&self.0[..], &other.0].concat().into()
    }
}

/// The copies that are unfolded, and the numbers of their triangles among the primitives of the tree.
#[derive(Debug, Clone, Default)]
pub struct UnfoldedCopies {
    /// The copies.
    pub ranges: CopyRanges,
    /// Each with the primitive that its first triangle is, in ascending order of both.
    pub copies: Vec<UnfoldedCopy>,
}

impl UnfoldedCopies {
    /// The primitive that the first triangle of a copy is; `None` where it is a primitive itself.
    pub(super) fn first_of(&self, copy: u32) -> Option<u32> {
        let at = self.copies.binary_search_by_key(&copy, |unfolded| unfolded.copy).ok()?;
        Some(self.copies[at].first)
    }

    /// The copy that has a primitive, and the index of the triangle in its mesh; `None` where the primitive is a copy itself.
    pub(super) fn find(&self, primitive: u32) -> Option<(u32, u32)> {
        let after = self.copies.partition_point(|unfolded| unfolded.first <= primitive);
        let UnfoldedCopy { copy, first } = *self.copies.get(after.checked_sub(1)?)?;
        Some((copy, primitive.saturating_sub(first)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_apart_and_in_order() {
        let ranges = CopyRanges::from(vec![[7, 9], [3, 2], [10, 12], [0, 1], [8, 8], [20, u32::MAX]]);
        assert_eq!(ranges.0, [[0, 1], [7, 12], [20, u32::MAX]]);
        assert_eq!(ranges.iter(22).collect::<Vec<_>>(), [0, 1, 7, 8, 9, 10, 11, 12, 20, 21]);
        assert_eq!(ranges.within(10).0, [[0, 1], [7, 9]]);
        assert!(ranges.within(0).is_empty());
        assert_eq!(CopyRanges::from_iter([5, 3, 4, 9, 4]).0, [[3, 5], [9, 9]]);
        assert_eq!(CopyRanges::from_iter([3, 5]).with(&CopyRanges::from_iter([4])).0, [[3, 5]]);
        for copy in 0..30 {
            assert_eq!(ranges.contains(copy), ranges.iter(30).any(|other| other == copy), "{copy}");
        }
    }
}
