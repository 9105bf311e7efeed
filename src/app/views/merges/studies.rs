//! Data that the view "Merges" derives from the presented tree: its construction, cuts, choices and the exact tree beside it.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::MergesView;
use crate::accel::{Accel, is_same};
use crate::app::state::picture_cut::{ChoiceOf, CutNodes, MergePage, MergeStudy};
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::merges::{History, Merges, TreeOfRecord, is_recorded};
use crate::overlay::NodeTable;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{Cut, CutError, MergeOrder, compare_with_exact};
use bvhscope_engine::with_tree;

/// The construction that was recorded last, and the tree that it belongs to.
type LastHistory = Mutex<(Weak<Accel>, Weak<History>)>;

pub(super) fn add(studies: &mut Studies) -> std::io::Result<()> {
    add_merges(studies)?;
    add_choice(studies)?;
    add_cut(studies)?;
    add_price(studies)
}

fn add_merges(studies: &mut Studies) -> std::io::Result<()> {
    let last = LastHistory::default();
    let plan = StudyPlan::new(
        "merges",
        "Recording the construction",
        |state| &mut state.model.cut.study,
        |state, _| state.inputs_of(|_: &MergesView, model, accel| Some(order_of(accel, model.cut.order))),
    );
    studies.add(plan, move |accel, &order, token| study(accel, order, &last, token))
}

fn add_choice(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "choice",
        "Comparing clusters",
        |state| &mut state.model.cut.choice,
        |state, _| state.inputs_of(|_: &MergesView, model, accel| model.cut.wanted_choice(accel)),
    );
    studies.add(plan, |_, of: &ChoiceOf, token| {
        of.history.construction().map_or(Ok(None), |construction| construction.choice(of.merge, token))
    })
}

fn add_cut(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "cut",
        "Cutting the tree",
        |state| &mut state.model.cut.cut,
        |state, _| state.inputs_of(|_: &MergesView, model, _| model.cut.wanted_cut()),
    );
    studies.add(plan, |accel, &cut, token| cut_nodes(accel, cut, token))
}

fn add_price(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "price",
        "Clustering exactly",
        |state| &mut state.model.cut.price,
        |state, _| {
            state.inputs_of(|_: &MergesView, model, accel| {
                let node = model.cut.price_of.filter(|_| model.cut.page == MergePage::Price)?;
                ((node as usize) < accel.tree.node_count()).then_some(node)
            })
        },
    );
    studies.add(plan, |accel, &node, token| match compare_with_exact(&accel.tree, node, token) {
        Ok(comparison) => Ok(Ok(comparison)),
        Err(BuildError::Refused(text)) => Ok(Err(text)),
        Err(BuildError::Cancelled(cancelled)) => Err(cancelled),
    })
}

/// The order in which the merges or splits of a tree are shown: by distance where nothing is recorded of them.
fn order_of(accel: &Accel, wanted: MergeOrder) -> MergeOrder {
    if is_recorded(accel) { wanted } else { MergeOrder::Distance }
}

/// The merges of a tree. Its construction is recorded once for all orders.
fn study(
    accel: &Arc<Accel>,
    order: MergeOrder,
    last: &LastHistory,
    token: &CancelToken,
) -> Result<Result<MergeStudy, String>, Cancelled> {
    let known = {
        let last = last.lock().unwrap_or_else(PoisonError::into_inner);
        last.1.upgrade().filter(|_| is_same(&last.0, accel))
    };
    let history = match known.map_or_else(|| History::new(accel, &token.part(0, 2)).map(Arc::new), Ok) {
        Ok(history) => history,
        Err(BuildError::Refused(text)) => return Ok(Err(text)),
        Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
    };
    *last.lock().unwrap_or_else(PoisonError::into_inner) = (Arc::downgrade(accel), Arc::downgrade(&history));
    let merges = Merges::new(accel, &history, order, &token.part(1, 2))?;
    let table = match &history.of {
        TreeOfRecord::Same => None,
        TreeOfRecord::Before(before) => Some(Arc::new(NodeTable::new(before))),
    };
    // Depths of clusters are found through their parents.
    table.as_ref().map_or_else(|| accel.compute_ancestry(token).map(|_| ()), |table| table.study(token))?;
    Ok(Ok(MergeStudy { merges, table }))
}

/// The nodes of a cut, largest first.
fn cut_nodes(accel: &Accel, cut: Cut, token: &CancelToken) -> Result<CutNodes, Cancelled> {
    let mut nodes = match cut.nodes(&accel.tree, None, token) {
        Ok(nodes) => nodes,
        Err(CutError::Cancelled(cancelled)) => return Err(cancelled),
        // Cuts by area and by number of primitives need none.
        Err(CutError::NeedsTimeline) => Vec::new(),
    };
    accel.compute_ancestry(token)?;
    with_tree!(&accel.tree, tree => {
        let area = |node: u32| tree.area(node);
        nodes.sort_unstable_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    });
    let set = nodes.iter().copied().collect();
    Ok(CutNodes { largest: nodes, set })
}
