//! What the workers have finished: taken once a UI frame, and shown where it is still of use.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::state::recent;
use crate::app::state::{AppState, Severity};
use crate::app::viewport::orbit;
use crate::app::viewport::picking;
use crate::app::work::jobs::{Built, BuiltTree, Loaded, Rendered};
use crate::app::work::reconcile::{Rails, Shown, drop_elsewhere};
use crate::camera::Camera;
use crate::worker::{Outcome, Worker};
use bvhscope_engine::builders::BuildError;

/// Takes a result without blocking; `Err` where the job ended without one.
fn take<Q: Send + 'static, R: Send + 'static>(worker: &Worker<Q, R>) -> Result<Option<Outcome<R>>, ()> {
    // Asked in this order: a job that ends in between has left its result to be taken.
    let busy = worker.is_busy();
    match worker.take() {
        None if !busy => Err(()),
        outcome => Ok(outcome),
    }
}

impl Rails {
    /// Takes what has arrived. Returns whether anything has.
    pub fn poll(&mut self, state: &mut AppState, now: Instant) -> bool {
        let mut news = false;
        if self.loading.is_some() {
            match take(&self.load) {
                Ok(None) => {}
                Ok(Some(Outcome::Done(loaded))) => self.scene_arrived(loaded, state),
                Ok(Some(Outcome::Panicked(text))) => {
                    self.refused_load = self.loading.take().map(|job| job.key);
                    self.revert_source(state);
                    tell_bug(state, "Loading", &text);
                }
                Err(()) => self.refused_load = self.loading.take().map(|job| job.key),
            }
            news |= self.loading.is_none();
        }
        if self.building.is_some() {
            match take(&self.build) {
                Ok(None) => {}
                Ok(Some(Outcome::Done(built))) => {
                    news = true;
                    self.tree_arrived(built, state, now);
                }
                Ok(Some(Outcome::Panicked(text))) => {
                    news = true;
                    self.stop_building();
                    self.revert_build(state);
                    tell_bug(state, "Building", &text);
                }
                Err(()) => {
                    news = true;
                    self.stop_building();
                    self.revert_build(state);
                }
            }
        }
        if self.rendering.is_some() {
            match take(&self.render) {
                Ok(None) => {}
                Ok(Some(Outcome::Done(rendered))) => {
                    news = true;
                    self.picture_arrived(&rendered, state, now);
                }
                Ok(Some(Outcome::Panicked(text))) => {
                    self.refused_render = self.rendering.take().map(|job| job.key);
                    tell_bug(state, "Tracing", &text);
                }
                Err(()) => self.refused_render = self.rendering.take().map(|job| job.key),
            }
        }
        state.activity.mrays_per_s = self.frame_pacing.mrays_per_s();
        news
    }

    fn scene_arrived(&mut self, loaded: Loaded, state: &mut AppState) {
        self.loading = None;
        match loaded.result {
            Ok(scene) => {
                recent::remember(&mut state.preferences.recent, &scene.source);
                let keep = self.keep_camera && orbit::still_sees(&state.wanted.camera, &scene.bounds);
                let framed = || Camera::framing(&scene.bounds, scene.up);
                self.next_camera = Some(match self.camera_choice.take() {
                    Some(choice) => choice.camera(&scene.bounds, scene.up),
                    None if keep => state.wanted.camera,
                    None => framed(),
                });
                self.keep_camera = false;
                self.loaded = Some(loaded.key);
                self.read_file = loaded.file;
                self.pending = None;
                drop_elsewhere(state.model.loaded.replace(scene));
            }
            Err(error) => {
                eprintln!("error: {error}");
                let kept = if state.model.presented.is_some() { ". The present scene stays" } else { "" };
                state.messages.notify(Severity::Error, format!("{error}{kept}"));
                self.refused_load = Some(loaded.key);
                self.revert_source(state);
                if state.model.presented.is_none() && state.model.loaded.is_none() {
                    // Nothing to fall back on: the built-in scene is always there.
                    state.wanted.source = crate::scene::SceneSource::default_builtin();
                }
            }
        }
    }

    fn tree_arrived(&mut self, built: Built, state: &mut AppState, now: Instant) {
        // What was queued may have come before anybody looked.
        self.building = self.queued.take().filter(|job| job.key != built.key);
        match built.result {
            Ok(tree) => {
                let newest = state.model.loaded.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &built.key.scene));
                let fits = |rendered: &Rendered| {
                    let (key, wanted) = (&rendered.key, &state.wanted);
                    key.camera == wanted.camera
                        && key.settings == wanted.render
                        && key.size_px == state.layout.viewport_px
                };
                match built.picture.filter(fits) {
                    _ if !newest => {}
                    Some(rendered) => self.tree_arrived_with_picture(tree, rendered, state, now),
                    // The picture of the one before is on its way: it would never come if each tree replaced the last.
                    None if self.pending.is_some() && self.is_moving(now) => drop_elsewhere(tree),
                    None => drop_elsewhere(self.pending.replace(tree)),
                }
            }
            Err(BuildError::Refused(why)) => self.refuse_tree(state, &why),
            Err(BuildError::Cancelled(_)) => {}
        }
    }

    /// The tree is shown at once, coarse as its first picture is.
    fn tree_arrived_with_picture(&mut self, tree: BuiltTree, rendered: Rendered, state: &mut AppState, now: Instant) {
        if self.rendering.take().is_some() {
            self.render.cancel();
        }
        drop_elsewhere(self.pending.take());
        self.frame_pacing.learn(&rendered.frame, now);
        self.swap_tree(tree, &rendered, state, now);
        drop_elsewhere(self.shown.replace(Shown { key: rendered.key, complete: false }));
    }

    fn picture_arrived(&mut self, rendered: &Rendered, state: &mut AppState, now: Instant) {
        let key = match &mut self.rendering {
            Some(job) => job.key.clone(),
            None => return,
        };
        if rendered.last {
            self.rendering = None;
        }
        self.frame_pacing.learn(&rendered.frame, now);
        let is_pending = self.pending.as_ref().is_some_and(|tree| Arc::ptr_eq(&tree.accel, &rendered.key.accel));
        if is_pending {
            if let Some(tree) = self.pending.take() {
                self.swap_tree(tree, rendered, state, now);
            }
        } else if let Some(presented) = &mut state.model.presented
            && Arc::ptr_eq(&presented.accel, &rendered.key.accel)
        {
            self.frames += 1;
            presented.frame = Arc::clone(&rendered.frame);
            presented.frame_id = self.frames;
            // While something moves nothing is counted: the last counts of this tree stay.
            presented.tests_per_ray = rendered.frame.stats.tests_per_ray().or(presented.tests_per_ray);
        } else {
            return;
        }
        let coarseness = rendered.frame.coarseness;
        let complete = rendered.last && coarseness == 1 && rendered.key.settings == key.settings;
        if coarseness == 1 {
            log::info!("picture at full resolution, {} samples a pixel", rendered.frame.samples);
        }
        drop_elsewhere(self.shown.replace(Shown { key, complete }));
    }

    /// Tree, lines, picture and numbers change together.
    fn swap_tree(&mut self, tree: BuiltTree, rendered: &Rendered, state: &mut AppState, now: Instant) {
        let old_scene = state.model.presented.as_ref().map(|presented| Arc::clone(&presented.accel.scene));
        let selected = picking::portable_selection(state);
        state.selection.hover = None;
        state.selection.nodes.hovered = None;
        state.selection.nodes.hidden.clear();
        let max_depth = tree.accel.tree.max_depth();
        let same_scene = old_scene.is_some_and(|scene| Arc::ptr_eq(&scene, &tree.accel.scene));
        let next = self.building.as_ref().map(|job| job.since);
        let waited =
            std::mem::replace(&mut self.tree_wanted_at, next).map_or(Duration::ZERO, |since| now.duration_since(since));
        log::info!(
            "presented {} · δ {} · {} triangles · {} nodes · {} ms after it was wanted",
            tree.accel.scene.source.label(),
            tree.accel.settings.threshold,
            tree.accel.scene.triangles.len(),
            tree.accel.tree.node_count(),
            waited.as_millis()
        );
        self.present(tree, rendered, state);
        if same_scene {
            picking::restore_selection(state, selected);
            return;
        }
        picking::pick(state, None);
        self.frame_pacing.forget();
        if self.next_camera.take().is_some() {
            state.wanted.camera = rendered.frame.camera;
        }
        let [first, last] = &mut state.wanted.overlay.depth;
        *last = (*last).min(max_depth);
        *first = (*first).min(*last);
        state.undo.settle(&state.wanted);
    }
}

fn tell_bug(state: &mut AppState, doing: &str, text: &str) {
    eprintln!("error: {doing} failed: {text}");
    state.messages.notify(
        Severity::Error,
        format!("{doing} failed through a mistake in this program: {text}. What was on the screen stays"),
    );
}
