//! State of the window: plain values that panels read, commands change and workers follow. Starts no work and depends on no egui.
//! Those of the dock's views belong to them (`views`).

mod wanted;

pub mod action;
mod activity;
pub mod comparison;
pub mod curve;
pub mod derived;
pub(in crate::app) mod json;
mod layout;
pub mod lesson;
mod model;
pub mod picture_cut;
mod picture_layout;
mod picture_ray;
mod playback;
pub mod ray_file;
mod second_tree;
mod selection;
mod shared_picture;
mod state_line;
mod study;
pub mod views;

pub mod paper;
pub mod preferences;
mod start_page;
mod undo;

pub use action::Request;
pub use activity::{Activity, JobStatus, Message, MessageLog, PROGRESS_DELAY, Severity};
pub use derived::Derived;
pub use layout::{Graphics, Help, HelpPage, Layout, Side};
pub use model::{Difference, Model, Presented};
pub use picture_cut::{PictureCut, Standing};
pub use picture_layout::{LayoutOf, PictureLayout};
pub use picture_ray::{PictureRay, RayOutcome, RaySource, SPEEDS};
pub use playback::{Clock, Playback};
pub use preferences::{Navigation, Preferences, Theme};
pub use second_tree::{CompareView, SecondTree, TreeSide};
pub use selection::{HiddenNodes, HoveredPixel, PickedTriangle, SecondNodes, SelectionState};
pub use shared_picture::{SharedPicture, SharedRay};
pub use start_page::{FolderEntry, Listing, PathField, THUMBNAIL_SIZE, Thumbnail, Thumbnails};
pub use state_line::{SharedNodes, SharedState};
pub use study::{OtherTree, Study};
pub use undo::UndoStack;
pub use views::{ViewState, ViewStates};
pub use wanted::{HeatBasis, Wanted};

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use self::paper::RowFormat;
use self::ray_file::Reading;
use crate::accel::Accel;
use crate::accel::laid::CountedLayout;
use crate::catalog::metrics::Source;
use crate::lab::population::{Population, ViewRays};
use crate::lab::ray::RayRequest;
use crate::overlay::{ColorBy, ContainerSet, NodeTable, OverlaySettings};
use crate::render::Shading;
use crate::render::cluster_cut::ClusterCut;
use crate::scene::{Clip, Moment, Motion, Scene};
use crate::text::{counted, shown_path};
use crate::visibility::TriangleSet;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::survival::Survival;

/// The settings of `accel` without the passes over its tree; `None` where it had none.
pub fn before_passes(accel: &Accel) -> Option<BuildSettings> {
    let passes = accel.settings.passes();
    let before = passes.iter().filter(|pass| *pass == Pass::Split).fold(Passes::NONE, Passes::with);
    (accel.file.is_none() && before != passes).then_some(BuildSettings { optimize: before, ..accel.settings })
}

/// State of the window.
pub struct AppState {
    /// The user's settings of model, tree and picture.
    pub wanted: Wanted,
    /// The loaded model and what is on the screen.
    pub model: Model,
    /// Running jobs and measured results.
    pub activity: Activity,
    /// Selected, hidden and hovered parts.
    pub selection: SelectionState,
    /// States of the dock's views.
    pub views: ViewStates,
    /// Messages to the user.
    pub messages: MessageLog,
    /// Open dialogs, size and focus of the window.
    pub layout: Layout,
    /// Settings saved between runs, apart from `wanted`.
    pub preferences: Preferences,
    /// Earlier and later values of `wanted`.
    pub undo: UndoStack,
}

impl AppState {
    /// Makes section plane and ray those of a scene with this offset, where they are in the file. Returns the shift of coordinates, by
    /// which the camera follows once that scene is shown.
    pub fn move_to_offset(&mut self, offset: DVec3) -> Vec3 {
        let shift = (self.wanted.offset - offset).as_vec3();
        self.wanted.offset = offset;
        if shift != Vec3::ZERO {
            self.wanted.render.section.iter_mut().for_each(|plane| plane.shift(shift));
            self.model.ray.source.iter_mut().for_each(|source| source.shift(shift));
        }
        shift
    }

    /// The state before anything is loaded.
    pub fn new(wanted: Wanted, preferences: Preferences) -> Self {
        Self {
            wanted,
            model: Model::default(),
            activity: Activity::default(),
            selection: SelectionState::default(),
            views: ViewStates::default(),
            messages: MessageLog::default(),
            layout: Layout::default(),
            preferences,
            undo: UndoStack::default(),
        }
    }

    /// The clips of the loaded model; `None` where it stands still.
    pub fn motion(&self) -> Option<&Arc<Motion>> {
        self.model.loaded.as_ref()?.motion.as_ref()
    }

    /// The wanted moment with its clip; `None` in the pose of the file.
    pub fn clip(&self) -> Option<(Moment, &Clip)> {
        let moment = self.motion()?.within(self.wanted.moment?)?;
        Some((moment, &self.motion()?.clips[moment.clip]))
    }

    /// The time of the loaded model, to be changed; `None` where it stands still.
    pub fn clock(&mut self) -> Option<Clock<'_>> {
        let motion = Arc::clone(self.motion()?);
        Some(Clock { playback: &mut self.model.playback, moment: &mut self.wanted.moment, motion })
    }

    /// Ends the tour, which does not come back by itself.
    pub fn end_tour(&mut self) {
        self.layout.tour = None;
        self.preferences.toured = true;
    }

    /// The nodes of the first tree that the second has too, and the other way round, once they are known.
    pub fn survival(&self) -> Option<&Arc<[Survival; 2]>> {
        let (first, second) = (self.model.presented.as_ref()?, self.model.second.as_ref()?);
        self.model.derived.survival.get(&first.accel, &OtherTree::new(&second.accel))
    }

    /// The nodes of the first tree that the other one has too, and the other way round, once they are known. The other one is the second
    /// tree, else the first before its passes.
    pub fn compared(&self) -> Option<&Arc<[Survival; 2]>> {
        match self.wanted.second {
            Some(_) => self.survival(),
            None => self.model.derived.moved.get(&self.model.presented.as_ref()?.accel, &()),
        }
    }

    /// The content of the viewport: the wanted view where its trees are there, else the first tree.
    pub fn shown_view(&self) -> CompareView {
        let Some(second) = self.wanted.second.filter(|_| self.model.second.is_some()) else { return CompareView::A };
        match second.view {
            CompareView::Difference if self.model.difference.is_none() => CompareView::A,
            view => view,
        }
    }

    /// The tree whose settings the panel and the keys change: B only while there is one.
    pub fn edited_side(&self) -> TreeSide {
        if self.wanted.second.is_some() { self.layout.edited_tree } else { TreeSide::A }
    }

    /// The settings that the panel shows and the keys change.
    pub fn edited_build(&self) -> &BuildSettings {
        match &self.wanted.second {
            Some(second) if self.layout.edited_tree == TreeSide::B => &second.build,
            _ => &self.wanted.build,
        }
    }

    /// [`AppState::edited_build`], to change it.
    pub fn edited_build_mut(&mut self) -> &mut BuildSettings {
        match &mut self.wanted.second {
            Some(second) if self.layout.edited_tree == TreeSide::B => &mut second.build,
            _ => &mut self.wanted.build,
        }
    }

    /// The selected node, with the tree in which it was chosen.
    pub fn selected(&self) -> Option<(&Presented, u32)> {
        let node = match self.selection.side {
            TreeSide::A => self.selection.nodes.selected,
            TreeSide::B => self.selection.second.selected,
        };
        let shown = self.shown_tree(self.selection.side)?;
        node.filter(|&node| (node as usize) < shown.table.len()).map(|node| (shown, node))
    }

    /// Selects a node of the presented tree. The picked triangle stays where it lies below the node.
    pub fn select_node(&mut self, node: u32) {
        (self.selection.nodes.selected, self.selection.side) = (Some(node), TreeSide::A);
        self.selection.picked.take_if(|picked| !picked.path.contains(&node));
    }

    /// The triangles below hidden nodes of the presented tree, if the picture leaves them out.
    pub fn hidden_triangles(&self) -> Option<Arc<TriangleSet>> {
        let presented = self.model.presented.as_ref().filter(|_| self.wanted.overlay.hide_triangles)?;
        let visibility = presented.table.visibility(&self.selection.nodes)?;
        Some(Arc::clone(&visibility.triangles)).filter(|triangles| !triangles.is_empty())
    }

    /// The presented tree.
    pub fn presented_tree(&self) -> Option<Arc<Accel>> {
        self.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel))
    }

    /// The studied tree while the view of this name is open.
    pub fn tree_of_view(&self, view: &str) -> Option<Arc<Accel>> {
        let studied = self.model.studied().filter(|_| self.preferences.dock.shows(view))?;
        Some(Arc::clone(&studied.accel))
    }

    /// The studied tree while a view is open, with the inputs of a study of it, where they are known.
    pub fn inputs_of<V: ViewState, K>(
        &self,
        inputs: impl FnOnce(&V, &Model, &Arc<Accel>) -> Option<K>,
    ) -> Option<(Arc<Accel>, K)> {
        let accel = self.tree_of_view(V::NAME)?;
        let inputs = inputs(self.views.get(), &self.model, &accel)?;
        Some((accel, inputs))
    }

    /// Whether the chosen experiment has measured what a file of this format holds.
    pub fn can_save_rows(&self, format: RowFormat) -> bool {
        let result = self.activity.measured.get(&self.preferences.paper.experiment);
        result.is_some_and(|result| match format {
            RowFormat::Csv | RowFormat::Json => !result.rows.is_empty(),
            RowFormat::Png | RowFormat::Svg => !result.figure.charts.is_empty(),
        })
    }

    /// Whether the view "Ray" is open.
    pub fn shows_ray(&self) -> bool {
        self.preferences.dock.shows(PictureRay::VIEW)
    }

    /// Whether a click on the picture takes the ray of its pixel.
    pub fn picks_rays(&self) -> bool {
        self.shows_ray() && self.model.ray.picks && self.model.presented.is_some()
    }

    /// Takes the ray of a pixel of the picture.
    pub fn take_ray(&mut self, pixel: [u32; 2]) {
        if let Some(shown) = &self.model.presented {
            self.model.ray.take_pixel(pixel, shown.frame.camera, self.layout.viewport_px);
        }
    }

    /// The tree and the ray that the view "Ray" lacks a record of; `None` while it is closed.
    pub fn wanted_ray(&self) -> Option<(Arc<Accel>, RayRequest)> {
        let shown = self.model.presented.as_ref().filter(|_| self.shows_ray())?;
        let request = self.model.ray.request(&shown.frame.settings, self.hidden_triangles())?;
        Some((Arc::clone(&shown.accel), request))
    }

    /// The second tree and the ray that the view "Ray" lacks a record of in it.
    pub fn wanted_second_ray(&self) -> Option<(Arc<Accel>, RayRequest)> {
        let second = self.model.second.as_ref()?;
        self.wanted_ray().map(|(_, request)| (Arc::clone(&second.accel), request))
    }

    /// Takes the rays of the wanted file once they are read. Returns the tree and the file for which they still are to be.
    pub fn follow_ray_file(&mut self) -> Option<(Arc<Accel>, (PathBuf, u32))> {
        let derived = &mut self.model.derived;
        let Some(path) = &self.wanted.ray_file else {
            derived.ray_file.forget();
            if derived.population == Population::File {
                derived.population = Population::default();
            }
            return None;
        };
        let accel = self.model.presented.as_ref().map(|shown| Arc::clone(&shown.accel))?;
        match derived.ray_file.follow(&accel, path) {
            Reading::Known => None,
            Reading::Wanted(key) => Some((accel, key)),
            Reading::Failed(reason) => {
                self.messages.notify(Severity::Warning, reason);
                self.wanted.ray_file = None;
                None
            }
            Reading::New(read) => {
                derived.population = Population::File;
                let name = shown_path(path);
                for text in read.set.faults.texts() {
                    self.messages.notify(Severity::Warning, format!("{name}: {text}"));
                }
                let rays = counted(read.set.rays.len() as u64, "rays");
                let text = format!("{name}: {rays}. Nodes, Icicle and Plots are by them now, and Ray replays each");
                self.messages.notify(Severity::Info, text);
                None
            }
        }
    }

    /// Takes the ray of the file at this place for the view "Ray".
    pub fn take_ray_of_file(&mut self, place: usize) {
        let (Some(shown), Some(read)) = (&self.model.presented, self.model.derived.ray_file.rays()) else { return };
        let place = place.min(read.set.rays.len() - 1);
        let ray = read.set.rays[place].ray;
        self.model.derived.ray_file.chosen = place;
        self.model.ray.take_given(ray, shown.frame.camera, self.layout.viewport_px);
    }

    /// The primary rays of the wanted view, by which visits can be measured, or by others of that view.
    pub fn view_rays(&self) -> ViewRays {
        let Wanted { camera, render, .. } = &self.wanted;
        self.model.derived.with_file(ViewRays::new(Population::Primary, *camera, self.layout.viewport_px, render))
    }

    /// Copies a text to the clipboard and posts the `note` that it was, unless that is empty; where there is no clipboard, posts
    /// that instead.
    pub fn copy(&mut self, text: String, note: &str) {
        match &self.layout.clipboard_fault {
            None if note.is_empty() => {}
            None => self.messages.notify(Severity::Info, note),
            Some(reason) => {
                let text = format!("Nothing was copied, because there is no clipboard to copy to: {reason}");
                self.messages.notify(Severity::Warning, text);
            }
        }
        self.activity.requests.push(Request::Copy(text));
    }

    /// Fits the heat map to every picture again, with a message, where its fixed range belongs to another model, shading or
    /// traversal, or to the traced trees and not to a layout; called once a UI frame.
    pub fn follow_heat_range(&mut self) {
        if self.opens_shared() {
            // The range is that of the model that is about to be opened.
            return;
        }
        let is_of_layout = self.model.layout.chosen.is_some() && self.counts_layouts();
        if wanted::follow_heat_basis(&mut self.model.heat_basis, &mut self.wanted, is_of_layout) {
            let text =
                "The heat range is fitted to every picture again: the fixed one was for other counts (C fixes it)";
            self.messages.notify(Severity::Info, text);
        }
    }

    /// Heat maps count the layout on show. Two trees are compared by their own counts.
    pub fn counts_layouts(&self) -> bool {
        self.wanted.second.is_none() && self.wanted.render.shading.is_of_layouts()
    }

    /// The layout of `accel` that the picture counts, once it is laid out.
    pub fn counted_layout(&self, accel: &Arc<Accel>) -> Option<CountedLayout> {
        self.model.laid_out(accel).filter(|_| self.counts_layouts())
    }

    /// Whether the model of a shared state is about to be opened: it is wanted from the end of this UI frame on.
    fn opens_shared(&self) -> bool {
        self.activity.requests.iter().any(|request| matches!(request, Request::OpenShared { .. }))
    }

    /// Selects and hides what a pasted state does, once its tree is presented; called once a UI frame.
    pub fn follow_shared_nodes(&mut self) {
        if self.opens_shared() {
            return;
        }
        let Some(shown) = &self.model.presented else { return };
        let accel = &shown.accel;
        let is_there = self.wanted.is_of(&accel.scene) && accel.scene.has_form(self.model.load_options.instances);
        if !is_there || !self.is_wanted(accel, TreeSide::A) {
            return;
        }
        let Some(nodes) = self.selection.pasted.take() else { return };
        let SharedNodes { selected, triangle, hidden, isolated, only } = nodes;
        let exists = |node: &u32| (*node as usize) < shown.table.len();
        self.views.show_shared_nodes(shown);
        let picked = triangle.map(|primitive| PickedTriangle { primitive, path: accel.path_to(primitive) });
        self.selection.picked = picked.filter(|picked| !picked.path.is_empty());
        let nodes = &mut self.selection.nodes;
        nodes.selected = selected.filter(exists);
        nodes.hidden = hidden.into_iter().filter(exists).collect();
        nodes.isolated = isolated.filter(exists);
        let only = only.map(|ranges| TriangleSet::from_ranges(&ranges, accel.scene.triangles.len()));
        nodes.only = only.filter(|only| !only.is_empty()).map(Arc::new);
        if nodes.selected != selected || nodes.isolated != isolated {
            let text = "Some nodes of the pasted state do not exist in this tree: the model is not the same";
            self.messages.notify(Severity::Warning, text);
        }
    }

    /// The cut through `accel`, or through a tree that is not there yet, whose nodes cluster colours show: that of the open view
    /// "Merges". `None` where they show the nodes at a depth.
    pub fn cluster_cut(&self, accel: Option<&Arc<Accel>>) -> Option<ClusterCut> {
        let is_wanted =
            self.preferences.dock.shows(PictureCut::VIEW) && self.wanted.render.shading == Shading::Clusters;
        if is_wanted { self.model.cut.cluster_cut(accel) } else { None }
    }

    /// Speed of tracing and shading the picture in the last second, in Mray/s.
    pub const fn mrays_per_s(&self) -> f64 {
        self.activity.mrays_per_s
    }

    /// Restores settings and hidden nodes as before the last change, and the selection that hid or isolated them.
    pub fn undo(&mut self) {
        self.record_hidden();
        self.undo.undo(&mut self.wanted, &mut self.selection);
        self.restore_hidden();
    }

    /// Restores what was last undone.
    pub fn redo(&mut self) {
        self.record_hidden();
        self.undo.redo(&mut self.wanted, &mut self.selection);
        self.restore_hidden();
    }

    /// Records a step that can be undone where settings or hidden nodes have changed, and a move of the camera; called once a UI frame.
    /// All changes while `dragging` make one step, all of the camera while it is `moving` one move.
    pub fn record_step(&mut self, dragging: bool, moving: bool) {
        self.undo.cameras.observe(&self.wanted.camera, moving);
        self.record_hidden();
        self.undo.observe(&self.wanted, &self.selection, dragging);
    }

    /// Adopts the hidden nodes of the presented tree, so that they can be hidden in other trees of its scene.
    pub fn record_hidden(&mut self) {
        if let Some(presented) = &self.model.presented {
            self.selection.hidden.record(&presented.accel, &self.selection.nodes);
        }
    }

    /// Hides in the presented tree the nodes that were recorded, where it has them.
    pub fn restore_hidden(&mut self) {
        if let Some(presented) = &self.model.presented {
            self.selection.hidden.resolve(&presented.accel, &mut self.selection.nodes);
        }
    }

    /// Tells how many hidden nodes the presented tree lacks, where they have become more.
    pub fn report_missing_hidden(&mut self) {
        let missing = self.selection.hidden.missing();
        if missing > self.selection.reported_missing {
            let [nodes, are] = if missing == 1 { ["node", "is"] } else { ["nodes", "are"] };
            let text = format!(
                "{missing} hidden {nodes} {are} not in this tree: the same triangles are in no single node of it. A tree that has them hides them again"
            );
            self.messages.notify(Severity::Info, text);
        }
        self.selection.reported_missing = missing;
    }

    /// Whether only the containers that both trees have are drawn.
    pub fn draws_only_common(&self) -> bool {
        self.wanted.second.is_some_and(|second| second.only_common)
    }

    /// The settings of the containers of one of the two trees. Where only those that both trees have are drawn, the range of depths that
    /// suits it counts these alone, once they are known.
    pub fn overlay_of(&self, table: &NodeTable) -> OverlaySettings {
        let overlay = self.wanted.overlay;
        let is_counted = self.draws_only_common() && overlay.depth.is_none() && !overlay.leaves_only;
        let is_of = |side: &TreeSide| self.shown_tree(*side).is_some_and(|shown| shown.table.id == table.id);
        let side = TreeSide::ALL.into_iter().find(is_of).filter(|_| is_counted);
        let counts = side.zip(self.survival()).map(|(side, survival)| &survival[side as usize].nodes_per_depth);
        let depth = counts.map(|counts| table.depths_of_few(counts.iter().map(|&count| count as usize)));
        OverlaySettings { depth: depth.or(overlay.depth), ..overlay }
    }

    /// First and last depth that are drawn of the presented tree, or of its layout on show; of a tree that is not there yet, the wanted
    /// ones.
    pub fn drawn_depths(&self) -> [u32; 2] {
        let of_tree = self.model.table().map(|table| table.drawn_depths(&self.overlay_of(table)));
        of_tree.or(self.wanted.overlay.depth).unwrap_or_default()
    }

    /// Kind of the presented tree's containers; of a tree that is not there yet, the wanted one.
    pub fn container_kind(&self) -> ContainerKind {
        let shown = self.model.presented.as_ref().map(|shown| shown.table.container_kind());
        shown.unwrap_or(self.wanted.build.container)
    }

    /// A tree on the screen.
    pub fn shown_tree(&self, side: TreeSide) -> Option<&Presented> {
        match side {
            TreeSide::A => self.model.presented.as_ref(),
            TreeSide::B => self.model.second.as_ref(),
        }
    }

    /// The shown trees of `scene` that files hold, each once.
    pub fn trees_from_files(&self, scene: &Arc<Scene>) -> Vec<Arc<Accel>> {
        let shown = TreeSide::ALL.into_iter().filter_map(|side| self.shown_tree(side)).map(|shown| &shown.accel);
        let mut trees: Vec<Arc<Accel>> = Vec::new();
        for accel in shown.filter(|accel| Arc::ptr_eq(&accel.scene, scene)) {
            let path = |accel: &Arc<Accel>| accel.file.as_ref().map(|file| file.path.clone());
            if accel.file.is_some() && trees.iter().all(|other| path(other) != path(accel)) {
                trees.push(Arc::clone(accel));
            }
        }
        trees
    }

    /// Whether a tree is the wanted one.
    fn is_wanted(&self, accel: &Accel, side: TreeSide) -> bool {
        match (self.wanted.tree_file(side), &accel.file) {
            (None, None) => {
                let follow = self.wanted.follow_at(side, accel.scene.moment);
                accel.settings == *self.wanted.build_of(side) && accel.follow == follow
            }
            (Some(wanted), Some(file)) => file.path == wanted,
            _ => false,
        }
    }

    /// Whether containers are drawn: in the difference of two trees only where they were asked for there.
    pub fn shows_containers(&self) -> bool {
        let is_difference = self.shown_view() == CompareView::Difference;
        self.preferences.show_containers
            && (!is_difference || self.wanted.second.is_some_and(|second| second.over_difference))
    }

    /// Draws containers in the present view, or not.
    pub fn toggle_containers(&mut self) {
        let shows = !self.shows_containers();
        let is_difference = self.shown_view() == CompareView::Difference;
        match &mut self.wanted.second {
            Some(second) if is_difference => {
                second.over_difference = shows;
                self.preferences.show_containers |= shows;
            }
            _ => self.preferences.show_containers = shows,
        }
    }

    /// Whether containers are drawn in colours of this meaning.
    pub fn colors_by(&self, color_by: ColorBy) -> bool {
        self.shows_containers() && self.wanted.overlay.color_by == color_by
    }

    /// Whether the colours of containers need data of this kind.
    pub fn colors_from(&self, source: Source) -> bool {
        self.preferences.show_containers && self.wanted.overlay.color_by.source() == source
    }

    /// The kinds of containers that are drawn; none while containers are off.
    pub fn drawn_kinds(&self) -> ContainerSet {
        let kinds = self.wanted.overlay.kinds(self.container_kind());
        if self.shows_containers() { kinds } else { ContainerSet::NONE }
    }

    /// Whether a side panel is visible: open, and not displaced by the other one in a narrow window.
    pub fn shows_panel(&self, side: Side) -> bool {
        let Preferences { left_open, right_open, .. } = self.preferences;
        let open = if side == Side::Left { left_open } else { right_open };
        open && (!(self.layout.narrow && left_open && right_open) || self.layout.front_side == side)
    }

    /// Opens or closes a side panel. In a narrow window opening one hides the other, and closing it closes both.
    pub fn toggle_panel(&mut self, side: Side) {
        let open = !self.shows_panel(side);
        let Preferences { left_open, right_open, .. } = &mut self.preferences;
        *(if side == Side::Left { &mut *left_open } else { &mut *right_open }) = open;
        if open {
            self.layout.front_side = side;
        } else if self.layout.narrow {
            (*left_open, *right_open) = (false, false);
        }
    }
}
