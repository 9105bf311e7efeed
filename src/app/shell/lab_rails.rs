//! What the laboratory's views derive from the presented tree: rails for each.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::accel::Accel;
use crate::app::shell::merge_rails::MergeRails;
use crate::app::shell::study_rail::StudyRail;
use crate::app::state::dock::DockView;
use crate::app::state::lab::{IcicleInputs, RankingInputs, ScatterInputs};
use crate::app::state::{AppState, OtherTree, RayOutcome, Side};
use crate::lab::diagnose::{Finding, diagnose_scene, diagnose_tree};
use crate::lab::diff::survivors;
use crate::lab::icicle::{IcicleWidth, subtree_sums};
use crate::lab::node_ranking::rank_nodes;
use crate::lab::node_values::NodeValues;
use crate::lab::population::ViewRays;
use crate::lab::ray::{RayRequest, record};
use crate::lab::scaffold::{Scaffold, scaffold};
use crate::lab::visit_scatter::VisitScatter;
use crate::scene::Scene;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::tree::survival::Survival;
use bvhscope_engine::tree::visits::Visits;

/// The rails of all views.
pub(crate) struct LabRails {
    findings: StudyRail<(), Vec<Finding>>,
    scaffold: StudyRail<u32, Result<Scaffold, String>>,
    survival: StudyRail<OtherTree, [Survival; 2]>,
    ray: StudyRail<RayRequest, RayOutcome>,
    visits: StudyRail<ViewRays, Visits>,
    ranking: StudyRail<RankingInputs, Vec<u32>>,
    icicle: StudyRail<IcicleInputs, Vec<f32>>,
    scatter: StudyRail<ScatterInputs, VisitScatter>,
    merges: MergeRails,
}

impl LabRails {
    /// Starts their threads; `wake` is called from them after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + Clone + 'static) -> std::io::Result<Self> {
        let of_scene = Mutex::new((Weak::new(), Vec::new()));
        Ok(Self {
            scaffold: StudyRail::new("curve", "Sorting along the curve", wake.clone(), |accel, level, token| {
                scaffold(accel, *level, token)
            })?,
            visits: StudyRail::new("visits", "Measuring visits", wake.clone(), |accel, rays: &ViewRays, token| {
                rays.measure(accel, token)
            })?,
            ranking: StudyRail::new(
                "ranking",
                "Ranking nodes",
                wake.clone(),
                |accel, inputs: &RankingInputs, token| {
                    let visits = inputs.visits.as_ref().map(|visits| &*visits.0);
                    rank_nodes(&NodeValues { accel, visits }, &inputs.order, token)
                },
            )?,
            icicle: StudyRail::new(
                "icicle",
                "Measuring subtrees",
                wake.clone(),
                |accel, inputs: &IcicleInputs, token| {
                    accel.compute_ancestry(token)?;
                    subtree_sums(accel, inputs.width, inputs.visits.as_ref(), token)
                },
            )?,
            scatter: StudyRail::new(
                "scatter",
                "Comparing visits",
                wake.clone(),
                |accel, inputs: &ScatterInputs, token| {
                    // Plotted beside the measured cost.
                    accel.epo(token)?;
                    VisitScatter::new(accel, inputs.rays.population(), &inputs.visits, token)
                },
            )?,
            merges: MergeRails::new(wake.clone())?,
            findings: StudyRail::new("findings", "Examining", wake.clone(), move |accel, (), token| {
                findings(accel, &of_scene, token)
            })?,
            survival: StudyRail::new(
                "survival",
                "Finding common nodes",
                wake.clone(),
                |accel, other: &OtherTree, token| {
                    let other = other.get().ok_or(Cancelled)?;
                    Ok([survivors(accel, &other, token)?, survivors(&other, accel, token)?])
                },
            )?,
            ray: StudyRail::new("ray", "Recording the ray", wake, record)?,
        })
    }

    /// Takes what is finished, and requests what open views lack once the other workers are `idle`.
    pub(crate) fn follow(&mut self, state: &mut AppState, idle: bool) {
        let accel = state.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel));
        let sections = &state.preferences.sections;
        let findings_open = state.shows_panel(Side::Left) && sections.get("Findings").copied().unwrap_or(false);
        let curve = &mut state.lab.curve;
        let wanted = accel.clone().filter(|_| curve.shown).map(|accel| (accel, curve.level));
        self.scaffold.follow(&mut curve.scaffold, wanted, idle, &mut state.messages);
        let second = state.model.second.as_ref().map(|second| OtherTree::new(&second.accel));
        let pair = accel.clone().zip(second);
        self.survival.follow(&mut state.lab.survival, pair, idle, &mut state.messages);
        // A single ray takes no time from the picture, and is not to wait until all of its samples are traced.
        let wanted = state.wanted_ray();
        self.ray.follow(&mut state.lab.ray.record, wanted, true, &mut state.messages);
        let wanted = accel.clone().filter(|_| findings_open).map(|accel| (accel, ()));
        self.findings.follow(&mut state.lab.findings, wanted, idle, &mut state.messages);
        self.follow_nodes(state, accel.as_ref(), idle);
        self.merges.follow(state, idle);
    }

    /// The views of nodes: visits by the rays of the view, the list of worst nodes, the icicle.
    fn follow_nodes(&mut self, state: &mut AppState, accel: Option<&Arc<Accel>>, idle: bool) {
        let open = state.preferences.dock.open;
        let present = state.view_rays();
        let lab = &mut state.lab;
        let (nodes_open, icicle_open) = (open == Some(DockView::Nodes), open == Some(DockView::Icicle));
        let of_visits = lab.icicle.width == IcicleWidth::Visits;
        let plots_open = open == Some(DockView::Plots);
        let is_wanted = nodes_open || plots_open || icicle_open && (of_visits || lab.icicle.color.needs_visits());
        let inputs = accel.filter(|_| is_wanted).and_then(|accel| {
            // Not before the view has come to rest.
            if lab.rays(&accel.scene).is_none() && idle {
                lab.measure_by(&accel.scene, present);
            }
            Some((Arc::clone(accel), lab.rays(&accel.scene)?))
        });
        self.visits.follow(&mut lab.visits, inputs, idle, &mut state.messages);

        let inputs = accel.filter(|_| nodes_open);
        let inputs = inputs.and_then(|accel| Some((Arc::clone(accel), lab.ranking_inputs(accel)?)));
        self.ranking.follow(&mut lab.nodes.ranking, inputs, idle, &mut state.messages);

        let inputs = accel.filter(|_| icicle_open);
        let inputs = inputs.and_then(|accel| Some((Arc::clone(accel), lab.icicle_inputs(accel)?)));
        self.icicle.follow(&mut lab.icicle.sums, inputs, idle, &mut state.messages);

        let inputs = accel.filter(|_| plots_open);
        let inputs = inputs.and_then(|accel| Some((Arc::clone(accel), lab.scatter_inputs(accel)?)));
        self.scatter.follow(&mut lab.plots.scatter, inputs, idle, &mut state.messages);
        let second = state.model.second.as_ref().map(|second| &second.accel);
        second.into_iter().chain(accel).for_each(|accel| lab.note_tree(accel));
    }

    /// Whether anything is being derived.
    pub(crate) fn is_busy(&self) -> bool {
        self.findings.is_busy()
            || self.scaffold.is_busy()
            || self.survival.is_busy()
            || self.ray.is_busy()
            || self.visits.is_busy()
            || self.ranking.is_busy()
            || self.icicle.is_busy()
            || self.scatter.is_busy()
            || self.merges.is_busy()
    }
}

/// The findings of a tree, those of its scene first, which are kept for the next tree of the same scene.
fn findings(
    accel: &Accel,
    of_scene: &Mutex<(Weak<Scene>, Vec<Finding>)>,
    token: &CancelToken,
) -> Result<Vec<Finding>, Cancelled> {
    let epo = accel.epo(token)?;
    let mut kept = of_scene.lock().unwrap_or_else(PoisonError::into_inner);
    if !std::ptr::eq(kept.0.as_ptr(), Arc::as_ptr(&accel.scene)) {
        *kept = (Arc::downgrade(&accel.scene), diagnose_scene(&accel.scene, token)?);
    }
    let mut findings = kept.1.clone();
    findings.extend(diagnose_tree(accel, epo));
    Ok(findings)
}
