//! The time of a model that moves: which moment of which clip is shown, and how it goes on while it plays.

use std::sync::Arc;

use crate::scene::{Clip, Moment, Motion};

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

/// The time of a model that moves, to be changed.
pub struct Clock<'a> {
    pub(super) playback: &'a mut Playback,
    /// The wanted moment; `None` for the pose of the file.
    pub(super) moment: &'a mut Option<Moment>,
    pub(super) motion: Arc<Motion>,
}

impl Clock<'_> {
    /// The wanted moment with its clip.
    fn clip(&self) -> Option<(Moment, &Clip)> {
        let moment = self.motion.within((*self.moment)?)?;
        Some((moment, &self.motion.clips[moment.clip]))
    }

    /// Shows the model at the beginning of a clip, or for `None` in the pose of its file.
    pub fn choose_clip(&mut self, clip: Option<usize>) {
        let start = |clip: usize| Some(Moment { clip, seconds: self.motion.clips.get(clip)?.start });
        *self.moment = clip.and_then(start);
        self.playback.playing &= self.moment.is_some();
    }

    /// Shows the model at this time of its clip, of the first one where none is chosen, and stops playing.
    pub fn go_to(&mut self, seconds: f32) {
        let clip = self.moment.map_or(0, |moment| moment.clip);
        *self.moment = self.motion.within(Moment { clip, seconds }).or(*self.moment);
        self.playback.playing = false;
    }

    /// Goes to the next frame, or to the one before, and stops playing. Where clips are looped, the first frame follows the last.
    pub fn step(&mut self, forward: bool) {
        let Some((moment, clip)) = self.clip() else { return self.choose_clip(Some(0)) };
        let (start, end) = (clip.start, clip.end);
        let frame_seconds = self.motion.frame_seconds();
        let frame = (moment.seconds - start) / frame_seconds;
        // The last frame of a clip need not be a whole one.
        let frame = if forward { (frame + 1e-2).floor() + 1.0 } else { (frame - 1e-2).ceil() - 1.0 };
        let seconds = match (forward, self.playback.looped) {
            (true, true) if moment.seconds >= end => start,
            (false, true) if moment.seconds <= start => end,
            _ => start + frame_seconds * frame,
        };
        self.go_to(seconds);
    }

    /// Plays the clip, the first one where none is chosen, or pauses. At the end it plays from the beginning again.
    pub fn toggle_play(&mut self) {
        if self.playback.playing {
            self.playback.playing = false;
            return;
        }
        let at_end = self.clip().is_some_and(|(moment, clip)| moment.seconds >= clip.end);
        if self.moment.is_none() || at_end {
            self.choose_clip(Some(self.moment.map_or(0, |moment| moment.clip)));
        }
        self.playback.playing = self.clip().is_some_and(|(_, clip)| clip.duration() > 0.0);
    }

    /// Goes on playing by `seconds` of the viewer. A clip that is not looped ends at its last key.
    pub fn play(&mut self, seconds: f32) {
        let Playback { playing: true, looped, speed } = *self.playback else { return };
        let Some((moment, clip)) = self.clip().filter(|(_, clip)| clip.duration() > 0.0) else {
            self.playback.playing = false;
            return;
        };
        let mut next = moment.seconds + seconds * speed;
        let ends = next > clip.end;
        if ends {
            next = if looped { clip.start + (next - clip.start).rem_euclid(clip.duration()) } else { clip.end };
        }
        *self.moment = Some(Moment { seconds: next, ..moment });
        self.playback.playing = looped || !ends;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;

    /// The time of the cloth, whose only clip lasts two seconds.
    fn with_clock(test: impl FnOnce(&mut Clock<'_>)) {
        let source = SceneSource::Builtin { name: "cloth".to_owned(), size: Some(8) };
        let scene = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap();
        let motion = scene.motion.unwrap();
        test(&mut Clock { playback: &mut Playback::default(), moment: &mut None, motion });
    }

    fn seconds(clock: &Clock<'_>) -> f32 {
        clock.moment.unwrap().seconds
    }

    #[test]
    fn a_looped_clip_begins_again_and_another_ends() {
        with_clock(|clock| {
            clock.play(1.0);
            assert_eq!(*clock.moment, None, "it does not play");
            clock.toggle_play();
            assert_eq!((*clock.moment, clock.playback.playing), (Some(Moment { clip: 0, seconds: 0.0 }), true));
            clock.play(1.5);
            clock.play(1.0);
            assert!((seconds(clock) - 0.5).abs() < 1e-6 && clock.playback.playing);
            (clock.playback.looped, clock.playback.speed) = (false, 2.0);
            clock.play(0.5);
            assert_eq!((seconds(clock), clock.playback.playing), (1.5, true));
            clock.play(0.5);
            assert_eq!((seconds(clock), clock.playback.playing), (2.0, false));
            clock.toggle_play();
            assert_eq!((seconds(clock), clock.playback.playing), (0.0, true), "from the beginning again");
        });
    }

    #[test]
    fn steps_visit_each_frame_once_both_ways() {
        with_clock(|clock| {
            clock.step(true);
            assert_eq!(seconds(clock), 0.0, "the first one where no clip is chosen");
            let mut visited = Vec::new();
            for frame in 1..=50 {
                clock.step(true);
                assert!((seconds(clock) - frame as f32 * clock.motion.frame_seconds()).abs() < 1e-5);
                visited.push(seconds(clock));
            }
            assert_eq!(seconds(clock), 2.0);
            clock.step(true);
            assert_eq!(seconds(clock), 0.0, "the first follows the last");
            clock.step(false);
            for frame in visited.into_iter().rev() {
                assert!((seconds(clock) - frame).abs() < 1e-5);
                clock.step(false);
            }
            clock.playback.looped = false;
            clock.go_to(0.0);
            clock.step(false);
            assert_eq!(seconds(clock), 0.0);
            clock.go_to(7.0);
            assert_eq!(seconds(clock), 2.0);
        });
    }

    #[test]
    fn clips_that_do_not_exist_are_not_chosen() {
        with_clock(|clock| {
            *clock.moment = Some(Moment { clip: 3, seconds: 1.0 });
            assert!(clock.clip().is_none());
            clock.toggle_play();
            assert!(!clock.playback.playing);
            clock.choose_clip(Some(7));
            assert_eq!(*clock.moment, None);
        });
    }
}
