//! Small pictures of models for the start page.

use std::collections::HashMap;
use std::sync::Arc;

use crate::scene::SceneSource;

/// Width and height of a thumbnail in pixels.
pub const THUMBNAIL_SIZE: [u32; 2] = [192, 120];

/// A small picture of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Thumbnail {
    /// sRGB RGBA, row by row from the top left, [`THUMBNAIL_SIZE`] pixels.
    pub rgba: Vec<[u8; 4]>,
}

/// The thumbnails known so far.
#[derive(Debug, Clone, Default)]
pub struct Thumbnails {
    known: HashMap<SceneSource, Arc<Thumbnail>>,
}

impl Thumbnails {
    /// The thumbnail of a model, once it is known.
    pub fn get(&self, source: &SceneSource) -> Option<&Arc<Thumbnail>> {
        self.known.get(source)
    }

    /// Adds or replaces the thumbnail of a model.
    pub fn insert(&mut self, source: SceneSource, thumbnail: Thumbnail) {
        self.known.insert(source, Arc::new(thumbnail));
    }
}
