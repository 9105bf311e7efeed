//! A parsed glTF document: the JSON and the buffers that it refers to. Every count, length and index is checked before use.

use std::borrow::Cow;
use std::io::{BufReader, Read};
use std::path::Path;

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::Glb;
use gltf::binary::Error as GlbError;
use gltf::json::Root;

use crate::budget::Budget;
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::images::Images;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A parsed file with its buffers; an unreadable buffer holds the reason.
pub(crate) struct Document<'a> {
    pub(crate) parsed: gltf::Document,
    pub(crate) buffers: Vec<Result<Cow<'a, [u8]>, String>>,
}

impl<'a> Document<'a> {
    pub(crate) fn parse(path: &Path, bytes: &'a [u8], images: &Images, token: &CancelToken) -> Result<Self, LoadError> {
        let fault = |location, problem: String| LoadError::at(path, location, problem, "export the model again");
        let (text, binary) = if bytes.starts_with(b"glTF") {
            chunks(bytes).map_err(|(at, message)| fault(FileLocation::Byte(at as u64), message))?
        } else {
            (Cow::Borrowed(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)), None)
        };
        check_json(path, &text, token)?;
        let root =
            Root::from_reader(BufReader::with_capacity(POLL_INTERVAL_BYTES, CancellableReader { rest: &text, token }))
                .map_err(|error| {
                    if token.is_cancelled() {
                        return LoadError::Cancelled(Cancelled);
                    }
                    fault(
                        FileLocation::Column(error.line() as u64, error.column() as u64),
                        format!("is not glTF 2.0: {error}"),
                    )
                })?;
        let mut binary = binary;
        let buffers = root
            .buffers
            .iter()
            .enumerate()
            .map(|(index, buffer)| match &buffer.uri {
                _ if token.is_cancelled() => Err(Cancelled.to_string()),
                Some(uri) if uri.starts_with("data:") => read_uri(uri, images).map(Cow::Owned),
                Some(uri) => read_uri(uri, images).map(Cow::Owned).map_err(|reason| {
                    let name: String = uri.chars().take(200).collect();
                    format!("'{}': {reason}", name.escape_debug())
                }),
                None if index == 0 => binary.take().ok_or_else(|| "it has neither data nor a uri".to_owned()),
                None => Err("it has no uri".to_owned()),
            })
            .collect();
        token.check()?;
        Ok(Self { parsed: gltf::Document::from_json_without_validation(root), buffers })
    }

    pub(crate) fn root(&self) -> &Root {
        self.parsed.as_json()
    }

    /// The bytes of the buffer view `index`.
    pub(crate) fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = entry(&self.root().buffer_views, "bufferViews", index)?;
        let buffer = view.buffer.value();
        let bytes = match self.buffers.get(buffer) {
            Some(Ok(bytes)) => bytes,
            Some(Err(reason)) => return Err(format!("buffers[{buffer}] cannot be used: {reason}")),
            None => return Err(format!("buffers[{buffer}] does not exist")),
        };
        let (start, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let end = start.checked_add(length).and_then(|end| usize::try_from(end).ok());
        end.and_then(|end| bytes.get(usize::try_from(start).ok()?..end)).ok_or_else(|| {
            format!("bufferViews[{index}] needs {length} bytes from {start}, buffers[{buffer}] has {}", bytes.len())
        })
    }
}

/// Entry `index` of the top-level list `name`.
pub(crate) fn entry<'a, T>(list: &'a [T], name: &str, index: usize) -> Result<&'a T, String> {
    list.get(index).ok_or_else(|| format!("{name}[{index}] does not exist"))
}

/// Checks the budget for the parsed JSON, whose structs can be far larger than their text.
fn check_json(path: &Path, text: &[u8], token: &CancelToken) -> Result<(), LoadError> {
    // Per object: the largest struct, a material or a node, in a list that doubles as it grows. Per entry: a value in a list
    // of an unknown extension.
    const OBJECT: u64 = 1024;
    const ENTRY: u64 = 2 * size_of::<serde_json::Value>() as u64;
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

/// Bytes between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 18;

/// A reader over a byte slice that fails once its token is cancelled.
struct CancellableReader<'a> {
    rest: &'a [u8],
    token: &'a CancelToken,
}

impl Read for CancellableReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.token.check().map_err(std::io::Error::other)?;
        self.rest.read(buffer)
    }
}

type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

/// The JSON and binary chunks of a GLB file, or the byte offset and message of an error. Lengths are checked here because the
/// crate subtracts from the declared length unchecked.
fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, (usize, String)> {
    let word = |at: usize| {
        let part = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
        part.map(|part| u32::from_le_bytes(*part) as usize).ok_or_else(|| (at, "the file ends too early".to_owned()))
    };
    let version = word(4)?;
    if version != 2 {
        return Err((4, format!("GLB version {version} is not supported, only 2; convert it with gltf-transform")));
    }
    let length = word(8)?;
    let Some(whole) = bytes.get(..length).filter(|whole| whole.len() >= 20) else {
        return Err((8, format!("the header declares {length} bytes, the file has {}", bytes.len())));
    };
    match Glb::from_slice(whole) {
        Ok(glb) => Ok((glb.json, glb.bin)),
        Err(gltf::Error::Binary(error)) => Err(explain(&error, word(12).unwrap_or(0))),
        Err(error) => Err((12, error.to_string())),
    }
}

/// The byte offset and message of a chunk error; the JSON chunk declares `json_length` bytes.
fn explain(error: &GlbError, json_length: usize) -> (usize, String) {
    let second = json_length.saturating_add(20);
    match error {
        GlbError::ChunkLength { ty: gltf::binary::ChunkType::Json, length, length_read } => {
            (12, format!("the JSON chunk declares {length} bytes, {length_read} follow"))
        }
        GlbError::ChunkLength { length, length_read, .. } => {
            (second, format!("the binary chunk declares {length} bytes, {length_read} follow"))
        }
        GlbError::ChunkType(gltf::binary::ChunkType::Bin) => (12, "the first chunk is not JSON".to_owned()),
        GlbError::ChunkType(gltf::binary::ChunkType::Json) => (second, "there is a second JSON chunk".to_owned()),
        GlbError::UnknownChunkType(name) => {
            (12, format!("there is an unknown chunk '{}'", String::from_utf8_lossy(name).escape_debug()))
        }
        error => (12, format!("the chunks are damaged: {error}")),
    }
}

/// The bytes of a `data:` URI, or of a file relative to the model.
pub(crate) fn read_uri(uri: &str, images: &Images) -> Result<Vec<u8>, String> {
    let Some(data) = uri.strip_prefix("data:") else {
        let name =
            String::from_utf8(percent_decoded(uri, images.token)?).map_err(|_| "the URI is not UTF-8".to_owned())?;
        return images.read_relative(&name);
    };
    match data.split_once(',') {
        Some((kind, text)) if kind.ends_with(";base64") => base64(text, images.token),
        Some((_, text)) => percent_decoded(text, images.token),
        None => Err("the data URI has no comma".to_owned()),
    }
}

fn percent_decoded(text: &str, token: &CancelToken) -> Result<Vec<u8>, String> {
    let wrong = || "the URI has a wrong % sequence".to_owned();
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if bytes.len().is_multiple_of(POLL_INTERVAL_BYTES) {
            token.check().map_err(|cancelled| cancelled.to_string())?;
        }
        if byte == b'%' {
            let digits = rest.get(..2).and_then(|digits| std::str::from_utf8(digits).ok()).ok_or_else(wrong)?;
            bytes.push(u8::from_str_radix(digits, 16).map_err(|_| wrong())?);
            rest = &rest[2..];
        } else {
            bytes.push(byte);
        }
    }
    Ok(bytes)
}

/// Decodes base64 with or without padding and line breaks, in the standard and the URL alphabet, since exporters differ.
fn base64(text: &str, token: &CancelToken) -> Result<Vec<u8>, String> {
    const ANY: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true),
    );
    // The text without line breaks and the decoded bytes exist at the same time.
    let size = (text.len() as u64 / 4).saturating_mul(7);
    Budget::of_process().check("the bytes of a data URI", size).map_err(|error| error.to_string())?;
    let standard = |byte| match byte {
        b'-' => b'+',
        b'_' => b'/',
        byte => byte,
    };
    let mut digits = Vec::with_capacity(text.len());
    for part in text.as_bytes().chunks(POLL_INTERVAL_BYTES) {
        token.check().map_err(|cancelled| cancelled.to_string())?;
        digits.extend(part.iter().filter(|byte| !byte.is_ascii_whitespace()).map(|&byte| standard(byte)));
    }
    // Four digits are three bytes, so chunks of a multiple of four digits decode independently.
    let mut bytes = Vec::with_capacity(digits.len().div_ceil(4).saturating_mul(3));
    for part in digits.chunks(POLL_INTERVAL_BYTES) {
        token.check().map_err(|cancelled| cancelled.to_string())?;
        ANY.decode_vec(part, &mut bytes).map_err(|error| format!("the base64 data is damaged: {error}"))?;
    }
    Ok(bytes)
}
