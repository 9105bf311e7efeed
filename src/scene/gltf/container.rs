//! The parts of a glTF file: its JSON, and the bytes that this refers to. No count or length is believed unchecked.

use std::borrow::Cow;
use std::path::Path;

use serde_json::Value;

use crate::scene::images::Images;
use crate::scene::{LoadError, Place};

/// A parsed file with its buffers; a buffer that cannot be read keeps the reason.
pub(super) struct Document<'a> {
    pub(super) json: Value,
    pub(super) buffers: Vec<Result<Cow<'a, [u8]>, String>>,
}

impl<'a> Document<'a> {
    pub(super) fn parse(path: &Path, bytes: &'a [u8], images: &Images) -> Result<Self, LoadError> {
        let fault = |place, message: String| LoadError::Unusable { path: path.to_path_buf(), place, message };
        let (text, binary) = if bytes.starts_with(b"glTF") {
            chunks(bytes).map_err(|(at, message)| fault(Place::Byte(at as u64), message))?
        } else {
            (bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), None)
        };
        let json: Value = serde_json::from_slice(text)
            .map_err(|error| fault(Place::Line(error.line() as u64), format!("is not valid JSON: {error}")))?;
        let list = json["buffers"].as_array().map(Vec::as_slice).unwrap_or_default();
        let buffers = list
            .iter()
            .enumerate()
            .map(|(index, buffer)| match buffer["uri"].as_str() {
                Some(uri) => read_uri(uri, images).map(Cow::Owned),
                None if index == 0 => {
                    binary.map(Cow::Borrowed).ok_or_else(|| "it has neither data nor a uri".to_owned())
                }
                None => Err("it has no uri".to_owned()),
            })
            .collect();
        Ok(Self { json, buffers })
    }

    /// An entry of a top-level list.
    pub(super) fn entry(&self, list: &str, index: usize) -> Result<&Value, String> {
        self.json[list].get(index).ok_or_else(|| format!("{list}[{index}] does not exist"))
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = self.entry("bufferViews", index)?;
        let buffer = number(view, "buffer").ok_or_else(|| format!("bufferViews[{index}] names no buffer"))?;
        let bytes = match self.buffers.get(buffer) {
            Some(Ok(bytes)) => bytes,
            Some(Err(reason)) => return Err(format!("buffers[{buffer}] cannot be used: {reason}")),
            None => return Err(format!("buffers[{buffer}] does not exist")),
        };
        let start = number(view, "byteOffset").unwrap_or(0);
        let length = number(view, "byteLength").unwrap_or(0);
        let end = start.checked_add(length);
        end.and_then(|end| bytes.get(start..end)).ok_or_else(|| {
            format!("bufferViews[{index}] needs {length} bytes from {start}, buffers[{buffer}] has {}", bytes.len())
        })
    }
}

/// A whole number that fits into memory.
pub(super) fn number(value: &Value, key: &str) -> Option<usize> {
    value[key].as_u64().and_then(|number| usize::try_from(number).ok())
}

/// JSON and binary chunk of a GLB file, or where it is wrong.
#[expect(clippy::type_complexity, reason = "used once")]
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), (usize, String)> {
    let word = |at: usize| -> Result<usize, (usize, String)> {
        let part = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
        part.map(|part| u32::from_le_bytes(*part) as usize).ok_or_else(|| (at, "the file ends too early".to_owned()))
    };
    let version = word(4)?;
    if version != 2 {
        return Err((4, format!("GLB version {version} is not supported, only 2; convert it with gltf-transform")));
    }
    let length = word(8)?;
    if length < 20 || length > bytes.len() {
        return Err((8, format!("the header declares {length} bytes, the file has {}", bytes.len())));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at + 8 <= length {
        let (size, kind) = (word(at)?, word(at + 4)?);
        let end = (at + 8).checked_add(size).filter(|&end| end <= length);
        let Some(data) = end.and_then(|end| bytes.get(at + 8..end)) else {
            return Err((at, format!("the chunk declares {size} bytes, {} follow", length - at - 8)));
        };
        match (kind, json.is_some()) {
            (0x4E4F_534A, false) => json = Some(data),
            (0x4E4F_534A, true) => return Err((at, "there is a second JSON chunk".to_owned())),
            (_, false) => return Err((at, "the first chunk is not JSON".to_owned())),
            (0x004E_4942, true) => binary = binary.or(Some(data)),
            _ => {}
        }
        at += 8 + size;
    }
    json.map(|json| (json, binary)).ok_or_else(|| (12, "there is no JSON chunk".to_owned()))
}

/// The bytes behind a `data:` URI or a file beside the model.
pub(super) fn read_uri(uri: &str, images: &Images) -> Result<Vec<u8>, String> {
    let Some(data) = uri.strip_prefix("data:") else {
        return images.read_beside(&percent_decoded(uri)?);
    };
    match data.split_once(',') {
        Some((kind, text)) if kind.ends_with(";base64") => base64(text),
        Some((_, text)) => percent_decoded(text).map(String::into_bytes),
        None => Err("the data URI has no comma".to_owned()),
    }
}

fn percent_decoded(text: &str) -> Result<String, String> {
    let wrong = || "the URI has a wrong % sequence".to_owned();
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte == b'%' {
            let digits = rest.get(..2).and_then(|digits| std::str::from_utf8(digits).ok()).ok_or_else(wrong)?;
            bytes.push(u8::from_str_radix(digits, 16).map_err(|_| wrong())?);
            rest = &rest[2..];
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).map_err(|_| wrong())
}

fn base64(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for byte in text.bytes().filter(|byte| !byte.is_ascii_whitespace() && *byte != b'=') {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err("the base64 data has a wrong character".to_owned()),
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Ok(bytes)
}
