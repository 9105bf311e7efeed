//! A sentence on what another container than the paper's saves of the box's tests, and at which price.

use super::format::name_among;
use crate::catalog::numbers::rows::{TESTS_PER_ENTERING_RAY, TESTS_PER_RAY, TRACE_MS};
use crate::lab::measurement::{Measurement, ModelView, model_views};
use crate::lab::verdict::{Factor, Order};
use crate::text::counted;
use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, Sphere};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::wide::{WideContainer, WideNode};

/// For each model and each container that was measured with the box: the tests of the same rays, those that enter the scene's box, in the
/// picture and in each population; the time of a test, and the size of a node.
pub(super) fn findings(rows: &[Measurement]) -> Vec<String> {
    let all = model_views(rows);
    let sentence = |model: ModelView<'_>, kind: ContainerKind| {
        let built = |row: &&Measurement| row.view() == model && row.builder != "none" && row.tree.is_none();
        let of = |kind| rows.iter().filter(built).find(|row| row.container == kind);
        finding(of(ContainerKind::Aabb)?, of(kind)?).map(|text| format!("{}: {text}.", name_among(model, &all)))
    };
    let others = ContainerKind::WITH_ORIENTED.into_iter().filter(|kind| *kind != ContainerKind::Aabb);
    let pairs = all.iter().flat_map(|model| others.clone().map(move |kind| (*model, kind)));
    pairs.filter_map(|(model, kind)| sentence(model, kind)).collect()
}

/// "14-DOPs take 3 % more tests of the picture's rays, 41 % fewer of bounce rays, at 1.9 times the price of a test and 480 bytes for a node of
/// the wide tree instead of 224".
fn finding(boxes: &Measurement, other: &Measurement) -> Option<String> {
    let [of_picture, of_all] =
        [TESTS_PER_ENTERING_RAY, TESTS_PER_RAY].map(|tests| other.number(tests) / boxes.number(tests));
    let mut parts = vec![format!("{} tests of the picture's rays", change(of_picture)?)];
    for rays in boxes.populations.iter().filter(|rays| rays.population.is_same_in_all_trees()) {
        let same = other.populations.iter().find(|others| others.population == rays.population);
        let ratio = same.and_then(|others| Some(others.tests_per_entering_ray? / rays.tests_per_entering_ray?));
        if let Some(change) = ratio.and_then(change) {
            parts.push(format!("{change} of {} rays", rays.population.name()));
        }
    }
    // All rays were timed.
    let price = price(boxes, other, of_all).map_or_else(String::new, |price| format!(", {price},"));
    let [node, of_boxes] = [other.container, boxes.container].map(node_bytes);
    Some(format!(
        "{} take {}{price} and {node} bytes for a node of the wide tree instead of {of_boxes}",
        other.container.plural(),
        parts.join(", ")
    ))
}

/// "at 1.60 times the price of a test (1.55 to 1.66 over 9 rounds)": the factor of the trace times over that of the counts. `None` where both
/// were traced once; without a number where its rounds do not say on which side of 1 it is.
fn price(boxes: &Measurement, other: &Measurement, tests: f64) -> Option<String> {
    let scaled: Vec<f64> = other.rounds_of(TRACE_MS).iter().map(|ms| ms / tests).collect();
    let factor = Factor::of(boxes.rounds_of(TRACE_MS), &scaled, Order::InTurn)?;
    match factor.interval.filter(|_| factor.decided().is_some()) {
        Some([least, most]) => Some(format!(
            "at {:.2} times the price of a test ({least:.2} to {most:.2} over {})",
            factor.median,
            counted(factor.count as u64, "rounds")
        )),
        None => Some(format!("at a price of a test that {} do not decide", counted(factor.count as u64, "rounds"))),
    }
}

/// Size of a node of the wide tree.
const fn node_bytes(kind: ContainerKind) -> usize {
    match kind {
        ContainerKind::Aabb => size_of::<WideNode<<Aabb as WideContainer>::Bounds>>(),
        ContainerKind::Sphere => size_of::<WideNode<<Sphere as WideContainer>::Bounds>>(),
        ContainerKind::Dop14 => size_of::<WideNode<<Dop14 as WideContainer>::Bounds>>(),
        ContainerKind::Oriented => size_of::<WideNode<<OrientedBox as WideContainer>::Bounds>>(),
    }
}

/// "41 % fewer", "3 % more" or, from threefold on, "3.5 times as many".
fn change(ratio: f64) -> Option<String> {
    if ratio.is_finite() && ratio >= 3.0 {
        return Some(format!("{ratio:.1} times as many"));
    }
    let percent = (ratio - 1.0) * 100.0;
    let word = if percent > 0.0 { "more" } else { "fewer" };
    ratio.is_finite().then(|| format!("{:.0} % {word}", percent.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::population::{MeasuredRays, Population};
    use crate::lab::sample::sample;

    #[test]
    fn a_sentence_has_the_tests_of_each_population_and_the_price_of_one() {
        let rays = |tests| MeasuredRays {
            population: Population::Bounce,
            tests_per_entering_ray: Some(tests),
            ..sample().populations.swap_remove(0)
        };
        let row = |container, trace_ms: f64, tests: f64, rays| {
            let traces = (0..9).map(|round| trace_ms * (1.0 + 0.01 * f64::from(round))).collect();
            let rounds = std::iter::once(("trace_ms".to_owned(), traces)).collect();
            Measurement { container, populations: vec![rays], rounds, ..sample() }
                .with(TRACE_MS, trace_ms)
                .with(TESTS_PER_RAY, tests)
                .with(TESTS_PER_ENTERING_RAY, tests)
        };
        let boxes = row(ContainerKind::Aabb, 50.0, 20.0, rays(50.5));
        let dops = row(ContainerKind::Dop14, 60.0, 15.0, rays(25.25));
        let expected = "thing.obj: 14-DOPs take 25 % fewer tests of the picture's rays, 50 % fewer of bounce rays, at 1.60 \
                        times the price of a test (1.60 to 1.60 over 9 rounds), and 480 bytes for a node of the wide tree instead of 224.";
        assert_eq!(findings(&[boxes.clone(), dops.clone()]), [expected]);
        let mut noisy = dops.clone();
        noisy.rounds.insert("trace_ms".to_owned(), vec![30.0, 60.0, 30.0, 60.0, 30.0, 60.0, 30.0, 60.0, 30.0]);
        let found = findings(&[boxes.clone(), noisy]);
        assert!(found[0].contains(", at a price of a test that 9 rounds do not decide, and 480"), "{found:?}");
        assert_eq!(change(3.54).as_deref(), Some("3.5 times as many"));
        let spheres = Measurement { container: ContainerKind::Sphere, ..dops.clone() };
        let of_spheres = findings(&[boxes, spheres.clone()]);
        assert!(
            of_spheres[0]
                .starts_with("thing.obj: spheres take 25 % fewer tests of the picture's rays, 50 % fewer of bounce")
        );
        assert_eq!(findings(&[dops, spheres]), Vec::<String>::new());
    }
}
