//! The record of the ray.

use crate::app::studies::{Studies, StudyPlan};
use crate::lab::ray::record;

pub(super) fn add(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "ray",
        label: "Recording the ray",
        // A single ray takes no time from the picture, and does not wait until all of its samples are traced.
        at_once: true,
        study: |state| &mut state.lab.ray.record,
        wanted: |state, _| state.wanted_ray(),
    };
    studies.add(plan, record)
}
