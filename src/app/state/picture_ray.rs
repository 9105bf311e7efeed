//! The ray over the picture, which the view "Ray" shows too: which it is, its record, and the step that is looked at.

use std::sync::{Arc, Weak};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::accel::{Accel, is_same};
use crate::app::state::study::Study;
use crate::camera::Camera;
use crate::lab::ray::{RayMethod, RayRecord, RayRequest};
use crate::render::{NoRay, RayKind, RayStart, RenderSettings};
use crate::scene::{from_file, to_file};
use crate::text::{parse_direction, parse_vector};
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::traverse::Traversal;

/// A record, or why there is none.
pub type RayOutcome = Result<RayRecord, NoRay>;

/// Slowest and fastest replay in steps a second.
pub const SPEEDS: [f64; 2] = [0.5, 200.0];

/// Where the ray comes from, with the picture that it was taken from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RaySource {
    /// A pixel of that picture, or a typed ray.
    pub start: RayStart,
    /// The camera of that picture, so that the ray stays the same while the view turns.
    pub camera: Camera,
    /// Width and height of that picture in pixels.
    pub size_px: [u32; 2],
}

/// The ray that picture and view show.
#[derive(Debug)]
pub struct PictureRay {
    /// Where the ray comes from; `None` until the user has chosen one.
    pub source: Option<RaySource>,
    /// Its purpose.
    pub kind: RayKind,
    /// The traversal.
    pub method: RayMethod,
    /// Clicks on the picture take rays.
    pub picks: bool,
    /// Origin and direction as typed.
    pub typed: [String; 2],
    /// Why the typed ray cannot be taken.
    pub fault: Option<String>,
    /// An event of the record that the user did not cause.
    pub remark: Option<&'static str>,
    /// The record.
    pub record: Study<RayRequest, RayOutcome>,
    /// The record of the same ray in the second tree.
    pub second: Study<RayRequest, RayOutcome>,
    /// Index of the present step.
    pub cursor: usize,
    /// The steps are replayed.
    pub playing: bool,
    /// Speed of the replay in steps a second.
    pub speed: f64,
    /// First and last distance that the strip shows; `None` for the whole ray.
    pub zoom: Option<[f32; 2]>,
    /// The strip is to have the keyboard focus, so that the keys of the view act.
    pub wants_focus: bool,
    /// The part of the next step that was waited for.
    elapsed: f64,
    /// The step that the list was last scrolled to.
    revealed: Option<usize>,
    /// The record that was shown last, and its tree.
    shown: Option<(Weak<Accel>, Arc<RayOutcome>)>,
}

/// The part of the view in a shared state. Its ray is shared beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedRayView {
    kind: RayKind,
    method: RayMethod,
    picks: bool,
    typed: [String; 2],
    speed: f64,
    zoom: Option<[f32; 2]>,
}

impl Default for SharedRayView {
    fn default() -> Self {
        PictureRay::default().shared()
    }
}

impl Default for PictureRay {
    fn default() -> Self {
        Self {
            source: None,
            kind: RayKind::Primary,
            method: RayMethod::Binary(Traversal::Ordered),
            picks: true,
            typed: Default::default(),
            fault: None,
            remark: None,
            record: Study::default(),
            second: Study::default(),
            cursor: 0,
            playing: false,
            speed: 8.0,
            zoom: None,
            wants_focus: false,
            elapsed: 0.0,
            revealed: None,
            shown: None,
        }
    }
}

impl RaySource {
    /// Moves it with coordinates that become larger by `shift`.
    pub fn shift(&mut self, shift: Vec3) {
        self.camera = self.camera.shifted(shift);
        if let RayStart::Given(ray) = &mut self.start {
            ray.origin += shift;
        }
    }
}

impl PictureRay {
    /// Name of its view.
    pub const VIEW: &str = "Ray";

    /// Its part of a shared state.
    pub fn shared(&self) -> SharedRayView {
        #[rustfmt::skip]
        let Self {
            kind, method, picks, typed, speed, zoom,
            // In the shared state beside this part, as in earlier versions.
            source: _, cursor: _,
            // Derived, or of the moment.
            fault: _, remark: _, record: _, second: _, playing: _, wants_focus: _, elapsed: _, revealed: _, shown: _,
        } = self;
        let (kind, method, picks) = (*kind, *method, *picks);
        SharedRayView { kind, method, picks, typed: typed.clone(), speed: *speed, zoom: *zoom }
    }

    /// Shows what another window showed.
    pub fn show_shared(&mut self, shared: SharedRayView) {
        let SharedRayView { kind, method, picks, typed, speed, zoom } = shared;
        (self.kind, self.method, self.picks, self.typed) = (kind, method, picks, typed);
        self.speed = speed.clamp(SPEEDS[0], SPEEDS[1]);
        self.zoom = zoom.filter(|[first, last]| first < last);
    }

    /// Takes the ray of a pixel.
    pub fn take_pixel(&mut self, pixel: [u32; 2], camera: Camera, size_px: [u32; 2]) {
        self.take(RaySource { start: RayStart::Pixel(pixel), camera, size_px });
    }

    /// Takes the typed ray; keeps the one before and sets the reason where it is no ray.
    /// Its origin is in the coordinates of the file, of which those of the scene are less by `offset`.
    pub fn take_typed(&mut self, camera: Camera, size_px: [u32; 2], offset: DVec3) {
        let [origin, direction] = &self.typed;
        let ray = parse_vector(origin).map_err(|reason| format!("Origin: {reason}")).and_then(|origin| {
            let origin = from_file(origin, offset);
            Ok(Ray::new(origin, parse_direction(direction).map_err(|r| format!("Direction: {r}"))?))
        });
        match ray {
            Ok(ray) => self.take(RaySource { start: RayStart::Given(ray), camera, size_px }),
            Err(fault) => self.fault = Some(fault),
        }
    }

    /// Takes a given ray.
    pub fn take_given(&mut self, ray: Ray, camera: Camera, size_px: [u32; 2]) {
        self.kind = RayKind::Primary;
        self.take(RaySource { start: RayStart::Given(ray), camera, size_px });
    }

    fn take(&mut self, source: RaySource) {
        self.source = Some(source);
        (self.fault, self.remark, self.zoom) = (None, None, None);
        // Arrow keys step through a ray that was just taken; a drag in the picture gives them back to the camera.
        self.wants_focus = true;
        self.restart();
    }

    /// Goes back to the first step, of a ray or traversal that was chosen just now.
    pub fn restart(&mut self) {
        (self.cursor, self.playing, self.elapsed) = (0, false, 0.0);
        self.record.resume();
    }

    /// The ray to be recorded in a picture of these settings; `None` until one is chosen.
    pub fn request(&self, settings: &RenderSettings, hidden: Option<Arc<TriangleSet>>) -> Option<RayRequest> {
        let RaySource { start, camera, size_px } = self.source?;
        let settings = settings.of_rays();
        Some(RayRequest { start, kind: self.kind, method: self.method, camera, size_px, settings, hidden })
    }

    /// The record to show beside `accel`, and whether it is of this tree. Called once a UI frame, so that a tree that changes
    /// meanwhile loses neither ray nor step: until the ray is recorded again the old record stays.
    pub fn follow(&mut self, accel: &Arc<Accel>) -> Option<(Arc<RayOutcome>, bool)> {
        self.source?;
        if let Some(newest) = self.record.of_tree(accel) {
            let newest = Arc::clone(newest);
            if self.shown.as_ref().is_none_or(|(_, shown)| !Arc::ptr_eq(shown, &newest)) {
                let other_tree = self.shown.as_ref().is_some_and(|(tree, _)| !is_same(tree, accel));
                if other_tree {
                    self.remark = Some("The tree has changed: this is the same ray through the new one");
                }
                if let Ok(record) = &*newest {
                    self.cursor = self.cursor.min(record.steps.len().saturating_sub(1));
                    self.type_out(accel.scene.in_file(record.ray.origin), record.ray.direction);
                }
                self.shown = Some((Arc::downgrade(accel), newest));
            }
        }
        let (tree, shown) = self.shown.as_ref()?;
        Some((Arc::clone(shown), is_same(tree, accel)))
    }

    /// The last result of [`PictureRay::follow`].
    pub fn shown(&self) -> Option<&Arc<RayOutcome>> {
        self.source?;
        self.shown.as_ref().map(|(_, shown)| shown)
    }

    /// Fills the fields with the ray that is shown, so that it can be changed a little.
    fn type_out(&mut self, origin: DVec3, direction: Vec3) {
        if self.fault.is_none() {
            self.typed = [origin, to_file(direction, DVec3::ZERO)].map(|v| format!("{}, {}, {}", v.x, v.y, v.z));
        }
    }

    /// Shows the surroundings of the hit in the strip, or the whole ray where a part is shown.
    pub fn toggle_zoom(&mut self, record: &RayRecord) {
        self.zoom = if self.zoom.is_some() { None } else { record.around_hit() };
    }

    /// Goes by `by` steps in a record of `steps`, and stops the replay.
    pub fn step(&mut self, by: isize, steps: usize) {
        self.go_to(self.cursor.saturating_add_signed(by), steps);
    }

    /// Goes to a step in a record of `steps`, and stops the replay.
    pub fn go_to(&mut self, step: usize, steps: usize) {
        self.cursor = step.min(steps.saturating_sub(1));
        self.playing = false;
    }

    /// Goes to a step that was clicked in the list.
    pub fn choose(&mut self, step: usize, steps: usize) {
        self.go_to(step, steps);
        (self.revealed, self.wants_focus) = (Some(self.cursor), true);
    }

    /// Whether the list is to be scrolled to the present step: once after each change of it.
    pub fn reveal(&mut self) -> bool {
        self.revealed.replace(self.cursor) != Some(self.cursor)
    }

    /// Starts the replay, from the beginning where it is at the end, or stops it.
    pub fn toggle_play(&mut self, steps: usize) {
        self.playing = !self.playing;
        self.elapsed = 0.0;
        if self.playing && self.cursor + 1 >= steps {
            self.cursor = 0;
        }
    }

    /// Replays `seconds` of a record of `steps`.
    pub fn advance(&mut self, seconds: f64, steps: usize) {
        if !self.playing {
            return;
        }
        self.elapsed += seconds.clamp(0.0, 1.0) * self.speed;
        let whole = self.elapsed.floor();
        self.elapsed -= whole;
        self.cursor = (self.cursor + whole as usize).min(steps.saturating_sub(1));
        self.playing = self.cursor + 1 < steps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvhscope_engine::geometry::Aabb;

    fn camera() -> Camera {
        Camera::framing(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, Vec3::Y)
    }

    #[test]
    fn a_typed_ray_that_points_nowhere_keeps_the_one_before() {
        let mut view = PictureRay::default();
        view.take_pixel([3, 4], camera(), [10, 10]);
        let before = view.source;
        for (typed, part) in [
            (["0,0,0", "0, 0, 0"], "Direction"),
            (["0,0", "0,0,1"], "Origin"),
            (["", ""], "Origin"),
            (["0,0,inf", "0,0,1"], "Origin"),
            (["0,0,0", "0,0,NaN"], "Direction"),
        ] {
            view.typed = typed.map(str::to_owned);
            view.take_typed(camera(), [10, 10], DVec3::ZERO);
            assert!(view.fault.as_ref().is_some_and(|fault| fault.starts_with(part)), "{typed:?}: {:?}", view.fault);
            assert_eq!(view.source, before);
            assert_eq!(view.typed, typed, "what was typed stays");
        }
        view.typed = ["1, 2, 3", "0, 0, 4"].map(str::to_owned);
        view.take_typed(camera(), [10, 10], DVec3::ZERO);
        let taken = Ray::new(Vec3::new(1.0, 2.0, 3.0), Vec3::Z);
        assert_eq!((view.fault.clone(), view.source.map(|source| source.start)), (None, Some(RayStart::Given(taken))));
    }

    #[test]
    fn the_replay_ends_at_the_last_step_and_begins_again_from_there() {
        let mut view = PictureRay { speed: 10.0, ..PictureRay::default() };
        view.toggle_play(5);
        view.advance(0.05, 5);
        assert_eq!((view.cursor, view.playing), (0, true));
        view.advance(0.06, 5);
        assert_eq!((view.cursor, view.playing), (1, true));
        view.advance(1.0, 5);
        assert_eq!((view.cursor, view.playing), (4, false));
        view.advance(1.0, 5);
        assert_eq!(view.cursor, 4);
        view.toggle_play(5);
        assert_eq!((view.cursor, view.playing), (0, true));
        view.step(-1, 5);
        assert_eq!((view.cursor, view.playing), (0, false));
        view.step(9, 5);
        assert_eq!(view.cursor, 4);
        view.go_to(3, 0);
        assert_eq!(view.cursor, 0, "without steps");
    }
}
