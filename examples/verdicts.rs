//! How often the verdicts over measured times are right on this machine: a tree is built and traced in turn with the same tree built
//! again, and with one of another threshold and reduction, a hundred times each. Run it as well while other programs load the machine:
//!
//! ```text
//! cargo run --release --example verdicts -- [MODEL [THRESHOLD [ROUNDS [EPSILON]]]]
//! ```

use std::cmp::Ordering;

use bvhscope::camera::Camera;
use bvhscope::catalog::numbers::rows::WIDE_TRACE_MS;
use bvhscope::catalog::reading::quantile;
use bvhscope::lab::population::Populations;
use bvhscope::lab::verdict::{Factor, Order};
use bvhscope::lab::{Measurement, Setup, Subject, TraceView, measure};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::view::Place;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::traverse::Traversal;

/// Comparisons of each kind.
const RUNS: usize = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let model = arguments.next().unwrap_or_else(|| "builtin:teapot".to_owned());
    let threshold = arguments.next().map_or(Ok(30), |text| text.parse())?;
    let rounds = arguments.next().map_or(Ok(51), |text| text.parse())?;
    let epsilon = arguments.next().map(|text| text.parse()).transpose()?.unwrap_or(BuildSettings::default().epsilon);
    let source = SceneSource::parse(model.as_ref())?;
    let scene = std::sync::Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new())?);
    let subject =
        Subject { model, scene, trees: Vec::new(), forms: Vec::new(), rays: None, load: LoadOptions::default() };
    let base = BuildSettings::default();
    for (name, other) in [("itself", base), ("another tree", BuildSettings { threshold, epsilon, ..base })] {
        let factors: Vec<Factor> = (0..RUNS).filter_map(|_| factor(&subject, [base, other], rounds)).collect();
        let mut medians: Vec<f64> = factors.iter().map(|factor| factor.median).collect();
        medians.sort_by(f64::total_cmp);
        let count = |word| factors.iter().filter(|factor| factor.decided() == Some(word)).count();
        println!(
            "{name}: called faster {} and slower {} times in {}; median factor {:.4}",
            count(Ordering::Less),
            count(Ordering::Greater),
            factors.len(),
            quantile(&medians, 0.5),
        );
    }
    Ok(())
}

/// The factor of the times of tracing two trees, each built and traced in turn; `None` if there are none.
fn factor(subject: &Subject, trees: [BuildSettings; 2], rounds: usize) -> Option<Factor> {
    let view = TraceView {
        camera: Camera::framing(&subject.scene.bounds, subject.scene.up),
        place: Place::Given,
        size: [160; 2],
        traversal: Traversal::Ordered,
        simd: SimdLevel::best(),
        repeat: rounds,
        populations: Populations::NONE,
        epo_samples: None,
    };
    let setups = trees.map(|build| Setup { build, preset: None, threads: 1 });
    let mut rows: Vec<Measurement> = Vec::new();
    measure("bench", subject, &setups, &view, &CancelToken::new(), &mut |row| rows.push(row)).ok()?;
    let [a, b] = &rows[..] else { return None };
    Factor::of(a.rounds_of(WIDE_TRACE_MS), b.rounds_of(WIDE_TRACE_MS), Order::InTurn)
}
