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

/// The picture tinted last, and what it was made from.
#[derive(Default)]
pub(crate) struct Tint {
    /// Table and node, and the triangles below the node.
    selected: Option<((u64, u32), TriangleSet)>,
    /// Picture, table and node.
    last: Option<((u64, u64, u32), Tinted)>,
    count: u64,
}

impl Tint {
    /// The presented picture with the triangles of the selected node tinted; `None` where none is selected, or the root, which
    /// is everything, and where colours stand for values.
    pub(crate) fn update(&mut self, state: &AppState, presented: &Presented) -> Option<Tinted> {
        let exists = |node: &u32| (1..presented.table.len() as u32).contains(node);
        let node = state.selection.nodes.selected.filter(exists)?;
        if presented.frame.settings.shading.is_coded() {
            return None;
        }
        let table = presented.table.id;
        let key = (presented.frame_id, table, node);
        if let Some((_, tinted)) = self.last.as_ref().filter(|(last, _)| *last == key) {
            return Some(tinted.clone());
        }
        let selected = match self.selected.take().filter(|(last, _)| *last == (table, node)) {
            Some((_, triangles)) => triangles,
            None => presented.table.triangles_below(node),
        };
        self.count += 1;
        let rgba = Arc::new(tinted(&presented.frame.rgba, &presented.frame.primitive, &selected));
        let tinted = Tinted { id: TINTED | self.count, rgba };
        self.selected = Some(((table, node), selected));
        self.last = Some((key, tinted.clone()));
        Some(tinted)
    }
}
