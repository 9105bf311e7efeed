//! The loaded model and what the screen shows of it.

use std::sync::Arc;

use glam::Vec3;

use crate::accel::Accel;
use crate::accel::laid::CountedLayout;
use crate::app::format;
use crate::app::state::comparison::{Comparison, Counted, TreeNumbers};
use crate::app::state::curve::CurveState;
use crate::app::state::derived::Derived;
use crate::app::state::picture_cut::PictureCut;
use crate::app::state::picture_layout::PictureLayout;
use crate::app::state::picture_ray::PictureRay;
use crate::app::state::playback::Playback;
use crate::app::state::wanted::HeatBasis;
use crate::catalog::layouts::NamedLayout;
use crate::catalog::numbers::Number;
use crate::catalog::reading::{TraceReading, TreeReading};
use crate::catalog::settings::{preset_name, short_name};
use crate::lab::diff::DifferenceMap;
use crate::lab::file_and_builder;
use crate::overlay::NodeTable;
use crate::render::Frame;
use crate::scene::{LoadOptions, Scene, SceneSource};
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::layouts::KeptNodes;
use bvhscope_engine::query::closed::Edges;
use bvhscope_engine::tree::ContainerKind;

/// Tree and picture on the screen. They are swapped as a unit, so that picture, overlay and numbers always agree.
#[derive(Clone)]
pub struct Presented {
    /// The tree, with its scene and build report.
    pub accel: Arc<Accel>,
    /// The tree's nodes by depth, for the overlay.
    pub table: Arc<NodeTable>,
    /// A picture traced through exactly this tree.
    pub frame: Arc<Frame>,
    /// Identifies the picture; unique within the process.
    pub frame_id: u64,
    /// Container and primitive tests per primary ray, from the newest picture of this tree that counted them.
    pub tests_per_ray: Option<[f32; 2]>,
    /// The requested number of threads the tree was built with; 0 for all.
    pub threads: usize,
    /// Counts and speed of this tree in its newest view at rest.
    pub counted: Option<Counted>,
    /// The tree of the same scene that was shown at rest before this one.
    pub before: Option<Arc<TreeNumbers>>,
}

impl Presented {
    /// A tree with its first picture, which follows nothing. `hides` states whether triangles of the picture are hidden.
    pub fn new(
        accel: Arc<Accel>,
        table: Arc<NodeTable>,
        frame: Arc<Frame>,
        hides: bool,
        frame_id: u64,
        threads: usize,
    ) -> Self {
        let tests_per_ray = frame.stats.tests_per_ray();
        let mut counted = None;
        Counted::observe(&mut counted, &frame, hides);
        Self { accel, table, frame, frame_id, tests_per_ray, threads, counted, before: None }
    }

    /// A copy by its index, and by the number that the file of the tree gives to it, if any: "copy 12", "copy 12 (id 700)".
    pub fn copy_name(&self, copy: u32) -> String {
        let id = self.accel.copy_id(copy).map_or_else(String::new, |id| format!(" (id {id})"));
        format!("copy {}{id}", format::count(u64::from(copy)))
    }

    /// A node below an unfolded copy by its place in the mesh: "copy 12 / node 71"; `None` for all others.
    pub fn place_in_mesh(&self, node: u32) -> Option<String> {
        let (copy, node) = self.accel.node_of_mesh(node)?;
        let [copy, node] = [copy, node].map(|number| format::count(u64::from(number)));
        Some(format!("copy {copy} / node {node}"))
    }

    /// The name of what is in the leaves below `node`, of one and of several.
    pub fn primitive_names(&self, node: u32) -> [&'static str; 2] {
        let scene = &self.accel.scene;
        match self.accel.node_of_mesh(node) {
            Some(_) => ["triangle", "triangles"],
            None if scene.unfolded.ranges.is_empty() => scene.primitive_names(),
            None => ["copy or triangle", "copies and triangles"],
        }
    }

    /// The tree in words: its settings or its file and builder, and the policy by which it follows a model that moves: "AAC δ 6 ε 0.2,
    /// boxes, refit".
    pub fn name(&self) -> String {
        let accel = &self.accel;
        let tree = match &accel.file {
            None => short_name(&accel.settings),
            Some(file) => {
                let containers = accel.tree.container_kind().plural();
                format!("{}, {containers}", file_and_builder(&file.path, &file.builder()))
            }
        };
        if accel.is_followed() { format!("{tree}, {}", accel.follow.policy.label().to_lowercase()) } else { tree }
    }

    /// The tree in the name of a file: its preset, else its builder, with containers other than boxes and the policy that it follows by.
    pub fn file_name(&self) -> String {
        let accel = &self.accel;
        let preset = preset_name(&accel.settings).filter(|_| accel.file.is_none());
        let container = Some(accel.tree.container_kind()).filter(|kind| *kind != ContainerKind::Aabb);
        let policy = accel.is_followed().then(|| accel.follow.policy.name().to_owned());
        let parts = [
            Some(preset.unwrap_or_else(|| accel.builder_name().into_owned())),
            container.map(|kind| kind.name().to_owned()),
            policy,
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join("-")
    }

    /// The tree to compare its successor with: this one where it came to rest, else the one before it.
    pub fn reference(&self) -> Option<Arc<TreeNumbers>> {
        match &self.counted {
            Some(counted) => Some(Arc::new(TreeNumbers::new(&self.accel, Some(counted)))),
            None => self.before.clone(),
        }
    }

    /// How a number differs from that of the tree before.
    pub fn compare(&self, number: &Number) -> Comparison {
        self.numbers().compare(self.before.as_deref(), number)
    }

    /// The numbers of this tree in its newest view at rest.
    pub fn numbers(&self) -> TreeNumbers {
        TreeNumbers::new(&self.accel, self.counted.as_ref())
    }

    /// The source of the numbers of this tree, with the counts of its newest picture that has any.
    pub fn reading(&self) -> TreeReading<'_> {
        let trace = TraceReading { tests: self.tests_per_ray, ..self.frame.reading() };
        TreeReading { trace: Some(trace), ..self.accel.reading() }
    }
}

/// How the second tree differs from the first in the picture.
#[derive(Clone)]
pub struct Difference {
    /// The map.
    pub map: Arc<DifferenceMap>,
    /// Identifies its picture among all others.
    pub picture_id: u64,
}

/// The loaded scene, the one on the screen with what is drawn over its picture, and what is known about its file.
#[derive(Default)]
pub struct Model {
    /// The newest loaded scene, which may not be presented yet.
    pub loaded: Option<Arc<Scene>>,
    /// The tree and picture on the screen; `None` until the first picture.
    pub presented: Option<Presented>,
    /// The second tree of the presented scene; `None` while there is none, and until its first picture.
    pub second: Option<Presented>,
    /// Where the second tree tests more than the first. Made of one pair of pictures, and kept until the next pair.
    pub difference: Option<Difference>,
    /// The ray over the picture.
    pub ray: PictureRay,
    /// The clusters over the picture in place of depths.
    pub cut: PictureCut,
    /// The layout that containers, depths and icicle are of.
    pub layout: PictureLayout,
    /// The curve over the picture.
    pub curve: CurveState,
    /// Data derived from the trees.
    pub derived: Derived,
    /// The up axis chosen by the user, and the model it was chosen for.
    pub up_override: Option<(SceneSource, Vec3)>,
    /// The file of the scene no longer exists.
    pub file_missing: bool,
    /// How the time of a model that moves goes on.
    pub playback: Playback,
    /// The trees that views are of while it goes on.
    pub followed: FollowedTrees,
    /// The options that models are loaded with.
    pub load_options: LoadOptions,
    /// Model and counts that the fixed range of the heat map was fitted to.
    pub heat_basis: Option<HeatBasis>,
}

/// The trees that the open view is of while a model plays: it shows one until all that it derives is known of another, since there is a
/// new tree in each frame.
#[derive(Default)]
pub struct FollowedTrees {
    /// The tree that values are derived from.
    studied: Option<Presented>,
    /// The last one of which they are known.
    shown: Option<Presented>,
}

impl Model {
    /// The tree that views derive values from: while the model plays one after another to its end, else that on the screen.
    pub fn studied(&self) -> Option<&Presented> {
        self.followed.studied.as_ref().or(self.presented.as_ref())
    }

    /// The tree that views show; while the model plays one of which all values are known.
    pub fn in_views(&self) -> Option<&Presented> {
        self.followed.shown.as_ref().or(self.presented.as_ref())
    }

    /// True if views show another tree than the screen, so that nodes of theirs cannot be selected.
    pub fn is_view_behind(&self) -> bool {
        let shown = self.followed.shown.as_ref().zip(self.presented.as_ref());
        shown.is_some_and(|(shown, presented)| !Arc::ptr_eq(&shown.accel, &presented.accel))
    }

    /// Goes on to the newest tree once values of the last one are `known`, all that the open view needs; called each UI frame.
    pub fn follow_playing(&mut self, known: bool) {
        let Some(presented) = self.presented.as_ref().filter(|_| self.playback.playing) else {
            self.followed = FollowedTrees::default();
            return;
        };
        let is_same_model =
            |of: &Option<Presented>| of.as_ref().is_some_and(|of| of.accel.scene.is_same_model(&presented.accel.scene));
        let FollowedTrees { studied, shown } = &mut self.followed;
        if !is_same_model(studied) {
            (*studied, *shown) = (Some(presented.clone()), None);
        } else if known {
            *shown = studied.replace(presented.clone());
        }
    }

    /// How a number of the presented tree differs from that of the tree before, or while there is a second tree, how that one's
    /// differs from it.
    pub fn compare(&self, number: &Number) -> Comparison {
        match (&self.presented, &self.second) {
            (Some(first), Some(second)) => second.numbers().compare(Some(&first.numbers()), number),
            (Some(first), None) => first.compare(number),
            (None, _) => Comparison::Unknown,
        }
    }

    /// The up axis chosen by the user, otherwise the presented scene's; y where nothing is presented.
    pub fn up(&self) -> Vec3 {
        let Some(presented) = &self.presented else { return Vec3::Y };
        match &self.up_override {
            Some((source, up)) if *source == presented.accel.scene.source => *up,
            _ => presented.accel.scene.up,
        }
    }

    /// How the triangles of the presented scene meet in their edges, once that is known.
    pub fn edges(&self) -> Option<&Edges> {
        self.presented.as_ref()?.accel.scene.known_edges()
    }

    /// The bounding box of the presented scene.
    pub fn bounds(&self) -> Option<Aabb> {
        self.presented.as_ref().map(|presented| presented.accel.scene.bounds)
    }

    /// Makes the table of the layout on show, once its nodes are known of the presented tree; called once a UI frame.
    pub fn follow_layout(&mut self) {
        let kept = self.presented.as_ref().and_then(|shown| {
            let kept = self.kept_nodes(&shown.accel)?;
            Some((&shown.accel, kept.as_ref().ok()?))
        });
        let table = kept.map(|(accel, kept)| {
            let is_same = |table: &&Arc<NodeTable>| {
                Arc::ptr_eq(table.accel(), accel) && table.kept().is_some_and(|own| Arc::ptr_eq(own, kept))
            };
            let known = self.layout.table.as_ref().filter(is_same).cloned();
            known.unwrap_or_else(|| Arc::new(NodeTable::of_layout(accel, kept)))
        });
        self.layout.table = table;
    }

    /// The nodes that the chosen layout keeps of this tree, or why there are none, once that is known.
    fn kept_nodes(&self, accel: &Arc<Accel>) -> Option<&Result<Arc<KeptNodes>, String>> {
        let inputs = self.layout.inputs(&self.derived, accel)?;
        Some(self.layout.kept.get(accel, &inputs)?.as_ref())
    }

    /// The layout on show, laid out from this tree.
    pub(super) fn laid_out(&self, accel: &Arc<Accel>) -> Option<CountedLayout> {
        let kept = self.kept_nodes(accel)?.as_ref().ok()?;
        Some(CountedLayout { choice: self.layout.chosen?, kept: Arc::clone(kept) })
    }

    /// The table of the layout on show, of this tree; `None` where the binary tree is shown.
    pub fn layout_of(&self, accel: &Arc<Accel>) -> Option<&Arc<NodeTable>> {
        self.layout.table.as_ref().filter(|table| Arc::ptr_eq(table.accel(), accel))
    }

    /// The table of the presented tree, or of the layout of it that is on show.
    pub fn table(&self) -> Option<&Arc<NodeTable>> {
        let shown = self.presented.as_ref()?;
        Some(self.layout_of(&shown.accel).unwrap_or(&shown.table))
    }

    /// Name of the layout on show.
    pub fn layout_name(&self) -> Option<String> {
        self.table()?.kept()?;
        self.layout.chosen.map(|layout| NamedLayout::from(layout).name())
    }

    /// Why the chosen layout is not shown.
    pub fn layout_fault(&self) -> Option<&str> {
        let shown = self.presented.as_ref()?;
        self.kept_nodes(&shown.accel)?.as_ref().err().map(String::as_str)
    }
}
