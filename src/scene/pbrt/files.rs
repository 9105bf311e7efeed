//! The files of a PBRT scene that are being read: the scene, and those that include one another.

use std::borrow::Cow;
use std::path::Path;

use super::tokens::Tokens;
use crate::scene::error::{LoadError, Warnings};
use crate::scene::gzip::unpacked;
use crate::scene::images::Images;
use crate::scene::read::READ_PROGRESS;
use bvhscope_engine::cancel::CancelToken;

/// Maximum number of files that include one another.
const MAX_DEPTH: usize = 16;
/// Maximum number of files that are included.
const MAX_INCLUDES: usize = 1 << 12;
/// Progress at which the scene has been read.
pub(super) const READ_UNTIL: f32 = 0.8;

/// The files that are being read, the last first.
pub(super) struct Files<'a> {
    path: &'a Path,
    token: &'a CancelToken,
    /// Each with the number of blocks around it where it ends those within it.
    open: Vec<(Tokens<'a>, Option<usize>)>,
    /// Number of files included so far.
    count: usize,
}

impl<'a> Files<'a> {
    pub(super) fn new(path: &'a Path, token: &'a CancelToken) -> Self {
        Self { path, token, open: Vec::new(), count: 0 }
    }

    pub(super) fn open(&mut self, tokens: Tokens<'a>, depth: Option<usize>) {
        if tokens.name.is_none() {
            self.token.set_progress(READ_PROGRESS + (READ_UNTIL - READ_PROGRESS) * tokens.progress());
        }
        self.open.push((tokens, depth));
    }

    pub(super) fn close(&mut self) -> Option<(Tokens<'a>, Option<usize>)> {
        self.open.pop()
    }

    /// Opens a file that the one of `tokens` includes; `None`, with a warning, where it cannot be read.
    pub(super) fn include(
        &mut self,
        name: String,
        images: &Images,
        tokens: &Tokens,
        warnings: &mut Warnings,
    ) -> Result<Option<Tokens<'a>>, LoadError> {
        if self.open.len().saturating_add(1) >= MAX_DEPTH {
            let what = format!("files included {MAX_DEPTH} deep, perhaps in a circle, not read");
            warnings.add(&what, || tokens.place());
            return Ok(None);
        }
        if self.count >= MAX_INCLUDES {
            let problem = format!("more than {MAX_INCLUDES} files are included");
            return Err(tokens.fault(problem, "include each file once"));
        }
        self.count = self.count.saturating_add(1);
        match read_named(&name, images)? {
            Ok(bytes) => Ok(Some(Tokens::new(Cow::Owned(bytes), Some(name), self.path, self.token))),
            Err(reason) => {
                warnings.add_named(["files ", &format!(" not read: {reason}")], &name, || tokens.place());
                Ok(None)
            }
        }
    }
}

/// The bytes of a file that the scene names, unpacked; the inner error states why it cannot be read.
pub(super) fn read_named(name: &str, images: &Images) -> Result<Result<Vec<u8>, String>, LoadError> {
    let bytes = match images.read_relative(name) {
        Ok(bytes) => unpacked(Path::new(name), Cow::Owned(bytes), images.token),
        Err(reason) => {
            images.token.check()?;
            return Ok(Err(reason));
        }
    };
    match bytes {
        Ok(bytes) => Ok(Ok(bytes.into_owned())),
        Err(LoadError::Cancelled(cancelled)) => Err(cancelled.into()),
        Err(error) => Ok(Err(error.to_string())),
    }
}
