//! The view "Plots": what is plotted, and the trees of this session.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use crate::accel::node_values::KnownVisits;
use crate::accel::{Accel, is_same};
use crate::app::state::paper::Experiment;
use crate::app::state::{Derived, Study, ViewState};
use crate::catalog::numbers::millions_per_second;
use crate::catalog::settings::short_name;
use crate::lab::file_and_builder;
use crate::lab::population::{MeasuredRays, ViewRays};
use crate::lab::visit_scatter::VisitScatter;
use crate::scene::{Scene, SceneSource};
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;

/// Most trees of a model that are kept: those that were built last.
const MOST_TREES: usize = 512;
/// Most other models whose trees are kept: those that were shown last.
const MOST_MODELS: usize = 16;

/// Kind of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum PlotKind {
    /// Predicted against measured visits; a dot is a node.
    #[default]
    Nodes,
    /// SAH cost and EPO against measured cost; a dot is a tree.
    Prediction,
    /// Build time against quality; a dot is a tree.
    Speed,
    /// The trees in a table.
    List,
}

impl PlotKind {
    /// All, in the order of their buttons.
    pub const ALL: [Self; 4] = [Self::Nodes, Self::Prediction, Self::Speed, Self::List];

    /// The name on its button.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Nodes => "Nodes: visits",
            Self::Prediction => "Trees: SAH and EPO",
            Self::Speed => "Trees: speed and quality",
            Self::List => "Trees: list",
        }
    }

    /// Its subject, in one sentence.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Nodes => "Measured against predicted visits of each node: above the line the SAH expects too few",
            Self::Prediction => {
                "How well SAH cost and end-point overlap predict what rays really cost, over several trees"
            }
            Self::Speed => "What a better tree takes to build: on the line lie those that no other beats in both",
            Self::List => {
                "The trees of this session with their readings, to measure them, go back to one, or compare two"
            }
        }
    }
}

/// Which trees are plotted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum TreeSet {
    /// Those that were shown in this session.
    #[default]
    Session,
    /// Those that an experiment of the view "Paper" has measured.
    Measured(Experiment),
}

impl TreeSet {
    /// All, in the order of menus.
    pub const ALL: [Self; 3] =
        [Self::Session, Self::Measured(Experiment::Builders), Self::Measured(Experiment::Thresholds)];

    /// The name in menus, and what it means.
    pub const fn texts(self) -> [&'static str; 2] {
        match self {
            Self::Session => {
                ["of this session", "Every tree of this model that was shown since the program was started"]
            }
            Self::Measured(Experiment::Thresholds) => {
                ["by threshold", "The thresholds that the view Paper has measured"]
            }
            Self::Measured(_) => ["by builder", "The builders, presets and passes that the view Paper has measured"],
        }
    }
}

/// The number by which trees are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum TreeQuality {
    /// Measured cost of the chosen rays.
    #[default]
    Cost,
    /// SAH cost.
    SahCost,
    /// End-point overlap.
    Epo,
}

impl TreeQuality {
    /// All, in the order of menus, with name and meaning.
    pub const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Cost,
            "measured cost",
            "What the tests of a chosen ray that enters the root cost, in the unit of the SAH cost",
        ),
        (Self::SahCost, "SAH cost", "What the surface area heuristic predicts"),
        (Self::Epo, "EPO", "End-point overlap: what nodes cost that enclose a ray's end but not the surface there"),
    ];

    /// Its name.
    pub fn label(self) -> &'static str {
        Self::ALL.into_iter().find(|(quality, ..)| *quality == self).map_or("", |(_, label, _)| label)
    }
}

/// A tree in a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct PlottedTree {
    /// Its settings; of a tree from a file only the pass that orients boxes counts.
    pub build: BuildSettings,
    /// Kind of its containers.
    pub container: ContainerKind,
    /// The file that holds it, with the name of its builder.
    pub file: Option<(PathBuf, String)>,
    /// Build time in milliseconds, where it is known.
    pub build_ms: Option<f64>,
    /// The build time is that of one build: neither repeated nor of a file.
    pub is_built_once: bool,
    /// Speed of the measuring view in Mray/s, once it is measured.
    pub speed: Option<f64>,
    /// Build times and times of the measuring view in each round at rest, in milliseconds.
    pub rounds: [Vec<f64>; 2],
    /// SAH cost.
    pub sah_cost: f64,
    /// Tests of a ray that enters the scene's box in the measuring view, once they are counted.
    pub tests: Option<f64>,
    /// End-point overlap, once it is known.
    pub epo: Option<f64>,
    /// Measured cost of the chosen rays, where it was measured.
    pub cost: Option<f64>,
}

impl PlottedTree {
    /// `accel` with what is known of it, without a cost.
    pub fn of(accel: &Accel) -> Self {
        let (reading, at_rest) = (accel.reading(), accel.at_rest());
        let builds = at_rest.as_ref().and_then(|readings| readings.builds.as_ref());
        Self {
            is_built_once: builds.is_none() && accel.file.is_none(),
            speed: at_rest.as_ref().map(|readings| millions_per_second(readings.rays, readings.traces.ms)),
            rounds: [
                builds.map_or_else(Vec::new, |builds| builds.rounds.clone()),
                at_rest.as_ref().map_or_else(Vec::new, |readings| readings.trace_rounds.clone()),
            ],
            build: accel.settings,
            container: accel.tree.container_kind(),
            file: accel.file.as_ref().map(|file| (file.path.clone(), accel.builder_name().into_owned())),
            build_ms: reading.build.map(|times| times.ms),
            sah_cost: f64::from(accel.report.stats.sah_cost),
            tests: accel.entering().map(|counts| f64::from(counts.tests)),
            epo: accel.known_epo().map(|epo| f64::from(epo.value)),
            cost: None,
        }
    }

    /// The number by which it is judged.
    pub const fn quality(&self, quality: TreeQuality) -> Option<f64> {
        match quality {
            TreeQuality::Cost => self.cost,
            TreeQuality::SahCost => Some(self.sah_cost),
            TreeQuality::Epo => self.epo,
        }
    }

    /// Whether it is `accel`.
    pub fn is(&self, accel: &Accel) -> bool {
        self.is_of(accel.file.as_ref().map(|file| file.path.as_path()), &accel.settings)
    }

    /// True if it was read from `file`, or without one built with `build`.
    fn is_of(&self, file: Option<&Path>, build: &BuildSettings) -> bool {
        match (&self.file, file) {
            (Some((path, _)), Some(file)) => path == file,
            (None, None) => self.build == *build,
            _ => false,
        }
    }

    /// Its settings in few words: "AAC δ 6 ε 0.2, boxes, collapse"; its file and builder where it was read: "mine.bvh (embree), boxes".
    pub fn name(&self) -> String {
        if let Some((path, builder)) = &self.file {
            return format!("{}, {}", file_and_builder(path, builder), self.container.plural());
        }
        short_name(&self.build)
    }
}

/// A tree that was shown.
#[derive(Debug, Clone)]
struct SessionTree {
    tree: PlottedTree,
    /// The measured costs, each with its rays.
    costs: Vec<(ViewRays, f64)>,
    /// Its build was repeated or its file read again, or that is known to be impossible.
    is_measured: bool,
}

impl SessionTree {
    /// The tree `tree`, which was not measured yet.
    const fn new(tree: PlottedTree) -> Self {
        Self { tree, costs: Vec::new(), is_measured: false }
    }

    fn note_cost(&mut self, rays: ViewRays, cost: f64) {
        self.costs.retain(|(of, _)| *of != rays);
        self.costs.push((rays, cost));
    }
}

/// A model as it was when it was loaded.
#[derive(Debug, Clone, PartialEq)]
struct KnownModel {
    /// With an absolute path, as a state that is shared has it.
    source: SceneSource,
    /// When its file was written.
    modified: Option<SystemTime>,
    triangle_count: u64,
    bounds: Aabb,
}

impl KnownModel {
    fn of(scene: &Scene) -> Self {
        let modified = scene.source.path().and_then(|path| path.metadata().ok()?.modified().ok());
        Self { source: scene.source.absolute(), modified, triangle_count: scene.triangle_count(), bounds: scene.bounds }
    }
}

/// The trees of the presented scene that were shown, each settings once.
#[derive(Debug, Default)]
pub struct SessionTrees {
    scene: Weak<Scene>,
    model: Option<KnownModel>,
    trees: Vec<SessionTree>,
    /// The trees of models that were shown before, which a lesson or another file gives back.
    others: Vec<(KnownModel, Vec<SessionTree>)>,
}

impl SessionTrees {
    /// Notes the numbers of a tree that is shown; called each UI frame. A model that was shown before has its trees again, any other
    /// scene begins again.
    pub fn note(&mut self, accel: &Accel) {
        if !is_same(&self.scene, &accel.scene) {
            self.begin(&accel.scene);
        }
        if accel.is_followed() || accel.file.is_none() && accel.settings.builder == BuilderKind::None {
            return;
        }
        let tree = PlottedTree::of(accel);
        // The build of a tree from a file is not repeated.
        let is_measured = tree.speed.is_some() && tree.tests.is_some();
        if let Some(known) = self.trees.iter_mut().find(|known| known.tree.is(accel)) {
            if accel.file.is_some() && known.tree.sah_cost != tree.sah_cost {
                // The file was written again.
                *known = SessionTree::new(tree);
            } else {
                let before = &known.tree;
                let (epo, tests) = (tree.epo.or(before.epo), tree.tests.or(before.tests));
                known.tree = if known.is_measured && !is_measured {
                    // A tree that is built again is not measured again.
                    PlottedTree { tests, epo, sah_cost: tree.sah_cost, ..before.clone() }
                } else {
                    PlottedTree { tests, epo, ..tree }
                };
                known.is_measured |= is_measured;
            }
            return;
        }
        if self.trees.len() == MOST_TREES {
            self.trees.remove(0);
        }
        self.trees.push(SessionTree { is_measured, ..SessionTree::new(tree) });
    }

    /// Begins the list of a scene, and keeps that of another model.
    fn begin(&mut self, scene: &Arc<Scene>) {
        let model = KnownModel::of(scene);
        let trees = std::mem::take(&mut self.trees);
        // The same file at another moment, or written again, has other trees.
        if let Some(before) = self.model.take().filter(|before| before.source != model.source) {
            self.others.retain(|(other, _)| other.source != before.source);
            self.others.push((before, trees));
            self.others.drain(..self.others.len().saturating_sub(MOST_MODELS));
        }
        if let Some(at) = self.others.iter().position(|(other, _)| *other == model) {
            self.trees = self.others.remove(at).1;
        }
        (self.scene, self.model) = (Arc::downgrade(scene), Some(model));
    }

    /// The trees that lack a reading or what `rays` cost in them.
    pub fn unmeasured(&self, rays: Option<ViewRays>) -> impl Iterator<Item = &PlottedTree> {
        let knows = |tree: &SessionTree, rays: &ViewRays| tree.costs.iter().any(|(of, _)| of == rays);
        let lacks =
            move |tree: &&SessionTree| !tree.is_measured || rays.as_ref().is_some_and(|rays| !knows(tree, rays));
        self.trees.iter().filter(lacks).map(|tree| &tree.tree)
    }

    /// Notes what was measured of a tree; of one that cannot be built or read nothing, and it is not tried again.
    fn note_measured(&mut self, wanted: &TreeToMeasure, measured: Option<&PlottedTree>) {
        let is_it = |known: &&mut SessionTree| known.tree.is_of(wanted.file.as_deref(), &wanted.build);
        let Some(known) = self.trees.iter_mut().find(is_it) else { return };
        known.is_measured = true;
        if let Some(measured) = measured {
            known.tree = PlottedTree { cost: None, ..measured.clone() };
        }
        known.note_cost(wanted.rays.clone(), measured.and_then(|measured| measured.cost).unwrap_or(f64::NAN));
    }

    /// Notes what `rays` cost in a tree that was noted.
    pub fn note_cost(&mut self, accel: &Accel, rays: ViewRays, cost: f64) {
        if let Some(known) = self.trees.iter_mut().find(|known| known.tree.is(accel)) {
            known.note_cost(rays, cost);
        }
    }

    /// The trees with what `rays` cost in them.
    pub fn plotted(&self, rays: Option<ViewRays>) -> Vec<PlottedTree> {
        let is_by = |of: &ViewRays| rays.as_ref() == Some(of);
        let cost = |tree: &SessionTree| tree.costs.iter().find(|(of, _)| is_by(of)).map(|(_, cost)| *cost);
        let cost = |tree: &SessionTree| cost(tree).filter(|cost| cost.is_finite());
        self.trees.iter().map(|tree| PlottedTree { cost: cost(tree), ..tree.tree.clone() }).collect()
    }
}

/// A tree of the session that is built or read again to be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeToMeasure {
    /// Its settings.
    pub build: BuildSettings,
    /// The file that holds it, in place of the build.
    pub file: Option<PathBuf>,
    /// The rays whose cost is measured.
    pub rays: ViewRays,
}

/// Inputs of the scatter of nodes.
#[derive(Debug, Clone)]
pub struct ScatterInputs {
    /// The rays.
    pub rays: ViewRays,
    /// Counts of them.
    pub sums: MeasuredRays,
    /// Their visits.
    pub visits: KnownVisits,
}

impl PartialEq for ScatterInputs {
    /// The counts follow from the visits.
    fn eq(&self, other: &Self) -> bool {
        self.rays == other.rays && self.visits == other.visits
    }
}

/// The view "Plots".
#[derive(Debug, Default)]
pub struct PlotsView {
    /// The kind of plot.
    pub kind: PlotKind,
    /// Which trees.
    pub set: TreeSet,
    /// By what they are judged.
    pub quality: TreeQuality,
    /// The scatter of the nodes of the presented tree.
    pub scatter: Study<ScatterInputs, VisitScatter>,
    /// The trees of this session.
    pub session: SessionTrees,
    /// All trees of the session are to be measured, one after the other.
    pub measures_all: bool,
    /// The last of their measurements.
    pub measured: Study<TreeToMeasure, Option<PlottedTree>>,
}

/// The plots' part of a shared state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedPlots {
    kind: PlotKind,
    set: TreeSet,
    quality: TreeQuality,
}

impl ViewState for PlotsView {
    const NAME: &'static str = "Plots";
    type Shared = SharedPlots;

    fn shared(&self, _: Option<&Arc<Accel>>) -> SharedPlots {
        let Self { kind, set, quality, scatter: _, session: _, measures_all: _, measured: _ } = self;
        SharedPlots { kind: *kind, set: *set, quality: *quality }
    }

    fn show_shared(&mut self, SharedPlots { kind, set, quality }: SharedPlots) {
        (self.kind, self.quality) = (kind, quality);
        self.set = if TreeSet::ALL.contains(&set) { set } else { TreeSet::Session };
    }

    #[cfg(test)]
    fn changed() -> Self {
        let set = TreeSet::Measured(Experiment::Builders);
        Self { kind: PlotKind::Speed, set, quality: TreeQuality::Epo, ..Self::default() }
    }
}

impl PlotsView {
    /// Inputs of the scatter of `accel`'s nodes; `None` while its visits are not known.
    pub(super) fn inputs(derived: &Derived, accel: &Arc<Accel>) -> Option<ScatterInputs> {
        let (rays, measured) = derived.measured(accel)?;
        let visits = KnownVisits(Arc::clone(&measured.visits));
        Some(ScatterInputs { rays, sums: measured.sums.clone(), visits })
    }

    /// Notes a tree that is shown, and what rays cost in it where that is known; called each UI frame.
    pub(super) fn note_tree(&mut self, derived: &Derived, accel: &Arc<Accel>) {
        self.session.note(accel);
        if let Some(inputs) = Self::inputs(derived, accel)
            && let Some(scatter) = self.scatter.get(accel, &inputs)
            && scatter.sums.root_hits > 0
        {
            let cost = scatter.sums.cost;
            self.session.note_cost(accel, inputs.rays, cost);
        }
    }

    /// The next tree of the session to be measured by `rays` while all are to be, beside the presented tree `accel`. Takes what was
    /// measured.
    pub fn next_to_measure(&mut self, accel: &Arc<Accel>, rays: ViewRays) -> Option<TreeToMeasure> {
        while self.measures_all {
            let wanted = self.session.unmeasured(Some(rays.clone())).next().map(|tree| TreeToMeasure {
                build: tree.build,
                file: tree.file.as_ref().map(|(path, _)| path.clone()),
                rays: rays.clone(),
            });
            match wanted {
                Some(wanted) if self.measured.is_cancelled(accel, &wanted) => self.measured.resume(),
                Some(wanted) => match self.measured.get(accel, &wanted) {
                    Some(measured) => {
                        self.session.note_measured(&wanted, (**measured).as_ref());
                        continue;
                    }
                    None => return Some(wanted),
                },
                None => {}
            }
            self.measures_all = false;
        }
        None
    }
}
