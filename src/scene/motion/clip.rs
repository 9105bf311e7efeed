//! A clip of animation.

use serde::Serialize;

/// A clip of animation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Clip {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Time of the first key in seconds.
    pub start: f32,
    /// Time of the last key in seconds, at least that of the first.
    pub end: f32,
}

impl Clip {
    /// Seconds from the first to the last key; may be 0.
    pub fn duration(&self) -> f32 {
        self.end - self.start
    }

    /// Time in seconds of a frame of `count` at equal distances from the first key to the last.
    pub fn at_frame(&self, frame: usize, count: usize) -> f32 {
        let share = frame as f32 / (count.max(2) - 1) as f32;
        (self.start + self.duration() * share).min(self.end)
    }
}
