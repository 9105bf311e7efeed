//! The settings that decide what is shown, and what a fixed range of the heat map was fitted to.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::accel::Follow;
use crate::app::state::second_tree::{CompareView, SecondTree, TreeSide};
use crate::camera::Camera;
use crate::catalog::settings;
use crate::overlay::OverlaySettings;
use crate::render::{HeatKind, RenderSettings, Shading};
use crate::scene::{CopyRanges, Moment, Scene, SceneSource};
use crate::section::SectionPlane;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::settings::{BuildSettings, Pass};
use bvhscope_engine::tree::traverse::Traversal;

/// The user's settings of model, tree and picture. Panels edit it; the workers follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// The model.
    pub source: SceneSource,
    /// The moment of a model that moves; `None` for the pose of the file, without any clip.
    #[serde(default)]
    pub moment: Option<Moment>,
    /// The copies of a scene in two levels below which the tree goes on in their meshes.
    #[serde(default)]
    pub unfolded: CopyRanges,
    /// How the tree follows the model from moment to moment.
    #[serde(default)]
    pub follow: Follow,
    /// How its tree is built.
    pub build: BuildSettings,
    /// Number of threads for building and tracing; 0 for all.
    pub threads: usize,
    /// The camera.
    pub camera: Camera,
    /// Subtracted from the coordinates of the file in those of camera and section plane, [`Scene::offset`](crate::scene::Scene::offset).
    #[serde(default)]
    pub offset: DVec3,
    /// How the picture is shaded and sampled.
    pub render: RenderSettings,
    /// Which bounding volumes are drawn over the picture, and how.
    pub overlay: OverlaySettings,
    /// The tree that this one is compared with.
    #[serde(default)]
    pub second: Option<SecondTree>,
    /// The files that hold the trees, in the order of [`TreeSide::ALL`]; `None` for a tree that is built.
    #[serde(default)]
    pub tree_files: [Option<PathBuf>; 2],
    /// The file of rays by which trees can be measured.
    #[serde(default)]
    pub ray_file: Option<PathBuf>,
}

impl Wanted {
    /// Default settings for `source`. The camera frames the cube from −1 to 1 until the model is loaded.
    pub fn new(source: SceneSource) -> Self {
        Self {
            source,
            moment: None,
            unfolded: CopyRanges::default(),
            follow: Follow::default(),
            build: BuildSettings::default(),
            threads: 0,
            camera: Camera::framing(&Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, Vec3::Y),
            offset: DVec3::ZERO,
            render: RenderSettings::default(),
            overlay: OverlaySettings::default(),
            second: None,
            tree_files: [None, None],
            ray_file: None,
        }
    }

    /// With its numbers clamped to the ranges of their sliders and command line flags.
    #[must_use]
    pub fn within_limits(mut self) -> Self {
        let second = self.second.as_mut().map(|second| {
            second.move_seam(second.seam);
            &mut second.build
        });
        for build in std::iter::once(&mut self.build).chain(second) {
            settings::limit(build);
        }
        self.moment = self.moment.filter(|moment| moment.seconds.is_finite());
        if !Follow::FRAMES.contains(&self.follow.frames) {
            self.follow.frames = Follow::default().frames;
        }
        self.threads = self.threads.min(1024);
        settings::limit(&mut self.render);
        settings::limit(&mut self.overlay);
        self.render.section = self.render.section.filter(SectionPlane::is_usable);
        if !self.offset.is_finite() {
            self.offset = DVec3::ZERO;
        }
        if !self.camera.is_usable() {
            self.camera = Self::new(self.source.clone()).camera;
        }
        self
    }

    /// True if `scene` is the wanted model at the wanted moment with the wanted copies unfolded.
    pub fn is_of(&self, scene: &Scene) -> bool {
        scene.source == self.source
            && scene.moment == self.moment
            && scene.unfolded.ranges == scene.copies_among(&self.unfolded)
    }

    /// The folders in which files are saved, the first that can be written: the model's, the current one unless it is the root, in
    /// which a desktop starts programs, and the home folder.
    pub fn save_folders(&self) -> Vec<PathBuf> {
        let of_model = self
            .source
            .path()
            .and_then(Path::parent)
            .map(|folder| if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_owned() });
        let current = std::env::current_dir().ok().filter(|folder| folder.parent().is_some());
        [of_model, current, std::env::home_dir()].into_iter().flatten().collect()
    }

    /// The file that holds a tree; `None` where it is built.
    pub fn tree_file(&self, side: TreeSide) -> Option<&Path> {
        self.tree_files[side as usize].as_deref()
    }

    /// Reads a tree from this file, or builds it.
    pub fn set_tree_file(&mut self, side: TreeSide, file: Option<PathBuf>) {
        self.tree_files[side as usize] = file;
    }

    /// Settings of a tree, whether it is built with them or not; those of the first where there is no second.
    pub fn build_of(&self, side: TreeSide) -> &BuildSettings {
        match &self.second {
            Some(second) if side == TreeSide::B => &second.build,
            _ => &self.build,
        }
    }

    /// How a tree gets to `moment`; in the pose of the file, trees follow nothing.
    pub fn follow_at(&self, side: TreeSide, moment: Option<Moment>) -> Follow {
        let policy = match self.second {
            Some(second) if side == TreeSide::B => second.policy,
            _ => self.follow.policy,
        };
        if moment.is_some() { Follow { policy, ..self.follow }.normal() } else { Follow::default() }
    }

    /// The policy by which a tree follows the model, to change it; that of the first where there is no second.
    pub fn policy_mut(&mut self, side: TreeSide) -> &mut Policy {
        match &mut self.second {
            Some(second) if side == TreeSide::B => &mut second.policy,
            _ => &mut self.follow.policy,
        }
    }

    /// Shows the model in the pose of its file with no copy unfolded, and rebuilds trees at each moment that is chosen later.
    pub fn stand_still(&mut self) {
        self.moment = None;
        self.unfolded = CopyRanges::default();
        for side in TreeSide::ALL {
            *self.policy_mut(side) = Policy::Rebuild;
        }
    }

    /// Builds a tree instead of reading it where its settings, and nothing else of it, have changed since `before`, or the moment:
    /// the tree of a file is of one pose.
    pub fn build_what_was_changed(&mut self, before: &Self) {
        for side in TreeSide::ALL {
            let same_file = self.tree_file(side).is_some() && self.tree_file(side) == before.tree_file(side);
            let was_there = side == TreeSide::A || self.second.is_some() && before.second.is_some();
            // Oriented boxes are chosen for the tree of a file, too.
            let [build, was] = [&*self, before].map(|wanted| {
                let build = *wanted.build_of(side);
                BuildSettings { optimize: build.optimize.without(Pass::Orient), ..build }
            });
            let changed = build != was || self.moment != before.moment;
            if same_file && was_there && changed {
                self.set_tree_file(side, None);
            }
        }
        if self.second.is_none() {
            self.set_tree_file(TreeSide::B, None);
        }
    }

    /// Whether the viewport shows how two trees differ.
    pub fn shows_difference(&self) -> bool {
        self.second.is_some_and(|second| second.view == CompareView::Difference)
    }

    /// The settings that pictures are traced with: those of `render`, but test counts where the difference of two trees is shown.
    pub fn traced(&self) -> RenderSettings {
        let shading = match self.render.shading {
            Shading::Heat(kind) => Shading::Heat(kind),
            _ if self.shows_difference() => Shading::Heat(HeatKind::Both),
            shading => shading,
        };
        RenderSettings { shading, ..self.render }
    }
}

/// Model and counts that a range was fitted to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeatBasis {
    source: SceneSource,
    shading: Shading,
    traversal: Traversal,
    /// The counts are those of a layout: of any, so that layouts are compared by the same colours.
    is_of_layout: bool,
}

/// Gives a fixed range of the heat map up where model, shading or traversal are no longer those it was fixed for, or where counts of the
/// traced trees give way to those of a layout. Modes other than
/// heat maps keep it. Returns whether it was given up.
pub(super) fn follow_heat_basis(known: &mut Option<HeatBasis>, wanted: &mut Wanted, is_of_layout: bool) -> bool {
    let render = &wanted.render;
    if render.heat_range.is_none() {
        *known = None;
        return false;
    }
    if !matches!(render.shading, Shading::Heat(_)) {
        return false;
    }
    let (source, traversal) = (wanted.source.clone(), render.traversal);
    let basis = HeatBasis { source, shading: render.shading, traversal, is_of_layout };
    let is_other = known.as_ref().is_some_and(|known| *known != basis);
    *known = (!is_other).then_some(basis);
    if is_other {
        wanted.render.heat_range = None;
    }
    is_other
}
