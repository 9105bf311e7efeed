//! The presented picture with the selected triangles tinted, made once per picture and selection.

use std::sync::Arc;

use crate::app::state::{AppState, Presented};
use crate::overlay::tinted;
use crate::visibility::TriangleSet;

/// A tinted picture.
#[derive(Clone)]
pub(crate) struct Tinted {
    /// Identifies it among tinted and plain pictures.
    pub(crate) id: u64,
    /// Its pixels, as those of the frame.
    pub(crate) rgba: Arc<Vec<[u8; 4]>>,
}

/// Set in the ids of tinted pictures, which plain ones do not have.
const TINTED: u64 = 1 << 63;

/// Nodes whose triangles are collected in one UI frame.
const NODES_PER_FRAME: usize = 100_000;

/// Triangles below a node, as far as they are collected.
struct Collected {
    triangles: TriangleSet,
    /// The nodes that are still to be visited.
    open: Vec<u32>,
}

/// The picture tinted last, and what it was made from.
#[derive(Default)]
pub(crate) struct Tint {
    /// Table and node, and the triangles below the node.
    selected: Option<((u64, u32), Collected)>,
    /// Picture, table and node.
    last: Option<((u64, u64, u32), Tinted)>,
    count: u64,
}

impl Tint {
    /// The presented picture with the triangles of the selected node tinted; `None` where none is selected, or the root, which
    /// is everything, and where colours stand for values.
    pub(crate) fn update(&mut self, state: &AppState, presented: &Presented) -> Option<Tinted> {
        let exists = |node: &u32| (1..presented.table.len() as u32).contains(node);
        let is_coded = presented.frame.settings.shading.is_coded();
        let Some(node) = state.selection.nodes.selected.filter(|node| exists(node) && !is_coded) else {
            self.selected = None;
            return None;
        };
        let table = presented.table.id;
        let key = (presented.frame_id, table, node);
        if let Some((_, tinted)) = self.last.as_ref().filter(|(last, _)| *last == key) {
            return Some(tinted.clone());
        }
        let mut selected = if let Some((last, collected)) = self.selected.take()
            && last == (table, node)
        {
            collected
        } else {
            let triangles = TriangleSet::none(presented.accel.scene.triangles.len());
            Collected { triangles, open: vec![node] }
        };
        presented.table.collect_triangles(&mut selected.open, &mut selected.triangles, NODES_PER_FRAME);
        let Collected { triangles, open } = &selected;
        let tinted = open.is_empty().then(|| {
            self.count += 1;
            let rgba = Arc::new(tinted(&presented.frame.rgba, &presented.frame.primitive, triangles));
            Tinted { id: TINTED | self.count, rgba }
        });
        self.selected = Some(((table, node), selected));
        let tinted = tinted?;
        self.last = Some((key, tinted.clone()));
        Some(tinted)
    }

    /// Whether the triangles of the selected node are still being collected.
    pub(crate) fn is_collecting(&self) -> bool {
        self.selected.as_ref().is_some_and(|(_, collected)| !collected.open.is_empty())
    }
}
