//! The time of a model that moves: which moment of which clip is shown, and how it goes on while it plays.

use std::sync::Arc;

use crate::app::state::AppState;
use crate::scene::{Clip, Moment, Motion};

/// Seconds from one frame to the next where the user steps from frame to frame: those of `render --frames`.
pub const FRAME_SECONDS: f32 = 0.04;

/// How time goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Playback {
    /// The clip plays.
    pub playing: bool,
    /// After its end it begins again.
    pub looped: bool,
    /// Seconds of the clip in a second.
    pub speed: f32,
}

impl Default for Playback {
    fn default() -> Self {
        Self { playing: false, looped: true, speed: 1.0 }
    }
}

impl Playback {
    /// The speeds that are offered.
    pub const SPEEDS: [f32; 6] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0];
}

impl AppState {
    /// The clips of the loaded model; `None` where it stands still.
    pub fn motion(&self) -> Option<&Arc<Motion>> {
        self.model.loaded.as_ref()?.motion.as_ref()
    }

    /// The wanted moment with its clip; `None` in the pose of the file.
    pub fn clip(&self) -> Option<(Moment, &Clip)> {
        let moment = self.motion()?.within(self.wanted.moment?)?;
        Some((moment, &self.motion()?.clips[moment.clip]))
    }

    /// Shows the model at the beginning of a clip, or for `None` in the pose of its file.
    pub fn choose_clip(&mut self, clip: Option<usize>) {
        let moment = |clip: usize| Some(Moment { clip, seconds: self.motion()?.clips.get(clip)?.start });
        self.wanted.moment = clip.and_then(moment);
        self.model.playback.playing &= self.wanted.moment.is_some();
    }

    /// Shows the model at this time of its clip, of the first one where none is chosen, and stops playing.
    pub fn go_to_time(&mut self, seconds: f32) {
        let clip = self.wanted.moment.map_or(0, |moment| moment.clip);
        let moment = self.motion().and_then(|motion| motion.within(Moment { clip, seconds }));
        self.wanted.moment = moment.or(self.wanted.moment);
        self.model.playback.playing = false;
    }

    /// Goes to the next frame, or to the one before, and stops playing. Where clips are looped, the first frame follows the last.
    pub fn step_frame(&mut self, forward: bool) {
        let Some((moment, clip)) = self.clip() else { return self.choose_clip(Some(0)) };
        let (start, end) = (clip.start, clip.end);
        let frame = (moment.seconds - start) / FRAME_SECONDS;
        // The last frame of a clip need not be a whole one.
        let seconds =
            start + FRAME_SECONDS * if forward { (frame + 1e-2).floor() + 1.0 } else { (frame - 1e-2).ceil() - 1.0 };
        let wraps = self.model.playback.looped;
        let seconds = match (forward, wraps) {
            (true, true) if moment.seconds >= end => start,
            (false, true) if moment.seconds <= start => end,
            _ => seconds,
        };
        self.go_to_time(seconds);
    }

    /// Plays the clip, the first one where none is chosen, or pauses. At the end it plays from the beginning again.
    pub fn toggle_play(&mut self) {
        if self.model.playback.playing {
            self.model.playback.playing = false;
            return;
        }
        let at_end = self.clip().is_some_and(|(moment, clip)| moment.seconds >= clip.end);
        if self.wanted.moment.is_none() || at_end {
            self.choose_clip(Some(self.wanted.moment.map_or(0, |moment| moment.clip)));
        }
        self.model.playback.playing = self.clip().is_some_and(|(_, clip)| clip.duration() > 0.0);
    }

    /// Goes on playing by `seconds` of the viewer. A clip that is not looped ends at its last key.
    pub fn play(&mut self, seconds: f32) {
        let Playback { playing: true, looped, speed } = self.model.playback else { return };
        let Some((moment, clip)) = self.clip().filter(|(_, clip)| clip.duration() > 0.0) else {
            self.model.playback.playing = false;
            return;
        };
        let mut next = moment.seconds + seconds * speed;
        let ends = next > clip.end;
        if ends {
            next = if looped { clip.start + (next - clip.start).rem_euclid(clip.duration()) } else { clip.end };
        }
        self.wanted.moment = Some(Moment { seconds: next, ..moment });
        self.model.playback.playing = looped || !ends;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::{Preferences, Wanted};
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;

    /// The state with the cloth, whose only clip lasts two seconds.
    fn state() -> AppState {
        let source = SceneSource::Builtin { name: "cloth".to_owned(), size: Some(8) };
        let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap();
        let mut state = AppState::new(Wanted::new(source), Preferences::default());
        state.model.loaded = Some(Arc::new(scene));
        state
    }

    fn seconds(state: &AppState) -> f32 {
        state.wanted.moment.unwrap().seconds
    }

    #[test]
    fn a_looped_clip_begins_again_and_another_ends() {
        let mut state = state();
        state.play(1.0);
        assert_eq!(state.wanted.moment, None, "it does not play");
        state.toggle_play();
        assert_eq!((state.wanted.moment, state.model.playback.playing), (Some(Moment { clip: 0, seconds: 0.0 }), true));
        state.play(1.5);
        state.play(1.0);
        assert!((seconds(&state) - 0.5).abs() < 1e-6 && state.model.playback.playing);
        (state.model.playback.looped, state.model.playback.speed) = (false, 2.0);
        state.play(0.5);
        assert_eq!((seconds(&state), state.model.playback.playing), (1.5, true));
        state.play(0.5);
        assert_eq!((seconds(&state), state.model.playback.playing), (2.0, false));
        state.toggle_play();
        assert_eq!((seconds(&state), state.model.playback.playing), (0.0, true), "from the beginning again");
    }

    #[test]
    fn steps_visit_each_frame_once_both_ways() {
        let mut state = state();
        state.step_frame(true);
        assert_eq!(seconds(&state), 0.0, "the first one where no clip is chosen");
        let frames = 50;
        let mut visited = Vec::new();
        for frame in 1..=frames {
            state.step_frame(true);
            assert!((seconds(&state) - frame as f32 * FRAME_SECONDS).abs() < 1e-5);
            visited.push(seconds(&state));
        }
        assert_eq!(seconds(&state), 2.0);
        state.step_frame(true);
        assert_eq!(seconds(&state), 0.0, "the first follows the last");
        state.step_frame(false);
        for frame in visited.into_iter().rev() {
            assert!((seconds(&state) - frame).abs() < 1e-5);
            state.step_frame(false);
        }
        state.model.playback.looped = false;
        state.go_to_time(0.0);
        state.step_frame(false);
        assert_eq!(seconds(&state), 0.0);
        state.go_to_time(7.0);
        assert_eq!(seconds(&state), 2.0);
    }

    #[test]
    fn clips_that_do_not_exist_are_not_chosen() {
        let mut state = state();
        state.wanted.moment = Some(Moment { clip: 3, seconds: 1.0 });
        assert!(state.clip().is_none());
        state.choose_clip(Some(7));
        assert_eq!(state.wanted.moment, None);
        state.model.loaded = None;
        state.toggle_play();
        state.step_frame(true);
        assert!(state.wanted.moment.is_none() && !state.model.playback.playing);
    }
}
