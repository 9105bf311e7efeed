//! Studies that no view of the dock owns: readings at rest, findings, the curve over the picture, nodes that two trees have in common or
//! that passes have moved.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{Studies, StudyPlan};
use crate::accel::{Accel, is_same};
use crate::app::state::{OtherTree, Side, before_passes};
use crate::lab::at_rest::measure_at_rest;
use crate::lab::diagnose::{Finding, diagnose_scene, diagnose_tree};
use crate::lab::diff::survivors;
use crate::lab::pool;
use crate::lab::scaffold::scaffold;
use crate::overlay::ColorBy;
use crate::scene::Scene;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Adds them.
pub(crate) fn add(studies: &mut Studies) -> std::io::Result<()> {
    add_readings(studies)?;
    add_moved(studies)?;
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
