//! Moments of a model that moves, as a command names them.

use std::sync::Arc;

use serde::Serialize;

use super::context::{Failure, in_pool};
use crate::accel::{Accel, Follow};
use crate::console::note;
use crate::scene::{Clip, Moment, Scene};
use crate::text::{number, printable, quoted};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Most frames of a film.
const MAX_FRAMES: f32 = 10_000.0;
/// How far in seconds a time may lie outside of a clip, whose ends are listed rounded to milliseconds.
const ROUNDED: f32 = 0.0006;

/// Times of a clip in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Times {
    /// A single one.
    At(f32),
    /// First and last time and the step between, in seconds; `None` for one of each frame.
    Range([f32; 2], Option<f32>),
}

impl Times {
    /// Parses `A..B` or `A..B:STEP`, in seconds.
    pub fn parse_range(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "times in seconds A..B:STEP with A <= B and at most {MAX_FRAMES} steps are expected, as in 0..2:0.04"
            )
        };
        let (range, step) = match text.split_once(':') {
            Some((range, step)) => (range, Some(step.parse().map_err(|_| expected())?)),
            None => (text, None),
        };
        let ends = range.split_once("..").and_then(|(from, to)| Some([from.parse().ok()?, to.parse().ok()?]));
        let [from, to]: [f32; 2] = ends.ok_or_else(expected)?;
        let has_room = |step: f32| step > 0.0 && to - from <= step * MAX_FRAMES;
        let is_sound = from <= to && step.map_or((to - from).is_finite(), has_room);
        if is_sound { Ok(Self::Range([from, to], step)) } else { Err(expected()) }
    }

    /// The flag that gives them.
    const fn flag(self) -> &'static str {
        match self {
            Self::At(_) => "--time",
            Self::Range(..) => "--frames",
        }
    }

    /// The error message for times outside of `clip`.
    fn beyond(self, clip: &Clip) -> Option<String> {
        let (given, [first, last]) = match self {
            Self::At(seconds) => (seconds.to_string(), [seconds; 2]),
            Self::Range([from, to], _) => (format!("{from}..{to}"), [from, to]),
        };
        let Clip { name, start, end } = clip;
        // Before its first key, which may be later than the beginning, a clip stands still.
        (first < start.min(0.0) - ROUNDED || last > end + ROUNDED).then(|| {
            format!(
                "{} {given}: clip {} lasts from {} to {} s",
                self.flag(),
                quoted(name),
                number((*start).into()),
                number((*end).into())
            )
        })
    }

    /// The times, in order, of a model with this time in seconds between frames.
    fn seconds(self, frame_seconds: f32) -> Vec<f32> {
        match self {
            Self::At(seconds) => vec![seconds],
            Self::Range([from, to], step) => {
                let step = step.unwrap_or(frame_seconds).max((to - from) / MAX_FRAMES);
                // Rounding should not lose the last.
                let count = ((to - from) / step + 1e-3).floor() as u32;
                (0..=count).map(|frame| (from + step * frame as f32).min(to)).collect()
            }
        }
    }
}

/// The moments that a command shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MomentChoice {
    /// Times; without any, a chosen clip is shown at its first key.
    pub times: Option<Times>,
    /// Name or number of the clip; the first one if none is named.
    pub clip: Option<String>,
}

impl MomentChoice {
    /// Several moments make a film.
    pub(super) fn is_film(&self) -> bool {
        matches!(self.times, Some(Times::Range(..)))
    }

    /// The seconds between the frames of a film of `scene`.
    pub(super) fn step(&self, scene: &Scene) -> f32 {
        match (self.times, &scene.motion) {
            (Some(Times::Range(_, Some(step))), _) => step,
            (_, Some(motion)) => motion.frame_seconds(),
            (_, None) => 0.0,
        }
    }

    /// `scene` at the first chosen moment; as it is where none is chosen.
    pub(super) fn first(&self, scene: Arc<Scene>, token: &CancelToken) -> Result<Arc<Scene>, Failure> {
        match self.of(&scene)?.first() {
            Some(&moment) => {
                let posed = in_pool(|| scene.at(moment, token))?;
                note_lost(&posed, moment.seconds);
                Ok(Arc::new(posed))
            }
            None => Ok(scene),
        }
    }

    /// The moments of `scene`; none where neither time nor clip is chosen.
    pub(super) fn of(&self, scene: &Scene) -> Result<Vec<Moment>, Failure> {
        if *self == Self::default() {
            return Ok(Vec::new());
        }
        let flag = self.times.map_or("--clip", Times::flag);
        let Some(motion) = &scene.motion else {
            return Err(Failure::Failed(format!(
                "{}: the model has no clips of animation, so that it does not move: leave {flag} out",
                scene.source
            )));
        };
        let clip = motion.choose(self.clip.as_deref()).map_err(Failure::Failed)?;
        if let Some(text) = self.times.and_then(|times| times.beyond(&motion.clips[clip])) {
            return Err(Failure::Usage(text));
        }
        let at = |times: Times| times.seconds(motion.frame_seconds());
        let seconds = self.times.map_or_else(|| vec![motion.clips[clip].start], at);
        Ok(seconds.into_iter().map(|seconds| Moment { clip, seconds }).collect())
    }
}

/// Checks that a tree of these settings can follow to a moment by the policy.
pub(super) fn check_follow(follow: Follow, build: &BuildSettings, moments: &MomentChoice) -> Result<(), Failure> {
    if let Some(text) = follow.policy.refusal(build, 0) {
        return Err(Failure::Usage(text));
    }
    if follow != Follow::default() && *moments == MomentChoice::default() {
        return Err(Failure::Usage("--policy: the pose of the file follows nothing: add --time".to_owned()));
    }
    Ok(())
}

/// The moment that a tree is of, as JSON has it.
#[derive(Debug, Serialize)]
pub(super) struct ShownMoment {
    clip: String,
    time_s: f32,
    /// The policy by which the tree follows the model, if it was built at another moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    policy: Option<&'static str>,
}

impl ShownMoment {
    /// `None` of a model in the pose of its file.
    pub(super) fn of(accel: &Accel) -> Option<Self> {
        let Moment { clip, seconds } = accel.scene.moment?;
        let clip = accel.scene.motion.as_ref()?.clips[clip].name.clone();
        let policy = accel.is_followed().then(|| accel.follow.policy.name());
        Some(Self { clip, time_s: seconds, policy })
    }

    /// The moment in words: "0.400 s of clip 'Run', by the policy 'refit'".
    pub(super) fn text(&self) -> String {
        let policy = self.policy.map_or_else(String::new, |policy| format!(", by the policy '{policy}'"));
        format!("{} s of clip {}{policy}", number(self.time_s.into()), quoted(&self.clip))
    }
}

/// Prints how many triangles of a model are lost at a moment to stderr, as the warnings of a model; whether there are any.
pub(super) fn note_lost(scene: &Scene, seconds: f32) -> bool {
    let lost = scene.lost_at_moment();
    if let Some(lost) = lost {
        note(format_args!("bvhscope: {}: at {seconds} s: {lost}", printable(&scene.source.to_string())));
    }
    lost.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_have_both_ends_and_a_step() {
        let seconds = |text: &str| Times::parse_range(text).map(|times| times.seconds(0.04));
        assert_eq!(seconds("0..1:0.25"), Ok(vec![0.0, 0.25, 0.5, 0.75, 1.0]));
        assert_eq!(seconds("0.5..1.2:0.5"), Ok(vec![0.5, 1.0]));
        assert_eq!(seconds("3..3:1"), Ok(vec![3.0]));
        assert_eq!(seconds("0..1").map(|times| times.len()), Ok(26));
        assert_eq!(seconds("0..2:0.1").map(|times| times.len()), Ok(21));
        for wrong in ["", "1", "2..1:1", "0..1:0", "0..1:-1", "0..nan:1", "0..inf:1", "0..1:1e-9", "a..b:1", "0..1:"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
