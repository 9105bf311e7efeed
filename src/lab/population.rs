//! Populations of rays by which trees are measured: those that a picture of a view traces, and random lines.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Ray};
use bvhscope_engine::tree::random_lines::RandomLines;
use bvhscope_engine::tree::traverse::Traversal;
use bvhscope_engine::tree::visits::{RayQuery, Visits};
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::accel::{Accel, WeightedRay};
use crate::camera::Camera;
use crate::ray_file::{FileRay, RaySet};
use crate::render::{Light, RayKind, RenderRequest, RenderSettings, rays_of_picture};
use crate::scene::Scene;
use crate::text::count;

/// Maximum rays per row and column of a view; more slow the measurement and hardly change it.
const MOST_RAYS: u32 = 256;
/// The seed of the random lines.
const SEED: u64 = 1;

/// A kind of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Population {
    /// Those of the camera.
    #[default]
    Primary,
    /// From the surfaces in view towards the sun.
    Shadow,
    /// From the surfaces in view into their surroundings, as ambient occlusion traces them.
    #[serde(rename = "ao")]
    AmbientOcclusion,
    /// From the surfaces in view to where their light comes from.
    Bounce,
    /// Random, unoccluded lines through the root: what the surface area heuristic assumes.
    Random,
    /// Those of a file.
    File,
}

impl Population {
    /// Those of a view or of a tree, in the order of menus.
    pub const ALL: [Self; 5] = [Self::Primary, Self::Shadow, Self::AmbientOcclusion, Self::Bounce, Self::Random];

    /// Those that rows may have, in the order of columns.
    pub fn of_rows() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().chain([Self::File])
    }

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self.kind() {
            Some(kind) => kind.name(),
            None if matches!(self, Self::File) => "file",
            None => "random",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self.kind() {
            Some(kind) => kind.label(),
            None if matches!(self, Self::File) => "Ray file",
            None => "Random lines",
        }
    }

    /// Definition, in one sentence.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Primary => "Rays from the eye through the picture, up to the first surface",
            Self::Shadow => "Rays from the surfaces in view to the sun, up to the first hit",
            Self::AmbientOcclusion => {
                "Rays from the surfaces in view into their surroundings, a quarter of the model far, up to the first hit"
            }
            Self::Bounce => "Rays from the surfaces in view in random directions, up to the next surface",
            Self::File => "Rays of a file",
            Self::Random => "Random, unoccluded lines through the root: what the SAH assumes of all rays",
        }
    }

    /// The rays of pictures that it consists of; `None` for random lines and files.
    pub const fn kind(self) -> Option<RayKind> {
        match self {
            Self::Primary => Some(RayKind::Primary),
            Self::Shadow => Some(RayKind::Shadow),
            Self::AmbientOcclusion => Some(RayKind::AmbientOcclusion),
            Self::Bounce => Some(RayKind::Bounce),
            Self::Random | Self::File => None,
        }
    }

    /// Whether the rays are the same in all trees of a scene: random lines go through the root of each.
    pub const fn is_same_in_all_trees(self) -> bool {
        !matches!(self, Self::Random)
    }

    /// True for rays that any hit ends.
    pub fn ends_at_any_hit(self) -> bool {
        self.kind().is_some_and(RayKind::ends_at_any_hit)
    }

    /// Why a view has no such rays.
    pub const fn absence(self, light: Light) -> &'static str {
        match (self, light) {
            (Self::Shadow, Light::Headlight) => {
                "The headlight is at the eye, so its shadows are never visible: with the sun there are shadow rays"
            }
            _ => "This view shows no surface that such rays leave",
        }
    }

    /// The visits that count: those until a surface stops the ray, in this order of visiting, or nothing.
    const fn query(self, traversal: Traversal) -> RayQuery {
        match (self, traversal) {
            // Nothing is culled in the paper's order, so that each line visits whatever it enters.
            (Self::Random, _) => RayQuery::ClosestHit(Traversal::Paper),
            // The paper's order does not end at any hit.
            (Self::Shadow | Self::AmbientOcclusion, Traversal::Ordered) => RayQuery::AnyHit,
            _ => RayQuery::ClosestHit(traversal),
        }
    }
}

/// A set of populations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Populations(u8);

impl Populations {
    /// None.
    pub const NONE: Self = Self(0);
    /// All but those of a file.
    pub const ALL: Self = Self((1 << Population::ALL.len()) - 1);

    /// This set with another population.
    #[must_use]
    pub const fn with(self, population: Population) -> Self {
        Self(self.0 | 1 << population as u8)
    }

    /// Whether `population` is among them.
    pub const fn has(self, population: Population) -> bool {
        self.0 >> population as u8 & 1 != 0
    }

    /// The populations, in the order of [`Population::of_rows`].
    pub fn iter(self) -> impl Iterator<Item = Population> {
        Population::of_rows().filter(move |&population| self.has(population))
    }
}

impl fmt::Display for Populations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.iter().map(Population::name).collect();
        f.write_str(if names.is_empty() { "none" } else { "" })?;
        f.write_str(&names.join(","))
    }
}

/// Rays of one population: at most one for each of 256 × 256 squares of a view, through or from the surface at its centre, as many random
/// lines, or those of a file. Equal ones are the same rays in every tree of a scene; random lines go through the root of each.
#[derive(Debug, Clone)]
pub struct ViewRays {
    population: Population,
    camera: Camera,
    columns: u32,
    rows: u32,
    /// The settings of the picture that decide its rays.
    settings: RenderSettings,
    traversal: Traversal,
    /// The rays of the population [`Population::File`].
    file: Option<Arc<RaySet>>,
}

impl PartialEq for ViewRays {
    fn eq(&self, other: &Self) -> bool {
        let parts =
            |rays: &Self| (rays.population, rays.camera, rays.columns, rays.rows, rays.settings, rays.traversal);
        parts(self) == parts(other) && self.file().map(Arc::as_ptr) == other.file().map(Arc::as_ptr)
    }
}

impl ViewRays {
    /// The rays of a view of `size_px` pixels with the light, normals, section plane and order of visiting of `settings`.
    pub fn new(population: Population, camera: Camera, size_px: [u32; 2], settings: &RenderSettings) -> Self {
        let [width, height] = size_px.map(|side| side.max(1));
        let scale = (f64::from(MOST_RAYS) / f64::from(width.max(height))).min(1.0);
        let [columns, rows] = [width, height].map(|side| ((f64::from(side) * scale) as u32).max(1));
        let (relevant, traversal) = (settings.of_rays(), settings.traversal);
        Self { population, camera, columns, rows, settings: relevant, traversal, file: None }.of(population)
    }

    /// With the rays of a file as the population [`Population::File`], which has none without.
    #[must_use]
    pub fn with_file(self, file: Option<Arc<RaySet>>) -> Self {
        Self { file, ..self }
    }

    /// The rays of another population of the same view. Of random lines and rays of a file there is no way back to a view.
    #[must_use]
    pub fn of(&self, population: Population) -> Self {
        let traversal = self.traversal;
        let rays = Self { population, ..self.clone() };
        match population {
            Population::Random => rays.without_view(Traversal::Paper),
            Population::File => rays.without_view(traversal),
            _ => rays,
        }
    }

    /// The same rays for every view.
    fn without_view(self, traversal: Traversal) -> Self {
        Self {
            camera: Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y),
            columns: MOST_RAYS,
            rows: MOST_RAYS,
            settings: RenderSettings { simd: self.settings.simd, ..RenderSettings::default() },
            traversal,
            ..self
        }
    }

    /// The file, where its rays are these.
    fn file(&self) -> Option<&Arc<RaySet>> {
        self.file.as_ref().filter(|_| self.population == Population::File)
    }

    /// Through at least `count` squares of the view, or so many random lines.
    #[must_use]
    pub fn with_squares(self, count: u32) -> Self {
        let (columns, rows) = if self.population == Population::Random {
            (count, 1)
        } else {
            let columns = (f64::from(count) * f64::from(self.columns) / f64::from(self.rows)).sqrt().ceil();
            let columns = (columns as u32).max(1);
            (columns, count.div_ceil(columns).max(1))
        };
        Self { columns, rows, ..self }
    }

    /// The column and row of the square that a primary ray goes through, by its place in [`ViewRays::list`].
    pub fn square_of(&self, index: usize) -> Option<[u32; 2]> {
        let index = (self.population == Population::Primary).then_some(index as u32)?;
        Some([index % self.columns, index / self.columns])
    }

    /// The population.
    pub const fn population(&self) -> Population {
        self.population
    }

    /// The light that shadow rays go to.
    pub const fn light(&self) -> Light {
        self.settings.light
    }

    /// The rays through `accel`, in a fixed order.
    pub fn list(&self, accel: &Arc<Accel>, token: &CancelToken) -> Result<Vec<Ray>, Cancelled> {
        if self.population == Population::File {
            return Ok(self.file().map_or_else(Vec::new, |file| file.rays.iter().map(|ray| ray.ray).collect()));
        }
        let Some(kind) = self.population.kind() else { return Ok(self.random_lines(&accel.tree)) };
        let picture = RenderRequest::new(accel, self.camera, self.settings, [self.columns, self.rows]);
        rays_of_picture(&picture, kind, token)
    }

    /// [`ViewRays::list`] with the rays that these are.
    pub fn listed(&self, accel: &Arc<Accel>, token: &CancelToken) -> Result<ListedRays, Cancelled> {
        Ok(ListedRays { population: self.population, list: self.list(accel, token)?, view: self.clone() })
    }

    /// As many random lines through the root of `tree`.
    pub fn random_lines(&self, tree: &AnyTree) -> Vec<Ray> {
        with_tree!(tree, tree => tree.nodes.first().map_or_else(Vec::new, |root| {
            let lines = RandomLines::new(root.container, SEED);
            (0..self.columns * self.rows).map(|index| lines.ray(index)).collect()
        }))
    }

    /// Traces them through the binary tree of `accel` and counts the visits of each node, in the calling thread's rayon pool. Hidden
    /// triangles stop rays as all others do.
    pub fn measure(&self, accel: &Arc<Accel>, token: &CancelToken) -> Result<MeasuredVisits, Cancelled> {
        let rays = self.list(accel, &token.part(0, 2))?;
        accel.compute_leaf_triangles(token)?;
        self.visits(
            &accel.scene,
            &accel.tree,
            &|count, ray, token: &CancelToken| accel.visits(count, ray, token),
            &rays,
            &token.part(1, 2),
        )
    }

    /// The visits of the nodes of `tree`, one of `scene`, by `rays`, which are those of [`ViewRays::list`] and which `trace` takes through
    /// it. A ray of a file counts as many times as rays it stands for, and as a shadow ray where it is one.
    pub fn visits(
        &self,
        scene: &Scene,
        tree: &AnyTree,
        trace: CountVisits<'_>,
        rays: &[Ray],
        token: &CancelToken,
    ) -> Result<MeasuredVisits, Cancelled> {
        measured(self.population, (scene, tree, trace), (rays.len() as u32, &self.weighted(rays)), token)
    }

    /// Each of `rays`, which are those of [`ViewRays::list`], by its index, with its purpose and the number of rays that it stands for.
    pub fn weighted<'a>(&'a self, rays: &'a [Ray]) -> impl Fn(u32) -> (Ray, RayQuery, u32) + Sync + 'a {
        let query = self.population.query(self.traversal);
        let weighted = self.file().map(|file| (file, weight_scale(&file.rays)));
        move |index: u32| {
            let ray = rays[index as usize];
            let Some((file, scale)) = weighted else { return (ray, query, 1) };
            let FileRay { any, weight, .. } = file.rays[index as usize];
            // Paper order does not end at any hit.
            let ends = any && self.traversal == Traversal::Ordered;
            let query = if ends { RayQuery::AnyHit } else { RayQuery::ClosestHit(self.traversal) };
            (ray, query, (f64::from(weight) * scale).round() as u32)
        }
    }
}

/// Which rays of a view, of a tree or of a file measure trees.
#[derive(Debug, Clone)]
pub struct RayPlan {
    /// Their populations.
    pub populations: Populations,
    /// The camera of those of a view.
    pub camera: Camera,
    /// Width and height of the view in pixels.
    pub size: [u32; 2],
    /// Light and SIMD level.
    pub settings: RenderSettings,
    /// Those of a file.
    pub file: Option<Arc<RaySet>>,
}

impl RayPlan {
    /// Which rays those of each population are.
    pub fn views(&self) -> Vec<ViewRays> {
        let settings = RenderSettings { traversal: Traversal::Ordered, ..self.settings };
        let of_population =
            |population| ViewRays::new(population, self.camera, self.size, &settings).with_file(self.file.clone());
        self.populations.iter().map(of_population).collect()
    }
}

/// The rays of each of `views`.
pub fn listed(views: &[ViewRays], accel: &Arc<Accel>, token: &CancelToken) -> Result<Vec<ListedRays>, Cancelled> {
    views.iter().map(|view| view.listed(accel, token)).collect()
}

/// The rays of one population.
#[derive(Debug)]
pub struct ListedRays {
    /// The population.
    pub population: Population,
    /// The rays.
    pub list: Vec<Ray>,
    view: ViewRays,
}

impl ListedRays {
    /// Each ray with what is asked of it and the number of rays that it stands for.
    pub fn ray(&self) -> impl Fn(u32) -> (Ray, RayQuery, u32) + Sync + '_ {
        self.view.weighted(&self.list)
    }
}

/// Sum that weights with fractions are scaled to, so that visits are whole numbers.
const SCALED_SUM: f64 = (1_u32 << 30) as f64;

/// The factor that makes weights of rays whole numbers, whose sum a count of visits holds.
fn weight_scale(rays: &[FileRay]) -> f64 {
    let sum: f64 = rays.iter().map(|ray| f64::from(ray.weight)).sum();
    let is_whole = sum <= f64::from(u32::MAX) && rays.iter().all(|ray| ray.weight.fract() == 0.0);
    if is_whole { 1.0 } else { SCALED_SUM / sum }
}

/// Counts the visits of nodes by a number of rays.
pub type CountVisits<'a> = &'a dyn Fn(u32, WeightedRay<'_>, &CancelToken) -> Result<Visits, Cancelled>;

/// The visits of the nodes of a tree of a scene by a number of rays.
fn measured(
    population: Population,
    (scene, tree, trace): (&Scene, &AnyTree, CountVisits<'_>),
    (count, ray): (u32, WeightedRay<'_>),
    token: &CancelToken,
) -> Result<MeasuredVisits, Cancelled> {
    let beside = |index: u32| {
        let (ray, query, weight) = ray(index);
        (ray, query, if scene.is_entered_by(&ray) { 0 } else { weight })
    };
    let [of_all, of_beside] = [token.part(0, 2), token.part(1, 2)];
    with_tree!(tree, tree => {
        let visits = trace(count, ray, &of_all)?;
        // Spheres and trees from files have roots that such rays enter, too.
        let beside = trace(count, &beside, &of_beside)?;
        let (all_tests, tests_beside) = (tests(tree, &visits), tests(tree, &beside));
        let entering = visits.rays - beside.rays;
        // Of a scene of copies the tree above alone has visits, and tests below it are others.
        let is_whole = scene.copies.is_none();
        let mean = |tests: u64, rays: u32| (is_whole && rays > 0).then(|| tests as f64 / f64::from(rays));
        let (sum, predicted_visits) = visits.sums(tree, token)?;
        let sums = MeasuredRays {
            population,
            rays: visits.rays,
            entering_rays: Some(entering),
            root_hits: visits.root_hits(),
            visits: sum,
            predicted_visits,
            cost: visits.cost(tree, token)?,
            tests_per_ray: mean(all_tests, visits.rays),
            tests_per_entering_ray: mean(all_tests - tests_beside, entering),
        };
        Ok(MeasuredVisits { visits: Arc::new(visits), sums })
    })
}

/// Visits of the nodes of a tree by the rays of a population, with their sums.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredVisits {
    /// The visits of each node.
    pub visits: Arc<Visits>,
    /// Counts of the rays.
    pub sums: MeasuredRays,
}

/// Counts of the rays of a population in a tree. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasuredRays {
    /// The population.
    pub population: Population,
    /// Number of rays.
    pub rays: u32,
    /// Number of rays that enter the scene's box, see [`Scene::is_entered_by`]. Earlier versions did not state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entering_rays: Option<u32>,
    /// Number of rays that enter the root.
    pub root_hits: u32,
    /// Visits of all nodes.
    pub visits: u64,
    /// Visits of all nodes that their areas predict; see [`Visits::predicted`].
    pub predicted_visits: f64,
    /// Cost of a ray that enters the root, in the unit of the SAH cost, which predicts it; see [`Visits::cost`].
    pub cost: f64,
    /// Containers and triangles tested by a ray, on average over all. Earlier versions did not state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tests_per_ray: Option<f64>,
    /// Containers and triangles tested by a ray that enters the scene's box, on average. Earlier versions did not
    /// state it, or averaged over the rays that enter the root.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tests_per_entering_ray: Option<f64>,
}

/// Share of rays that enter the scene's box below which they say little about its trees.
const FEW: f64 = 0.1;

/// "618 of 25,315 ao rays (2.4 %) enter the model's box: …" where that are few; `None` where enough do.
pub fn few_entering(population: Population, entering: u64, rays: u64) -> Option<String> {
    let share = entering as f64 / rays as f64;
    let remedy = if population.kind().is_some() { ": choose another camera" } else { "" };
    (share < FEW).then(|| {
        format!(
            "{} of {} {} rays ({:.1} %) enter the model's box, too few to judge trees by{remedy}",
            count(entering),
            count(rays),
            population.name(),
            share * 100.0
        )
    })
}

/// Number of tests: of the root by each ray, unless it is a leaf, of all children of each interior node that is visited, and of all
/// triangles of each leaf that is visited, though an any-hit ray ends at the first that it hits.
fn tests<C: Container>(tree: &Tree<C>, visits: &Visits) -> u64 {
    let tests_root = tree.nodes.first().is_some_and(|root| !root.is_leaf());
    let of_node = |node: &Node<C>| u64::from(if node.is_leaf() { node.count } else { node.arity() });
    let below: u64 = tree.nodes.iter().zip(&visits.counts).map(|(node, &count)| u64::from(count) * of_node(node)).sum();
    below + if tests_root { u64::from(visits.rays) } else { 0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::lab::sample::teapot;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};
    use bvhscope_engine::tree::ContainerKind;
    use bvhscope_engine::tree::traverse::TestCounts;

    fn accel(build: BuildSettings) -> Arc<Accel> {
        Arc::new(Accel::build(&teapot(), &build, &CancelToken::new()).unwrap())
    }

    fn rays(population: Population, accel: &Accel, light: Light) -> ViewRays {
        let scene = &accel.scene;
        let settings = RenderSettings { light, ..RenderSettings::default() };
        ViewRays::new(population, Camera::framing(&scene.bounds, scene.up), [300, 200], &settings)
    }

    #[test]
    fn every_tree_of_a_scene_meets_the_same_rays_whatever_the_threads() {
        let [aac, lbvh] = [BuilderKind::Aac, BuilderKind::Lbvh]
            .map(|builder| accel(BuildSettings { builder, ..BuildSettings::default() }));
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        for population in Population::ALL {
            let rays = rays(population, &aac, Light::Sun);
            let list = rays.list(&aac, &CancelToken::new()).unwrap();
            assert!(!list.is_empty() && list.len() <= 256 * 256, "{population:?}: {}", list.len());
            assert_eq!(rays.list(&lbvh, &CancelToken::new()).unwrap(), list, "{population:?}");
            let visits = rays.measure(&aac, &CancelToken::new()).unwrap();
            assert_eq!(visits.sums.rays as usize, list.len());
            assert_eq!(one.install(|| rays.measure(&aac, &CancelToken::new())).unwrap(), visits, "{population:?}");
        }
    }

    /// The heuristic's assumption holds for random lines, and for no others.
    #[test]
    fn random_lines_cost_what_the_sah_predicts() {
        for container in ContainerKind::ALL {
            let accel = accel(BuildSettings { container, ..BuildSettings::default() });
            let measured =
                |population| rays(population, &accel, Light::Sun).measure(&accel, &CancelToken::new()).unwrap().sums;
            let sah_cost = f64::from(accel.report.stats.sah_cost);
            let random = measured(Population::Random);
            assert_eq!(random.root_hits, random.rays, "each line goes through the root");
            let [of_cost, of_visits] = [random.cost / sah_cost, random.visits as f64 / random.predicted_visits];
            assert!((of_cost - 1.0).abs() < 0.03 && (of_visits - 1.0).abs() < 0.03, "{of_cost} {of_visits}");
            let primary = measured(Population::Primary);
            assert!(primary.root_hits < primary.rays, "some rays pass the model");
            assert!((primary.cost / sah_cost - 1.0).abs() > 0.05, "surfaces stop these: {}", primary.cost / sah_cost);
        }
    }

    /// Rays in the corners of the scene's box enter it and miss the polytope; others miss it and enter the sphere. Both are counted one by
    /// one here.
    #[test]
    fn every_container_is_judged_by_the_rays_that_enter_the_scenes_box() {
        let token = CancelToken::new();
        let mut entering = Vec::new();
        for container in ContainerKind::ALL {
            let accel = accel(BuildSettings { container, ..BuildSettings::default() });
            let rays = rays(Population::Primary, &accel, Light::Sun);
            let list = rays.list(&accel, &token).unwrap();
            let sums = rays.measure(&accel, &token).unwrap().sums;
            let tests_of = |ray: &Ray| {
                let mut counts = TestCounts::default();
                accel.closest_hit_with(ray, rays.traversal, &mut counts);
                counts.total()
            };
            let inside: Vec<&Ray> = list.iter().filter(|ray| accel.scene.is_entered_by(ray)).collect();
            let mean = |rays: &[&Ray]| rays.iter().map(|ray| tests_of(ray)).sum::<u64>() as f64 / rays.len() as f64;
            assert_eq!(sums.tests_per_entering_ray, Some(mean(&inside)), "{container:?}");
            assert_eq!(sums.tests_per_ray, Some(mean(&list.iter().collect::<Vec<_>>())), "{container:?}");
            let entered = inside.len() as u32;
            match container {
                ContainerKind::Aabb => assert_eq!(sums.root_hits, entered),
                _ => assert_ne!(sums.root_hits, entered, "{container:?}"),
            }
            entering.push(sums.entering_rays);
        }
        assert!(entering.iter().all(|rays| rays.is_some() && *rays == entering[0]), "{entering:?}");
    }

    #[test]
    fn a_view_without_such_rays_has_none_and_a_reason() {
        let accel = accel(BuildSettings::default());
        let shadow = rays(Population::Shadow, &accel, Light::Headlight);
        let summary = shadow.measure(&accel, &CancelToken::new()).unwrap().sums;
        assert_eq!((summary.rays, summary.root_hits, summary.visits, summary.cost), (0, 0, 0, 0.0));
        assert_eq!(
            (summary.entering_rays, summary.tests_per_ray, summary.tests_per_entering_ray),
            (Some(0), None, None)
        );
        assert!(Population::Shadow.absence(shadow.light()).contains("headlight"));
        assert!(!Population::Shadow.absence(Light::Sun).contains("headlight"));
    }

    #[test]
    fn random_lines_are_the_same_from_everywhere() {
        let accel = accel(BuildSettings::default());
        let away = Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::splat(9.0) }, Vec3::Z);
        let other = |population| ViewRays::new(population, away, [40, 30], &RenderSettings::default());
        assert_eq!(other(Population::Random), rays(Population::Random, &accel, Light::Headlight));
        assert_ne!(other(Population::Primary), rays(Population::Primary, &accel, Light::Sun));
    }

    #[test]
    fn sets_have_the_names_of_their_members() {
        let set = Populations::NONE.with(Population::Random).with(Population::Shadow);
        assert_eq!((set.to_string().as_str(), Populations::NONE.to_string().as_str()), ("shadow,random", "none"));
        assert!(Populations::ALL.iter().eq(Population::ALL));
        for population in Population::ALL {
            assert_eq!(serde_json::to_value(population).unwrap(), population.name());
        }
    }
}
