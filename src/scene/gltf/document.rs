//! A parsed glTF document: the JSON and the buffers that it refers to. Every count, length and index is checked before use.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use super::glb;
use super::json::{JsonError, POLL_INTERVAL_BYTES, parse};
use super::place::place;
use super::schema::{Root, Versioned};
use super::uri::read_uri;
use crate::budget::Budget;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::images::Images;
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Why a part of the model is left out: the kind of fault, which a warning counts, and the first one in detail.
pub(super) struct Fault {
    pub(super) kind: &'static str,
    pub(super) detail: String,
}

impl Fault {
    pub(super) fn new(kind: &'static str, detail: impl Into<String>) -> Self {
        Self { kind, detail: detail.into() }
    }
}

/// The bytes of a buffer, shared by all buffers of the same name, or the reason why they cannot be read.
type Bytes<'a> = Result<Rc<Cow<'a, [u8]>>, String>;

/// A parsed file with its buffers.
pub(super) struct Document<'a> {
    pub(super) root: Root,
    buffers: Vec<Bytes<'a>>,
}

impl<'a> Document<'a> {
    pub(super) fn parse(
        path: &Path,
        bytes: &'a [u8],
        images: &Images,
        warnings: &mut Warnings,
        token: &CancelToken,
    ) -> Result<Self, LoadError> {
        let (text, binary) = if bytes.starts_with(b"glTF") {
            let chunks = glb::chunks(bytes)
                .map_err(|(at, problem, advice)| LoadError::at(path, FileLocation::Byte(at as u64), problem, advice))?;
            let (ignored, first) = chunks.ignored;
            warnings.add_many(ignored, "chunks of the file beyond JSON and binary data ignored", || {
                FileLocation::Byte(first as u64)
            });
            warnings.add_many(chunks.trailing as u64, "bytes after the end of the GLB data ignored", || {
                FileLocation::Byte(bytes.len().saturating_sub(chunks.trailing) as u64)
            });
            (chunks.json.trim_ascii_end(), chunks.binary)
        } else {
            (bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), None)
        };
        // Some exporters pad with zero bytes.
        let end = text.iter().rposition(|&byte| byte != 0).map_or(0, |last| last.saturating_add(1));
        let text = text.get(..end).unwrap_or(text);
        check_json(path, text, token)?;
        let root = parse::<Root>(text, token).map_err(|error| match error {
            JsonError::Cancelled(cancelled) => LoadError::Cancelled(cancelled),
            JsonError::Wrong(location, problem, advice) => {
                // In glTF 1.0 the lists are objects, so the version says more than the first wrong type.
                if let Ok(Versioned { asset }) = parse(text, token)
                    && let Err(error) = super::announced::check_version(path, &asset, &mut Warnings::default())
                {
                    return error;
                }
                LoadError::at(path, location, problem, advice)
            }
        })?;
        super::announced::check_version(path, &root.asset, warnings)?;
        super::announced::check_extensions(path, &root)?;
        let buffers = read_buffers(&root, binary, images, warnings, token)?;
        Ok(Self { root, buffers })
    }

    /// Bytes of all buffers together.
    pub(super) fn bytes(&self) -> usize {
        self.buffers.iter().flatten().fold(0, |sum: usize, bytes| sum.saturating_add(bytes.len()))
    }

    /// The bytes of the buffer view `index`.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], Fault> {
        let view = entry(&self.root.buffer_views, "bufferViews", index)?;
        if view.extensions.meshopt.is_some() {
            let detail = format!("bufferViews[{index}] is compressed; {}", super::advice::UNPACK);
            return Err(Fault::new("data compressed by meshopt", detail));
        }
        let Some(buffer) = view.buffer.map(super::json::Whole::get) else {
            return Err(Fault::new(NO_SUCH_ENTRY, format!("bufferViews[{index}] names no buffer")));
        };
        let bytes = match self.buffers.get(buffer) {
            Some(Ok(bytes)) => bytes,
            Some(Err(reason)) => {
                return Err(Fault::new("a buffer that cannot be read", format!("buffers[{buffer}]: {reason}")));
            }
            None => return Err(Fault::new(NO_SUCH_ENTRY, format!("buffers[{buffer}] does not exist"))),
        };
        let (start, length) = (view.byte_offset.0, view.byte_length.0);
        let end = start.checked_add(length).and_then(|end| usize::try_from(end).ok());
        end.and_then(|end| bytes.get(usize::try_from(start).ok()?..end)).ok_or_else(|| {
            let size = bytes.len();
            let detail =
                format!("bufferViews[{index}] needs {length} bytes from {start}, buffers[{buffer}] has {size}");
            Fault::new(BEYOND_THE_END, detail)
        })
    }
}

/// Kind of a fault: an index out of range.
pub(super) const NO_SUCH_ENTRY: &str = "something named that does not exist";
/// Kind of a fault: too few bytes.
pub(super) const BEYOND_THE_END: &str = "data beyond the end of what holds them";

/// Entry `index` of the top-level list `name`.
pub(super) fn entry<'a, T>(list: &'a [T], name: &str, index: usize) -> Result<&'a T, Fault> {
    list.get(index).ok_or_else(|| {
        // Indices that no list can have are shown as what they are at least.
        Fault::new(NO_SUCH_ENTRY, format!("{name}[{index}] does not exist, there are {}", list.len()))
    })
}

fn read_buffers<'a>(
    root: &Root,
    binary: Option<&'a [u8]>,
    images: &Images,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Vec<Bytes<'a>>, Cancelled> {
    let mut by_name: HashMap<&str, usize> = HashMap::new();
    let mut buffers: Vec<Bytes<'a>> = Vec::with_capacity(root.buffers.len());
    for (index, json) in root.buffers.iter().enumerate() {
        token.check()?;
        let uri = json.uri.as_deref();
        let known = uri.and_then(|uri| by_name.get(uri)).and_then(|&known| buffers.get(known)).cloned();
        let bytes = match (known, uri) {
            (Some(known), _) => known,
            (None, Some(uri)) => {
                by_name.insert(uri, index);
                let named =
                    |reason| if uri.starts_with("data:") { reason } else { format!("{}: {reason}", quoted(uri)) };
                read_uri(uri, images).map(|bytes| Rc::new(Cow::Owned(bytes))).map_err(named)
            }
            (None, None) => {
                let binary = binary.filter(|_| index == 0).map(|bytes| Rc::new(Cow::Borrowed(bytes)));
                binary.ok_or_else(|| "it has neither data nor a uri".to_owned())
            }
        };
        token.check()?;
        let path = || format!("buffers[{index}]");
        match &bytes {
            Ok(bytes) if (bytes.len() as u64) < json.byte_length.0 => {
                let name = uri.filter(|uri| !uri.starts_with("data:")).map(quoted).unwrap_or_default();
                let detail = format!("{} of {} bytes {name}", bytes.len(), json.byte_length.0);
                warnings.add("buffers shorter than declared", || place(path(), detail.trim_end()));
            }
            // The fallback of compressed data is empty on purpose.
            Err(reason) if json.extensions.meshopt.is_none() => {
                warnings.add("buffers left out", || place(path(), reason));
            }
            _ => {}
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Checks the budget for the parsed JSON, whose structs can be far larger than their text.
fn check_json(path: &Path, text: &[u8], token: &CancelToken) -> Result<(), LoadError> {
    // Per object: the largest struct, a material or a node, in a list that doubles as it grows. Per entry: a name in a list.
    const OBJECT: u64 = 1024;
    const ENTRY: u64 = 64;
    let (mut objects, mut entries) = (0_u64, 0_u64);
    for part in text.chunks(POLL_INTERVAL_BYTES) {
        token.check()?;
        // Counts one more than there are.
        let count = |wanted: u8| part.split(|&byte| byte == wanted).count() as u64;
        objects = objects.saturating_add(count(b'{'));
        entries = entries.saturating_add(count(b','));
    }
    let bytes = objects.saturating_mul(OBJECT).saturating_add(entries.saturating_mul(ENTRY));
    let whole = bytes.saturating_add(text.len() as u64);
    Budget::of_process().check("the JSON", whole).map_err(|error| LoadError::over_budget(path, &error))
}
