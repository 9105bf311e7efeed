//! How well SAH cost and end-point overlap predict what rays cost, over several trees of one scene.
//!
//! After Aila, Karras and Laine, *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013: they compare both, and the sum
//! (1 − α) · SAH + α · EPO, by their correlation with the measured speed of trees from many builders.

use serde::Serialize;

use super::measurement::{Measurement, ModelView, model_views};
use super::population::Population;
use crate::catalog::numbers::rows::{EPO, SAH_COST};
use bvhscope_engine::tree::ContainerKind;

/// Fewest trees for which a correlation means anything.
const FEWEST_TREES: usize = 3;
/// Steps in which the best α is looked for.
const ALPHA_STEPS: u32 = 100;

/// A tree with what is predicted of it and what was measured, all in the unit of the SAH cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedTree {
    /// SAH cost.
    pub sah_cost: f64,
    /// End-point overlap.
    pub epo: f64,
    /// Measured cost of a ray that enters the root.
    pub cost: f64,
}

/// How well the measured cost of some trees was predicted: correlation coefficients after Pearson, -1 to 1. `None` where fewer than
/// three trees, or trees that are all alike, tell nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// By the SAH cost.
    pub sah: Option<f64>,
    /// By the end-point overlap.
    pub epo: Option<f64>,
    /// By both together: the α from 0 to 1 that predicts best, in steps of 0.01, and the correlation of the sum.
    pub both: Option<(f64, f64)>,
}

impl Prediction {
    /// Of these trees.
    pub fn of(trees: &[PredictedTree]) -> Self {
        let measured: Vec<f64> = trees.iter().map(|tree| tree.cost).collect();
        let by = |predicted: &dyn Fn(&PredictedTree) -> f64| {
            correlation(&trees.iter().map(predicted).collect::<Vec<_>>(), &measured)
        };
        let both = (0..=ALPHA_STEPS).filter_map(|step| {
            let alpha = f64::from(step) / f64::from(ALPHA_STEPS);
            Some((alpha, by(&|tree| (1.0 - alpha) * tree.sah_cost + alpha * tree.epo)?))
        });
        Self {
            sah: by(&|tree| tree.sah_cost),
            epo: by(&|tree| tree.epo),
            // Of equal ones the first, which needs less of the overlap.
            both: both.reduce(|best, next| if next.1 > best.1 + 1e-9 { next } else { best }),
        }
    }
}

/// A prediction of the cost of rays over the trees of one model, with one kind of container. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correlation {
    /// Model name.
    pub model: String,
    /// Name of the place of the camera.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub camera: String,
    /// Kind of the containers of all trees.
    pub container: ContainerKind,
    /// The rays.
    pub population: Population,
    /// Number of trees.
    pub trees: usize,
    /// Correlation of cost and SAH cost.
    pub sah_cost_r: Option<f64>,
    /// Correlation of cost and end-point overlap.
    pub epo_r: Option<f64>,
    /// The α from 0 to 1 whose sum of both predicts best.
    pub alpha: f64,
    /// Correlation of cost and that sum.
    pub alpha_r: f64,
}

impl Correlation {
    /// Its model, and where its camera stands.
    pub fn view(&self) -> ModelView<'_> {
        ModelView { model: &self.model, camera: &self.camera }
    }

    /// Those of each model, kind of container and kind of rays that `rows` have enough trees of.
    pub fn all(rows: &[Measurement]) -> Vec<Self> {
        let mut all = Vec::new();
        for view in model_views(rows) {
            let of_model: Vec<Measurement> = rows.iter().filter(|row| row.view() == view).cloned().collect();
            for container in ContainerKind::WITH_ORIENTED {
                all.extend(Population::of_rows().filter_map(|rays| Self::of(&of_model, container, rays)));
            }
        }
        all
    }

    /// That of the rows of one model.
    fn of(rows: &[Measurement], container: ContainerKind, population: Population) -> Option<Self> {
        let trees: Vec<_> = predicted_trees(rows, container, population).into_iter().map(|(_, tree)| tree).collect();
        let Prediction { sah: sah_cost_r, epo: epo_r, both } = Prediction::of(&trees);
        let ((alpha, alpha_r), ModelView { model, camera }) = (both?, rows.first()?.view());
        let [model, camera] = [model, camera].map(str::to_owned);
        Some(Self { model, camera, container, population, trees: trees.len(), sah_cost_r, epo_r, alpha, alpha_r })
    }
}

/// Pearson's correlation coefficient; `None` for fewer than three pairs and where either is constant.
pub fn correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let count = x.len().min(y.len());
    if count < FEWEST_TREES {
        return None;
    }
    let mean = |values: &[f64]| values[..count].iter().sum::<f64>() / count as f64;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let [mut xx, mut yy, mut xy] = [0.0; 3];
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (x - mean_x, y - mean_y);
        (xx, yy, xy) = (xx + x * x, yy + y * y, xy + x * y);
    }
    // Rounding leaves some spread to numbers that are equal.
    let has_spread = |sum: f64, mean: f64| (sum / count as f64).sqrt() > 1e-9 * mean.abs();
    (has_spread(xx, mean_x) && has_spread(yy, mean_y)).then(|| (xy / (xx * yy).sqrt()).clamp(-1.0, 1.0))
}

/// The trees of `rows` whose containers are of one kind and in which rays of `population` were measured, each with its row. Costs of
/// boxes and of spheres do not compare, nor do those of a tree over copies and of one over triangles.
pub fn predicted_trees(
    rows: &[Measurement],
    container: ContainerKind,
    population: Population,
) -> Vec<(usize, PredictedTree)> {
    let form = |row: &Measurement| row.form.map(|form| form.open);
    let tree = |row: &Measurement| {
        let measured = row.populations.iter().find(|measured| measured.population == population)?;
        let is_one = row.container == container && row.builder != "none" && measured.root_hits > 0;
        let is_one = is_one && rows.first().map(form) == Some(form(row));
        is_one.then_some(PredictedTree { sah_cost: row.number(SAH_COST), epo: row.number(EPO), cost: measured.cost })
    };
    rows.iter().enumerate().filter_map(|(index, row)| Some((index, tree(row)?))).collect()
}

/// Indices of the points that no other point beats in both coordinates (the Pareto front), where less is better, by ascending x. Of equal
/// points the first.
pub fn pareto_front(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1])));
    let mut best = f64::INFINITY;
    order.retain(|&index| {
        let is_better = points[index][1] < best;
        best = best.min(points[index][1]);
        is_better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::population::MeasuredRays;
    use crate::lab::sample::sample;

    fn tree([sah_cost, epo, cost]: [f64; 3]) -> PredictedTree {
        PredictedTree { sah_cost, epo, cost }
    }

    #[test]
    fn correlations_are_those_of_known_pairs() {
        let x = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(correlation(&x, &[10.0, 20.0, 30.0, 40.0]), Some(1.0));
        assert_eq!(correlation(&x, &[8.0, 6.0, 4.0, 2.0]), Some(-1.0));
        // Means 2.5 and 2.5; sums of products 3, of squares 5 and 5.
        assert!(correlation(&x, &[1.0, 3.0, 2.0, 4.0]).is_some_and(|r| (r - 0.8).abs() < 1e-12));
        assert_eq!(correlation(&x, &[5.0; 4]), None, "all alike");
        assert_eq!(correlation(&x[..2], &[1.0, 2.0]), None, "two points are always on a line");
    }

    #[test]
    fn the_best_sum_is_found_where_the_cost_is_one() {
        let of = |sah: f64, epo: f64| tree([sah, epo, 2.0 * (0.75 * sah + 0.25 * epo) + 3.0]);
        let found = Prediction::of(&[of(1.0, 5.0), of(2.0, 1.0), of(3.0, 9.0), of(4.0, 2.0)]);
        let (alpha, r) = found.both.unwrap_or_default();
        assert!((alpha - 0.25).abs() < 1e-9 && r > 1.0 - 1e-9, "{found:?}");
        assert!(found.sah.is_some_and(|r| r < 0.99) && found.epo.is_some_and(|r| r < 0.99), "{found:?}");
        assert_eq!(Prediction::of(&[]), Prediction { sah: None, epo: None, both: None });
    }

    #[test]
    fn trees_are_those_of_one_kind_that_were_measured() {
        let measured = |population, cost| MeasuredRays {
            population,
            rays: 9,
            entering_rays: None,
            root_hits: 7,
            visits: 5,
            predicted_visits: 3.0,
            cost,
            tests_per_ray: None,
            tests_per_entering_ray: None,
        };
        let row = |container, builder: &str, population, cost| Measurement {
            container,
            builder: builder.to_owned(),
            populations: vec![measured(population, cost)],
            ..sample()
        };
        let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
        let rows = [
            row(boxes, "aac", Population::Primary, 11.0),
            row(spheres, "aac", Population::Primary, 13.0),
            row(boxes, "none", Population::Primary, 17.0),
            row(boxes, "lbvh", Population::Random, 19.0),
            row(boxes, "lbvh", Population::Primary, 23.0),
        ];
        let found = predicted_trees(&rows, boxes, Population::Primary);
        assert_eq!(found, [(0, tree([67.3, 0.875, 11.0])), (4, tree([67.3, 0.875, 23.0]))]);
    }

    #[test]
    fn the_front_has_what_nothing_beats() {
        let points = [[3.0, 1.0], [1.0, 5.0], [2.0, 5.0], [2.0, 3.0], [3.0, 1.0], [4.0, 2.0], [1.0, 6.0]];
        assert_eq!(pareto_front(&points), [1, 3, 0]);
        assert_eq!(pareto_front(&[]), Vec::<usize>::new());
    }
}
