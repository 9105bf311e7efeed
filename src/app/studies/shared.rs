//! Studies that no view of the dock owns: readings at rest, findings, the curve over the picture, nodes that two trees have in common or
//! that passes have moved.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{Studies, StudyPlan};
use crate::accel::{Accel, is_same};
use crate::app::state::{Derived, LayoutOf, OtherTree, Side, before_passes};
use crate::lab::LabError;
use crate::lab::at_rest::{estimate_tests, measure_at_rest};
use crate::lab::diagnose::{Finding, diagnose_scene, diagnose_tree};
use crate::lab::diff::survivors;
use crate::lab::layouts::kept_nodes;
use crate::lab::pool;
use crate::lab::scaffold::scaffold;
use crate::overlay::ColorBy;
use crate::scene::Scene;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Adds them.
pub(crate) fn add(studies: &mut Studies) -> std::io::Result<()> {
    add_readings(studies)?;
    add_moved(studies)?;
    add_edges(studies)?;
    add_estimates(studies)?;
    add_layout(studies)?;
    let of_scene = Mutex::new((Weak::new(), Vec::new()));
    studies.add(
        StudyPlan::new(
            "findings",
            "Examining",
            |state| &mut state.model.derived.findings,
            |state, _| {
                let is_open = state.preferences.sections.get("Findings").copied().unwrap_or(false);
                Some((state.presented_tree().filter(|_| is_open && state.shows_panel(Side::Left))?, ()))
            },
        ),
        move |accel, (), token| findings(accel, &of_scene, token),
    )?;
    studies.add(
        StudyPlan::new(
            "curve",
            "Sorting along the curve",
            |state| &mut state.model.curve.scaffold,
            |state, _| {
                let curve = &state.model.curve;
                Some((state.presented_tree().filter(|_| curve.shown)?, curve.level))
            },
        ),
        |accel, level, token| scaffold(accel, *level, token),
    )?;
    studies.add(
        StudyPlan::new(
            "survival",
            "Finding common nodes",
            |state| &mut state.model.derived.survival,
            |state, _| {
                let second = state.model.second.as_ref()?;
                Some((state.presented_tree()?, OtherTree::new(&second.accel)))
            },
        ),
        |accel, other: &OtherTree, token| {
            let other = other.get().ok_or(Cancelled)?;
            Ok([survivors(accel, &other, token)?, survivors(&other, accel, token)?])
        },
    )
}

/// The nodes that passes have moved, for the colours of containers while there is no second tree.
fn add_moved(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "moved",
        "Finding moved nodes",
        |state| &mut state.model.derived.moved,
        |state, _| {
            let is_wanted = state.colors_by(ColorBy::Survival) && state.wanted.second.is_none();
            Some((state.presented_tree().filter(|accel| is_wanted && before_passes(accel).is_some())?, ()))
        },
    );
    studies.add(plan, |accel, (), token| {
        let settings = before_passes(accel).ok_or(Cancelled)?;
        // One that is refused for memory is left, too, without an answer.
        let before = Accel::build_binary(&accel.scene, &settings, token).map_err(|_| Cancelled)?;
        Ok([survivors(accel, &before, token)?, survivors(&before, accel, token)?])
    })
}

/// The edges of the model, for the section "Scene", once the readings at rest are taken, which it would disturb. A large model is examined
/// on request only.
fn add_edges(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "edges",
        "Counting open edges",
        |state| &mut state.model.derived.edges,
        |state, idle| {
            let accel = state.presented_tree()?;
            let Derived { at_rest, counts_edges, .. } = &state.model.derived;
            let is_due = *counts_edges || accel.scene.triangles.len() <= Derived::MOST_EDGES_AT_ONCE;
            let is_disturbing = at_rest.is_disturbed || !at_rest.is_off && accel.at_rest().is_none();
            (idle && is_due && !is_disturbing && !state.model.playback.playing).then_some((accel, ()))
        },
    );
    studies.add(plan, |accel, (), token| accel.scene.compute_edges(token).map(drop))
}

/// Estimates of the tests of a ray, while the picture is still traced. Where every ray tests every triangle they would take too long.
fn add_estimates(studies: &mut Studies) -> std::io::Result<()> {
    const MOST_UNSORTED: usize = 10_000;
    let plan = StudyPlan {
        at_once: true,
        is_quiet: true,
        ..StudyPlan::new(
            "estimates",
            "Estimating tests",
            |state| &mut state.model.derived.estimates,
            |state, _| {
                let first = state.presented_tree()?;
                let second = state.model.second.as_ref().map(|second| &second.accel);
                let is_quick =
                    |tree: &Arc<Accel>| tree.tree.node_count() > 1 || tree.scene.triangles.len() < MOST_UNSORTED;
                let trees = || std::iter::once(&first).chain(second);
                let is_due = trees().any(|tree| !tree.is_estimated()) && trees().all(is_quick);
                let second = second.map(OtherTree::new);
                (is_due && !state.model.playback.playing).then_some((first, second))
            },
        )
    };
    studies.add(plan, |accel, second, token| {
        estimate_tests(accel, token)?;
        second.as_ref().and_then(OtherTree::get).map_or(Ok(()), |second| estimate_tests(&second, token))
    })
}

/// The nodes that the layout on show keeps.
fn add_layout(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "layout",
        "Laying out the wide tree",
        |state| &mut state.model.layout.kept,
        |state, _| {
            let accel = state.presented_tree()?;
            let inputs = state.model.layout.inputs(&state.model.derived, &accel)?;
            Some((accel, inputs))
        },
    );
    studies.add(plan, |accel, LayoutOf { layout, rays }: &LayoutOf, token| {
        match kept_nodes(accel, *layout, rays.as_ref(), token) {
            Ok(kept) => Ok(Ok(Arc::new(kept))),
            Err(LabError::Refused(reason)) => Ok(Err(reason)),
            Err(LabError::Cancelled(cancelled)) => Err(cancelled),
        }
    })
}

/// Readings of both trees in turn, which any input cancels.
fn add_readings(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "readings",
        label: "Measuring",
        at_once: false,
        is_quiet: true,
        study: |state| &mut state.model.derived.at_rest.readings,
        wanted: |state, idle| {
            let shown = state.model.presented.as_ref().filter(|_| state.model.derived.at_rest.may_measure(idle))?;
            let second = state.model.second.as_ref().map(|second| OtherTree::new(&second.accel));
            Some((Arc::clone(&shown.accel), (shown.threads, second)))
        },
    };
    studies.add(plan, |accel, (threads, second), token| {
        let second = second.as_ref().and_then(OtherTree::get);
        let trees: Vec<&Arc<Accel>> = std::iter::once(accel).chain(&second).collect();
        match pool(*threads) {
            Ok(pool) => pool.install(|| measure_at_rest(&trees, token)),
            Err(_) => Err(Cancelled),
        }
    })
}

/// The findings of a tree, those of its scene first, which are kept for the next tree of the same scene.
fn findings(
    accel: &Accel,
    of_scene: &Mutex<(Weak<Scene>, Vec<Finding>)>,
    token: &CancelToken,
) -> Result<Vec<Finding>, Cancelled> {
    let epo = accel.epo(None, token)?;
    let mut kept = of_scene.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_same(&kept.0, &accel.scene) {
        *kept = (Arc::downgrade(&accel.scene), diagnose_scene(&accel.scene, token)?);
    }
    let mut findings = kept.1.clone();
    findings.extend(diagnose_tree(accel, epo));
    Ok(findings)
}
