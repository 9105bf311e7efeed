//! The builders, presets and optimisation passes compared on one scene.

use super::copy_forms::form_name;
use super::measure::{LabError, RowSink, measure_contenders};
use super::setup::{Contender, SceneForm, Setup, Subject, TraceView};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

/// Combinations of passes compared beside the preset Best, so that the effect of each pass shows. The optimising passes include
/// collapse, so that trees are compared with the same kind of leaves.
const PASSES: [Passes; 7] = [
    Passes::NONE.with(Pass::Split),
    Passes::NONE.with(Pass::Collapse),
    Passes::NONE.with(Pass::Collapse).with(Pass::Restructure),
    Passes::NONE.with(Pass::Collapse).with(Pass::Reinsert),
    Passes::FINISHED.with(Pass::Split),
    Passes::NONE.with(Pass::Orient),
    Passes::FINISHED.with(Pass::Orient),
];

/// Setups of every builder that supports `primitive_count` primitives in each of `containers`: AAC by preset, by curve and, for
/// boxes, by pass, then the other builders. The slow presets only if `slow`.
pub fn compared_setups(containers: &[ContainerKind], primitive_count: usize, slow: bool, threads: usize) -> Vec<Setup> {
    let mut setups = Vec::new();
    for &container in containers {
        for preset in Preset::ALL.into_iter().filter(|preset| slow || !preset.is_slow()) {
            let build = BuildSettings::preset(preset, ContainerKind::Aabb).for_container(container);
            setups.push(Setup { build, preset: Some(preset), threads });
        }
        let base = BuildSettings::preset(Preset::Fast, ContainerKind::Aabb).for_container(container);
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
        // AAC's rows come first, and without a tree there is nothing to compare.
        let others = BuilderKind::ALL.into_iter().filter(|kind| !(kind.is_aac() || *kind == BuilderKind::None));
        for builder in others {
            let build = BuildSettings { builder, ..base };
            if build.refusal(primitive_count).is_none() {
                setups.push(Setup { build, preset: None, threads });
            }
        }
    }
    setups
}

/// Measures those of [`compared_setups`] that the subject can have and its trees from files, one row each.
pub fn compare(
    subject: &Subject,
    containers: &[ContainerKind],
    slow: bool,
    threads: usize,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let setups = compared_setups(containers, subject.scene.triangles.len(), slow, threads);
    let mut contenders = subject.contenders(&subject.possible(&setups), threads);
    if !subject.forms.is_empty() {
        let is_own = |own: &&mut Contender| own.read.is_none() && own.setup.build == settings_of_forms();
        // Its forms stand beside it.
        if let Some(own) = contenders.iter_mut().find(is_own) {
            own.label = Some(name_in(&SceneForm::of(&subject.scene)));
        }
        contenders.extend(subject.forms.iter().map(|form| in_form(form, threads)));
    }
    measure_contenders("compare", subject, &contenders, view, token, rows)
}

/// The settings of the trees of all forms of a scene of copies.
pub fn settings_of_forms() -> BuildSettings {
    BuildSettings::preset(Preset::Fast, ContainerKind::Aabb)
}

/// The tree of the preset Fast in a form of the scene.
fn in_form(form: &SceneForm, threads: usize) -> Contender {
    let setup = Setup { build: settings_of_forms(), preset: Some(Preset::Fast), threads };
    Contender { label: Some(name_in(form)), form: Some(form.clone()), ..setup.into() }
}

/// The name of that tree.
fn name_in(form: &SceneForm) -> String {
    format!("{}, {}", Preset::Fast.name(), form_name(form.open))
}
