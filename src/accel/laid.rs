//! The layout of a tree that heat maps count in place of the trees that are traced.

use std::sync::Arc;

use super::tracer::{CountedQuery, Counting, first_that_counts};
use crate::catalog::layouts::LayoutChoice;
use bvhscope_engine::geometry::{Hit, Ray, Triangle};
use bvhscope_engine::layouts::{KeptNodes, LaidQuery, RayCounts, WalkMemory};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};

/// A layout, and the wide tree that it makes of a tree.
#[derive(Debug, Clone)]
pub struct CountedLayout {
    /// The layout.
    pub choice: LayoutChoice,
    /// Its wide tree.
    pub kept: Arc<KeptNodes>,
}

/// The layouts are the same, of the same tree.
impl PartialEq for CountedLayout {
    fn eq(&self, other: &Self) -> bool {
        self.choice == other.choice && Arc::ptr_eq(&self.kept, &other.kept)
    }
}

impl CountedLayout {
    /// The nearest hits of `rays` that count, which are those of the tree, with the work of each in the layout, into the first elements of
    /// `found`. `leaf_triangles` are those of the tree that was laid out. Of the whole ray all boxes count that it enters as they are
    /// stored, which that of the root is not.
    pub fn counted(
        &self,
        leaf_triangles: &[Triangle],
        rays: &[Ray],
        query: CountedQuery<'_>,
        found: &mut [(Option<Hit>, TestCounts)],
    ) {
        let laid_query = match (query.counting, query.traversal) {
            (Counting::WholeRay, _) | (Counting::Tests, Traversal::Paper) => LaidQuery::Through,
            _ => LaidQuery::Closest,
        };
        let (laid, mut memory) = (self.kept.laid(), WalkMemory::default());
        for (ray, found) in rays.iter().zip(found) {
            let (mut all, mut entered) = (RayCounts::default(), None);
            let hit = first_that_counts(*ray, query.passes, |ray| {
                let hit = laid.walk(leaf_triangles, ray, laid_query, &mut memory, &mut all);
                // Behind a hidden triangle nothing is entered a second time.
                entered.get_or_insert((all.nodes + all.leaves).saturating_sub(1));
                hit
            });
            let [lines, _] = memory.take_lines();
            let [containers, primitives] = match query.counting {
                Counting::Nothing | Counting::Copies => [0; 2],
                Counting::Tests => [all.container_tests, all.triangle_tests],
                Counting::Steps => [all.nodes, all.block_tests],
                Counting::Lines => [lines.nodes, lines.triangles],
                Counting::WholeRay => [entered.unwrap_or(0), 0],
            };
            *found = (hit, TestCounts { containers, primitives });
        }
    }
}
