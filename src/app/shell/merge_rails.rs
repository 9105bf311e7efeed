//! What the view "Merges" derives from the presented tree: its construction, cuts, choices and the exact tree beside it.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::accel::Accel;
use crate::app::shell::study_rail::StudyRail;
use crate::app::state::AppState;
use crate::app::state::dock::DockView;
use crate::app::state::lab::merges::{ChoiceOf, CutNodes, MergePage, MergeStudy};
use crate::lab::merges::{History, Merges, TreeOfRecord, merges_clusters};
use crate::overlay::NodeTable;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{Cut, CutError, ExactComparison, MergeChoice, MergeOrder, compare_with_exact};
use bvhscope_engine::tree::Container as _;
use bvhscope_engine::with_tree;

/// The construction that was recorded last, and the tree that it belongs to.
type LastHistory = Mutex<(Weak<Accel>, Weak<History>)>;

/// The rails of the view.
pub(crate) struct MergeRails {
    study: StudyRail<MergeOrder, Result<MergeStudy, String>>,
    choice: StudyRail<ChoiceOf, Option<MergeChoice>>,
    cut: StudyRail<Cut, CutNodes>,
    price: StudyRail<u32, Result<ExactComparison, String>>,
}

impl MergeRails {
    /// Starts their threads; `wake` is called from them after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + Clone + 'static) -> std::io::Result<Self> {
        let last = LastHistory::default();
        Ok(Self {
            study: StudyRail::new("merges", "Recording merges", wake.clone(), move |accel, &order, token| {
                study(accel, order, &last, token)
            })?,
            choice: StudyRail::new("choice", "Comparing clusters", wake.clone(), |_, of: &ChoiceOf, token| {
                of.history.construction.as_ref().map_or(Ok(None), |construction| construction.choice(of.merge, token))
            })?,
            cut: StudyRail::new("cut", "Cutting the tree", wake.clone(), |accel, &cut, token| {
                cut_nodes(accel, cut, token)
            })?,
            price: StudyRail::new(
                "price",
                "Clustering exactly",
                wake,
                |accel, &node, token| match compare_with_exact(&accel.tree, node, token) {
                    Ok(comparison) => Ok(Ok(comparison)),
                    Err(BuildError::Refused(text)) => Ok(Err(text)),
                    Err(BuildError::Cancelled(cancelled)) => Err(cancelled),
                },
            )?,
        })
    }

    /// Takes what is finished, and requests what the open view lacks once the other workers are `idle`.
    pub(crate) fn follow(&mut self, state: &mut AppState, idle: bool) {
        let open = state.preferences.dock.open == Some(DockView::Merges);
        let accel = state.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel)).filter(|_| open);
        let (merges, messages) = (&mut state.lab.merges, &mut state.messages);
        let order = accel.as_ref().map(|accel| order_of(accel, merges.order));
        self.study.follow(&mut merges.study, accel.clone().zip(order), idle, messages);
        let choice = accel.as_ref().and_then(|accel| Some((Arc::clone(accel), merges.wanted_choice(accel)?)));
        self.choice.follow(&mut merges.choice, choice, idle, messages);
        let cut = merges.wanted_cut();
        self.cut.follow(&mut merges.cut, accel.clone().zip(cut), idle, messages);
        let price = merges.price_of.filter(|_| merges.page == MergePage::Price);
        let price = accel.zip(price).filter(|(accel, node)| (*node as usize) < accel.tree.node_count());
        self.price.follow(&mut merges.price, price, idle, messages);
    }

    /// Whether anything is being derived.
    pub(crate) fn is_busy(&self) -> bool {
        self.study.is_busy() || self.choice.is_busy() || self.cut.is_busy() || self.price.is_busy()
    }
}

/// The order in which the merges of a tree are shown: by distance where its builder merges nothing.
fn order_of(accel: &Accel, wanted: MergeOrder) -> MergeOrder {
    if merges_clusters(accel) { wanted } else { MergeOrder::Distance }
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
        last.1.upgrade().filter(|_| std::ptr::eq(last.0.as_ptr(), Arc::as_ptr(accel)))
    };
    let history = match known.map_or_else(|| History::new(accel, token).map(Arc::new), Ok) {
        Ok(history) => history,
        Err(BuildError::Refused(text)) => return Ok(Err(text)),
        Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
    };
    *last.lock().unwrap_or_else(PoisonError::into_inner) = (Arc::downgrade(accel), Arc::downgrade(&history));
    let merges = Merges::new(accel, &history, order, token)?;
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
        let area = |node: u32| tree.nodes[node as usize].container.relative_area();
        nodes.sort_unstable_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    });
    let set = nodes.iter().copied().collect();
    Ok(CutNodes { largest: nodes, set })
}
