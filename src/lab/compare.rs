//! The builders side by side.

use super::measure::{LabError, Setup, Subject, TraceView, measure};
use super::measurement::Measurement;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

/// What is compared beside the preset Best, so that each pass shows what it brings: all of them with the leaves that collapse
/// makes, which is what trees with and without large leaves compare by.
const PASSES: [Passes; 5] = [
    Passes::NONE.with(Pass::Split),
    Passes::NONE.with(Pass::Collapse),
    Passes::NONE.with(Pass::Collapse).with(Pass::Restructure),
    Passes::NONE.with(Pass::Collapse).with(Pass::Reinsert),
    Passes::ALL,
];

/// Every builder that can build `primitive_count` triangles into these containers: AAC by preset, by curve and, in boxes, by pass,
/// then the others.
pub fn compared_setups(containers: &[ContainerKind], primitive_count: usize, threads: usize) -> Vec<Setup> {
    let mut setups = Vec::new();
    for &container in containers {
        for preset in Preset::ALL {
            setups.push(Setup { build: BuildSettings::preset(preset, container), preset: Some(preset), threads });
        }
        let base = BuildSettings::preset(Preset::Fast, container);
        setups.extend([Curve::Hilbert, Curve::Extended].map(|curve| Setup {
            build: BuildSettings { curve, ..base },
            preset: None,
            threads,
        }));
        if container == ContainerKind::Aabb {
            setups.extend(PASSES.map(|optimize| Setup {
                build: BuildSettings { optimize, ..base },
                preset: None,
                threads,
            }));
        }
        for builder in [BuilderKind::Lbvh, BuilderKind::BinnedSah, BuilderKind::Exact] {
            let build = BuildSettings { builder, ..base };
            if build.refusal(primitive_count).is_none() {
                setups.push(Setup { build, preset: None, threads });
            }
        }
    }
    setups
}

/// One row a builder, measured in turn.
pub fn compare(
    subject: &Subject,
    containers: &[ContainerKind],
    threads: usize,
    view: &TraceView,
    token: &CancelToken,
    row: &mut dyn FnMut(Measurement),
) -> Result<(), LabError> {
    let setups = compared_setups(containers, subject.scene.triangles.len(), threads);
    measure("compare", subject, &setups, view, token, row)
}
