//! The core of every job: several trees of one scene, built and traced alternately, so that a slow phase of the machine
//! affects all of them alike.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use super::measurement::{Measurement, pool};
use super::population::{MeasuredRays, MeasuredVisits};
use super::setup::{Contender, Setup, Subject, TraceView};
use super::trial::{First, Trial};
use super::verdict::add_verdicts;
use crate::accel::Accel;
use crate::catalog::reading::WideReading;
use crate::render::{RenderRequest, RenderSettings, count_tests, trace_primary, trace_primary_wide};
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::fingerprint;

/// The reason why a measurement ended early.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LabError {
    /// The measurement was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The measurement is impossible; the text states why.
    #[error("{0}")]
    Refused(String),
}

impl From<BuildError> for LabError {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            BuildError::Refused(text) => Self::Refused(text),
        }
    }
}

/// Takes the rows of a measurement as they are made.
pub trait RowSink {
    /// A measured row.
    fn row(&mut self, row: Measurement);

    /// The rows so far of the trees that are measured together, after each repetition of one of them. In the end each is passed
    /// to [`RowSink::row`], with all repetitions.
    fn preliminary(&mut self, rows: Vec<Measurement>) {
        drop(rows);
    }
}

impl<F: FnMut(Measurement)> RowSink for F {
    fn row(&mut self, row: Measurement) {
        self(row);
    }
}

/// Measures `setups` on one scene, interleaved: each is built and traced once, then all again in the opposite order, for `view.repeat` rounds.
/// One row per setup, in the order of `setups`, is passed to `rows` at the end. When cancelled, setups with at least one
/// completed repetition still give a row before the error is returned.
pub fn measure(
    command: &str,
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let contenders: Vec<Contender> = setups.iter().map(|&setup| setup.into()).collect();
    measure_contenders(command, subject, &contenders, view, token, rows)
}

/// [`measure`] of trees of which some are read from files. These are not built again: the time of their build is what their
/// files say.
pub fn measure_contenders(
    command: &str,
    subject: &Subject,
    contenders: &[Contender],
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let measured = |trials: &[Trial]| -> Vec<Measurement> {
        let row = |(contender, trial): (&Contender, &Trial)| {
            trial.first.as_ref().map(|first| trial.measurement(command, subject, contender, view, first))
        };
        let mut rows: Vec<Measurement> = contenders.iter().zip(trials).filter_map(row).collect();
        add_verdicts(&mut rows);
        rows
    };
    let mut trials: Vec<Trial> = contenders.iter().map(|_| Trial::default()).collect();
    let mut repeated = |trials: &[Trial]| rows.preliminary(measured(trials));
    let outcome = repeat(subject, contenders, view, token, &mut trials, &mut repeated);
    for row in measured(&trials) {
        rows.row(row);
    }
    outcome
}

fn repeat(
    subject: &Subject,
    contenders: &[Contender],
    view: &TraceView,
    token: &CancelToken,
    trials: &mut [Trial],
    repeated: &mut dyn FnMut(&[Trial]),
) -> Result<(), LabError> {
    // Trees of one number of threads share them: with threads of its own, a tree whose thread runs on a busier core than that of another
    // for a while is called slower.
    let mut pools = BTreeMap::new();
    for threads in contenders.iter().map(|contender| contender.setup.threads) {
        if let Entry::Vacant(none) = pools.entry(threads) {
            none.insert(pool(threads).map_err(LabError::Refused)?);
        }
    }
    let rounds = view.repeat.max(1);
    for round in 0..rounds {
        for (turn, index) in turns(round, contenders.len()).enumerate() {
            let token = token.part(round * contenders.len() + turn, rounds * contenders.len());
            pools[&contenders[index].setup.threads]
                .install(|| try_once(subject, &contenders[index], view, &token, &mut trials[index]))?;
            repeated(trials);
        }
    }
    Ok(())
}

/// The order of `count` trees in a round: theirs, and backwards in each second one, so that none always follows the same other, and a
/// drift of the machine within a round is none between them.
pub(super) fn turns(round: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |turn| if round.is_multiple_of(2) { turn } else { count - 1 - turn })
}

/// One repetition of one tree. Only one built tree exists at a time, so that the largest scene that can be shown can also be
/// measured.
fn try_once(
    subject: &Subject,
    contender: &Contender,
    view: &TraceView,
    token: &CancelToken,
    trial: &mut Trial,
) -> Result<(), LabError> {
    let (scene, build) = (subject.scene_of(contender), &contender.setup.build);
    let accel = match (&contender.read, contender.opened()) {
        (Some(read), _) => Arc::clone(read),
        (None, Some(open)) => Arc::new(Accel::build_opened(scene, build, open, &token.part(0, 3))?),
        (None, None) => Arc::new(Accel::build_binary(scene, build, &token.part(0, 3))?),
    };
    accel.widen(&token.part(0, 3))?;
    let trace = match contender.opened() {
        None => Some(trace_primary(&request(&accel, view), view.traversal, &token.part(1, 3))?),
        // There is no binary tree over parts.
        Some(_) => None,
    };
    let first = if trial.first.is_none() {
        Some(First {
            tests: count_tests(&request(&accel, view), &token.part(2, 3))?,
            threads: rayon::current_num_threads(),
            report: accel.report.clone(),
            epo: accel.epo(view.epo_samples, &token.part(2, 3))?,
            hashes: [fingerprint::of_tree(&accel.tree, token)?, fingerprint::of_wide_tree(&accel.wide().tree, token)?],
            wide: WideReading::of(accel.wide()),
            populations: match contender.opened() {
                None => populations(subject, &accel, view, token)?,
                Some(_) => Vec::new(),
            },
            traced_bytes: accel.traced_bytes(),
        })
    } else {
        None
    };
    let wide_trace = trace_primary_wide(&request(&accel, view), &token.part(2, 3))?;
    trial.record(&accel.report.stages, trace.as_ref(), accel.entered_first().collapse_time, &wide_trace);
    if let Some(first) = first {
        trial.first = Some(first);
    }
    token.set_progress(1.0);
    Ok(())
}

/// Cost of the rays of each wanted population.
fn populations(
    subject: &Subject,
    accel: &Arc<Accel>,
    view: &TraceView,
    token: &CancelToken,
) -> Result<Vec<MeasuredRays>, Cancelled> {
    // Progress is that of the repetition.
    visits(subject, accel, view, &token.part(2, 3)).map(|measured| Ok(measured?.sums)).collect()
}

/// The visits of the nodes by the rays of each wanted population, measured one after the other.
pub(super) fn visits<'a>(
    subject: &'a Subject,
    accel: &'a Arc<Accel>,
    view: &'a TraceView,
    token: &'a CancelToken,
) -> impl Iterator<Item = Result<MeasuredVisits, Cancelled>> + 'a {
    let settings = request(accel, view).settings;
    view.populations.iter().map(move |population| subject.rays_of(population, view, &settings).measure(accel, token))
}

/// The picture whose rays are traced.
pub(super) fn request(accel: &Arc<Accel>, view: &TraceView) -> RenderRequest {
    RenderRequest::new(accel, view.camera, request_settings(view), view.size)
}

/// The settings of that picture.
pub(super) fn request_settings(view: &TraceView) -> RenderSettings {
    RenderSettings { traversal: view.traversal, simd: view.simd, ..RenderSettings::default() }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::lab::population::Populations;
    use crate::scene::{LoadOptions, SceneSource, load};
    use crate::view::Place;
    use bvhscope_engine::kernel::SimdLevel;
    use bvhscope_engine::settings::{BuildSettings, Preset};
    use bvhscope_engine::tree::ContainerKind;
    use bvhscope_engine::tree::traverse::Traversal;

    /// Progress of a measurement, in order.
    #[derive(Default)]
    struct Passed {
        preliminary: Vec<Vec<Measurement>>,
        rows: Vec<Measurement>,
    }

    impl RowSink for Passed {
        fn row(&mut self, row: Measurement) {
            self.rows.push(row);
        }

        fn preliminary(&mut self, rows: Vec<Measurement>) {
            assert!(self.rows.is_empty(), "all repetitions come before the first row");
            self.preliminary.push(rows);
        }
    }

    #[test]
    fn rows_are_seen_after_each_repetition() {
        let source = SceneSource::parse("builtin:cornell".as_ref()).unwrap();
        let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
        let view = TraceView {
            camera: Camera::framing(&scene.bounds, scene.up),
            place: Place::Given,
            size: [8, 8],
            traversal: Traversal::Ordered,
            simd: SimdLevel::default(),
            repeat: 2,
            populations: Populations::ALL,
            epo_samples: None,
        };
        let subject = Subject {
            model: source.to_string(),
            scene,
            trees: Vec::new(),
            forms: Vec::new(),
            rays: None,
            load: LoadOptions::default(),
        };
        let setups = ContainerKind::OF_PAPER.map(|container| Setup {
            build: BuildSettings::preset(Preset::Fast, container),
            preset: None,
            threads: 1,
        });
        let mut passed = Passed::default();
        measure("bench", &subject, &setups, &view, &CancelToken::new(), &mut passed).unwrap();
        let containers = |rows: &[Measurement]| rows.iter().map(|row| row.container).collect::<Vec<_>>();
        let all = ContainerKind::OF_PAPER.to_vec();
        let seen: Vec<_> = passed.preliminary.iter().map(|rows| containers(rows)).collect();
        assert_eq!(seen, [all[..1].to_vec(), all.clone(), all.clone(), all.clone()]);
        assert_eq!(containers(&passed.rows), all);
        // The last preliminary rows have all repetitions.
        assert_eq!(passed.preliminary.last(), Some(&passed.rows));
    }
}
