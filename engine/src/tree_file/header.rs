//! The two lines of text at the beginning.

use serde_json::{Map, Value};

use super::error::TreeFileError;
use super::layout::{MAGIC, MAX_HEADER, VERSION, VERSION_TWO_LEVELS};
use crate::tree::ContainerKind;

/// Maximum length of the version in the first line.
const MAX_VERSION: usize = 20;

/// Most characters of a builder's name.
const MAX_NAME: usize = 1000;

/// Characters of a value that messages show.
const SHOWN: usize = 40;

/// The header of a tree file: everything beside the arrays.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Most children of a node, 2 to 32. What is written has at least the arity of the tree.
    pub arity: u32,
    /// Number of triangles of the mesh; in two levels those of all meshes, each counted once.
    pub triangles: u32,
    /// Name of the builder.
    pub builder: Option<String>,
    /// Its settings, a text or an object.
    pub settings: Option<Value>,
    /// Wall-clock time of the build in milliseconds.
    pub build_ms: Option<f64>,
    /// All fields that this version does not know.
    pub other: Map<String, Value>,
}

impl Header {
    /// The header of a binary tree over `triangles` triangles, whose builder is not known.
    pub fn new(triangles: usize) -> Self {
        let triangles = u32::try_from(triangles).unwrap_or(u32::MAX);
        Self { arity: 2, triangles, builder: None, settings: None, build_ms: None, other: Map::new() }
    }

    /// The settings as text: as it stands, or an object as JSON.
    pub fn settings_text(&self) -> Option<String> {
        self.settings.as_ref().map(|settings| settings.as_str().map_or_else(|| settings.to_string(), str::to_owned))
    }
}

/// The header with the numbers that only reading needs.
#[derive(Debug)]
pub(super) struct Parsed<'a> {
    pub header: Header,
    pub kind: ContainerKind,
    pub nodes: u32,
    pub indices: u32,
    /// Numbers of trees and instances; `None` in a file of one tree.
    pub levels: Option<LevelCounts>,
    /// Where the arrays begin, by name.
    pub arrays: Map<String, Value>,
    /// Everything after the header.
    pub data: &'a [u8],
}

/// Numbers of what only trees in two levels have.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LevelCounts {
    /// Number of trees: one for each mesh, and the one over the instances.
    pub trees: u32,
    pub instances: u32,
}

/// Splits `bytes` at its first line feed, which must be among the first `most` and one more.
fn line(bytes: &[u8], most: usize) -> Option<(&[u8], &[u8])> {
    let searched = bytes.get(..=most).unwrap_or(bytes);
    let end = searched.iter().position(|&byte| byte == b'\n')?;
    let (line, rest) = bytes.split_at_checked(end)?;
    Some((line, rest.get(1..)?))
}

/// Reads both lines.
pub(super) fn parse(bytes: &[u8]) -> Result<Parsed<'_>, TreeFileError> {
    if bytes.is_empty() {
        return Err(TreeFileError::Empty);
    }
    if bytes.iter().all(|&byte| byte == 0) {
        return Err(TreeFileError::Zeros);
    }
    let rest = bytes.strip_prefix(MAGIC).ok_or(TreeFileError::NotATreeFile)?;
    let (version, rest) = line(rest, MAX_VERSION).ok_or(TreeFileError::NotATreeFile)?;
    if version.ends_with(b"\r") {
        return Err(TreeFileError::TextMode);
    }
    let is_version = |number: u32| version == number.to_string().as_bytes();
    let has_levels = is_version(VERSION_TWO_LEVELS);
    if !has_levels && !is_version(VERSION) {
        return Err(TreeFileError::Version(String::from_utf8_lossy(version).escape_debug().to_string()));
    }
    let (json, data) = line(rest, MAX_HEADER).ok_or(TreeFileError::HeaderEnd)?;
    let mut fields: Map<String, Value> =
        serde_json::from_slice(json).map_err(|error| TreeFileError::HeaderJson(error.to_string()))?;
    let (name, value) = ("container", required(&mut fields, "container")?);
    let kind = ContainerKind::WITH_ORIENTED.into_iter().find(|kind| value.as_str() == Some(kind.name()));
    let kind = kind.ok_or_else(|| wrong(name, &value, "\"box\", \"sphere\", \"dop\" or \"oriented\""))?;
    if has_levels && kind != ContainerKind::Aabb {
        return Err(wrong(name, &value, "\"box\", which trees in two levels have,"));
    }
    let arity = number(&mut fields, "arity", 2..=32, "a whole number from 2 to 32")?;
    let [nodes, indices, triangles] = ["nodes", "indices", "triangles"]
        .map(|name| number(&mut fields, name, 0..=u32::MAX, "a count below 4294967296"));
    let (nodes, indices, triangles) = (nodes?, indices?, triangles?);
    let levels = if has_levels {
        let trees =
            number(&mut fields, "trees", 2..=u32::MAX, "a count from 2 on, meshes and the tree over the instances,")?;
        let instances = number(&mut fields, "instances", 1..=u32::MAX, "a count from 1 on")?;
        Some(LevelCounts { trees, instances })
    } else {
        None
    };
    let arrays = match required(&mut fields, "arrays")? {
        Value::Object(arrays) => arrays,
        other => return Err(wrong("arrays", &other, "an object of names and bytes")),
    };
    let builder = match optional(&mut fields, "builder") {
        None => None,
        Some(Value::String(name)) if name.chars().nth(MAX_NAME).is_none() => Some(name),
        Some(other) => return Err(wrong("builder", &other, "a text of at most 1000 characters")),
    };
    let settings = match optional(&mut fields, "settings") {
        None => None,
        Some(value @ (Value::String(_) | Value::Object(_))) => Some(value),
        Some(other) => return Err(wrong("settings", &other, "a text or an object")),
    };
    let build_ms = match optional(&mut fields, "build_ms") {
        None => None,
        Some(value) => {
            let number = value.as_f64().filter(|ms| ms.is_finite() && *ms >= 0.0);
            Some(number.ok_or_else(|| wrong("build_ms", &value, "a number from 0 on"))?)
        }
    };
    let header = Header { arity, triangles, builder, settings, build_ms, other: fields };
    Ok(Parsed { header, kind, nodes, indices, levels, arrays, data })
}

/// Takes a field; null is as good as none.
fn optional(fields: &mut Map<String, Value>, name: &'static str) -> Option<Value> {
    fields.remove(name).filter(|value| !value.is_null())
}

fn required(fields: &mut Map<String, Value>, name: &'static str) -> Result<Value, TreeFileError> {
    fields.remove(name).ok_or(TreeFileError::NoField(name))
}

fn number(
    fields: &mut Map<String, Value>,
    name: &'static str,
    range: std::ops::RangeInclusive<u32>,
    expected: &'static str,
) -> Result<u32, TreeFileError> {
    let value = required(fields, name)?;
    let number = value.as_u64().and_then(|number| u32::try_from(number).ok()).filter(|number| range.contains(number));
    number.ok_or_else(|| wrong(name, &value, expected))
}

fn wrong(field: &'static str, found: &Value, expected: &'static str) -> TreeFileError {
    TreeFileError::Field { field, found: shown(found), expected }
}

/// A value of the header as messages show it.
pub(super) fn shown(value: &Value) -> String {
    match value {
        // Cut within its quotes.
        Value::String(text) => Value::from(cut(text)).to_string(),
        other => cut(&other.to_string()),
    }
}

/// The first [`SHOWN`] characters, and an ellipsis where there are more.
fn cut(text: &str) -> String {
    let mut characters = text.chars();
    let kept: String = characters.by_ref().take(SHOWN).collect();
    if characters.next().is_some() { format!("{kept}…") } else { kept }
}
