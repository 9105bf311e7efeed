//! A sentence on what another container than the paper's saves of the box's tests, and at which price.

use super::format::{models, name_among};
use crate::catalog::numbers::rows::{TESTS_PER_RAY, TRACE_MS};
use crate::lab::measurement::Measurement;
use crate::lab::population::MeasuredRays;
use bvhscope_engine::tree::ContainerKind;

/// For each model and each container beside the paper's that was measured with the box: the tests of the picture's rays and of each
/// population, and the time of a test.
pub(super) fn findings(rows: &[Measurement]) -> Vec<String> {
    let all = models(rows);
    let sentence = |model: &str, kind: ContainerKind| {
        let built = |row: &&Measurement| row.model == model && row.builder != "none" && row.tree.is_none();
        let of = |kind| rows.iter().filter(built).find(|row| row.container == kind);
        finding(of(ContainerKind::Aabb)?, of(kind)?).map(|text| format!("{}: {text}.", name_among(model, &all)))
    };
    let others = ContainerKind::WITH_ORIENTED.into_iter().filter(|kind| !ContainerKind::OF_PAPER.contains(kind));
    let pairs = all.iter().flat_map(|model| others.clone().map(move |kind| (*model, kind)));
    pairs.filter_map(|(model, kind)| sentence(model, kind)).collect()
}

/// "polytopes take 41 % fewer tests of bounce rays, 3 % more of primary rays, at 1.9 times the price of a test".
fn finding(boxes: &Measurement, other: &Measurement) -> Option<String> {
    let of_picture = other.number(TESTS_PER_RAY) / boxes.number(TESTS_PER_RAY);
    let mut parts = vec![format!("{} tests of the picture's rays", change(of_picture)?)];
    for rays in &boxes.populations {
        let same = other.populations.iter().find(|others| others.population == rays.population);
        if let Some(ratio) = same.and_then(|others| Some(tests(others)? / tests(rays)?)) {
            parts.push(format!("{} of {} rays", change(ratio)?, rays.population.name()));
        }
    }
    let price = other.number(TRACE_MS) / boxes.number(TRACE_MS) / of_picture;
    let price = if price.is_finite() { format!(", at {price:.2} times the price of a test") } else { String::new() };
    Some(format!("{} take {}{price}", other.container.plural(), parts.join(", ")))
}

/// Tests of a ray on average, of those that miss the root too: which do depends on the root's container.
fn tests(rays: &MeasuredRays) -> Option<f64> {
    let (all, entering) = (f64::from(rays.rays), f64::from(rays.root_hits));
    let of_entering = if rays.root_hits == 0 { 0.0 } else { rays.tests_per_entering_ray? };
    (all > 0.0).then_some((of_entering * entering + all - entering) / all)
}

/// "41 % fewer" or "3 % more".
fn change(ratio: f64) -> Option<String> {
    let percent = (ratio - 1.0) * 100.0;
    let word = if percent > 0.0 { "more" } else { "fewer" };
    ratio.is_finite().then(|| format!("{:.0} % {word}", percent.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::population::Population;
    use crate::lab::sample::sample;

    #[test]
    fn a_sentence_has_the_tests_of_each_population_and_the_price_of_one() {
        let rays = |entering: u32, tests| MeasuredRays {
            population: Population::Bounce,
            rays: 200,
            root_hits: entering,
            tests_per_entering_ray: Some(tests),
            ..sample().populations.swap_remove(0)
        };
        let row = |container, trace_ms: f64, tests: f64, rays| {
            Measurement { container, populations: vec![rays], ..sample() }
                .with(TRACE_MS, trace_ms)
                .with(TESTS_PER_RAY, tests)
        };
        // 100 rays of 100 tests and 100 of one: 50.5 a ray; 50 of 98 and 150 of one: 25.25.
        let boxes = row(ContainerKind::Aabb, 50.0, 20.0, rays(100, 100.0));
        let dops = row(ContainerKind::Dop14, 60.0, 15.0, rays(50, 98.0));
        let expected = "thing.obj: polytopes take 25 % fewer tests of the picture's rays, 50 % fewer of bounce rays, at 1.60 \
                        times the price of a test.";
        assert_eq!(findings(&[boxes.clone(), dops.clone()]), [expected]);
        assert_eq!(findings(&[dops, Measurement { container: ContainerKind::Sphere, ..boxes }]), Vec::<String>::new());
    }
}
