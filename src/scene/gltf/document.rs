//! A parsed glTF document with the bytes of its buffers.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use gltf::accessor::DataType;
use gltf::json::Root;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::announced::{check_extensions, check_version};
use super::cameras::{self, Camera};
use super::glb;
use super::meshopt::{self, MeshoptError};
use super::repair::repair;
use super::table::extension;
use super::transform::local;
use super::uri::{POLL_INTERVAL_BYTES, is_data, read_uri};
use crate::budget::Budget;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::scene::images::Images;
use crate::scene::motion::Local;
use crate::scene::read::ModelFile;
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

/// Kind of a fault: too few bytes.
pub(super) const BEYOND_THE_END: &str = "data beyond the end of what holds them";

/// The bytes of a buffer, shared by all buffers of the same name, or the reason why they cannot be read.
type Bytes<'a> = Result<Rc<Cow<'a, [u8]>>, String>;

/// Tightly packed elements of an accessor: normalised floats, or indices of 32 bits.
pub(super) struct DecodedData {
    pub(super) bytes: Vec<u8>,
    pub(super) component: DataType,
    /// Number of elements.
    pub(super) count: usize,
}

/// Data of accessors by index, or the reason why there are none.
pub(super) type Decoded = HashMap<usize, Result<DecodedData, String>>;

/// A parsed file with its buffers.
pub(super) struct Document<'a> {
    pub(super) gltf: gltf::Document,
    /// Transform of each node into the space of its parent; the crate rounds it to single precision.
    pub(super) locals: Vec<Local>,
    /// The animations as they are in the file: faults in them should not keep a model from being shown.
    pub(super) animations: Value,
    /// The cameras, which the crate would not accept without all their fields.
    pub(super) cameras: Vec<Camera>,
    buffers: Vec<Bytes<'a>>,
    /// Data of buffer views compressed by meshopt.
    unpacked: HashMap<usize, Result<Vec<u8>, String>>,
    /// Data of accessors compressed by Draco, once they are decoded.
    pub(super) decoded: Decoded,
}

impl<'a> Document<'a> {
    pub(super) fn parse(file: &ModelFile<'a>, images: &Images, warnings: &mut Warnings) -> Result<Self, LoadError> {
        let ModelFile { path, bytes, token, .. } = *file;
        let (text, binary) = split(path, bytes, warnings)?;
        check_json(path, text, token)?;
        let mut fields = read_json(path, text, token)?;
        let check = |fields: &Map<String, Value>, warnings: &mut Warnings| {
            check_version(path, fields, warnings).and_then(|()| check_extensions(path, fields))
        };
        repair(path, &mut fields, check, warnings, token)?;
        let animations = fields.remove("animations").unwrap_or_default();
        let cameras = cameras::take(&mut fields);
        let nodes = fields.get("nodes").and_then(Value::as_array);
        let locals = nodes.into_iter().flatten().map(local).collect();
        let root = root(path, fields, token)?;
        let gltf = gltf::Document::from_json_without_validation(root);
        let buffers = read_buffers(&gltf, binary, images, warnings, token)?;
        let (unpacked, decoded) = (HashMap::new(), Decoded::new());
        let mut document = Self { gltf, locals, animations, cameras, buffers, unpacked, decoded };
        document.unpack(token)?;
        Ok(document)
    }

    /// Bytes of all buffers together.
    pub(super) fn bytes(&self) -> usize {
        self.buffers.iter().flatten().fold(0, |sum: usize, bytes| sum.saturating_add(bytes.len()))
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: &gltf::buffer::View) -> Result<&[u8], Fault> {
        let index = view.index();
        if let Some(unpacked) = self.unpacked.get(&index) {
            let damaged = |reason: &String| {
                Fault::new("data compressed by meshopt that cannot be read", format!("bufferViews[{index}]: {reason}"))
            };
            return unpacked.as_deref().map_err(damaged);
        }
        let json = self.gltf.as_json().buffer_views.get(index);
        let start = json.and_then(|view| view.byte_offset).unwrap_or_default().0;
        let length = json.map_or(0, |view| view.byte_length.0);
        self.range(view.buffer().index(), start, length).map_err(|Fault { kind, detail }| {
            let place = if kind == BEYOND_THE_END { format!("bufferViews[{index}] ") } else { String::new() };
            Fault::new(kind, format!("{place}{detail}"))
        })
    }

    /// The `length` bytes of a buffer from `start` on.
    fn range(&self, buffer: usize, start: u64, length: u64) -> Result<&[u8], Fault> {
        let bytes = self.buffers.get(buffer).map_or(Err("does not exist"), |bytes| match bytes {
            Ok(bytes) => Ok(bytes),
            Err(reason) => Err(&reason[..]),
        });
        let bytes = bytes
            .map_err(|reason| Fault::new("a buffer that cannot be read", format!("buffers[{buffer}]: {reason}")))?;
        let end = start.checked_add(length).and_then(|end| usize::try_from(end).ok());
        end.and_then(|end| bytes.get(usize::try_from(start).ok()?..end)).ok_or_else(|| {
            let size = bytes.len();
            Fault::new(BEYOND_THE_END, format!("needs {length} bytes from {start}, buffers[{buffer}] has {size}"))
        })
    }

    /// Decodes the buffer views that meshopt has compressed.
    fn unpack(&mut self, token: &CancelToken) -> Result<(), Cancelled> {
        let mut unpacked = HashMap::new();
        for view in self.gltf.views() {
            token.check()?;
            let Some(packed) = extension::MESHOPT.iter().find_map(|name| view.extension_value(name)) else { continue };
            let number = |name: &str| packed.get(name).and_then(Value::as_u64);
            let size = |name: &str| number(name).and_then(|number| usize::try_from(number).ok()).unwrap_or(usize::MAX);
            let text = |name: &str| packed.get(name).and_then(Value::as_str).unwrap_or_default();
            let layout = [size("count"), size("byteStride")];
            let memory = (layout[0] as u64).saturating_mul(layout[1] as u64);
            let bytes = Budget::of_process().check("compressed data", memory).map_err(|error| error.to_string());
            let bytes = bytes.and_then(|()| {
                let start = number("byteOffset").unwrap_or(0);
                let bytes = self.range(size("buffer"), start, number("byteLength").unwrap_or(0));
                bytes.map_err(|fault| fault.detail)
            });
            let result = match bytes {
                Ok(bytes) => match meshopt::decode(bytes, layout, text("mode"), text("filter"), token) {
                    Ok(bytes) => Ok(bytes),
                    Err(MeshoptError::Cancelled(cancelled)) => return Err(cancelled),
                    Err(MeshoptError::Damaged(reason)) => Err(reason.to_owned()),
                },
                Err(reason) => Err(reason),
            };
            unpacked.insert(view.index(), result);
        }
        self.unpacked = unpacked;
        Ok(())
    }
}

/// The JSON of a file and its binary chunk.
fn split<'a>(path: &Path, bytes: &'a [u8], warnings: &mut Warnings) -> Result<(&'a [u8], Option<&'a [u8]>), LoadError> {
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
    Ok((text.get(..end).unwrap_or(text), binary))
}

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

/// The fields of the outermost object.
fn read_json(path: &Path, text: &[u8], token: &CancelToken) -> Result<Map<String, Value>, LoadError> {
    let reader = BufReader::with_capacity(POLL_INTERVAL_BYTES, CancellableReader { rest: text, token });
    let error = match serde_json::from_reader(reader) {
        Ok(Value::Object(fields)) => return Ok(fields),
        Ok(_) => {
            let problem = "the outermost value is not an object";
            return Err(LoadError::of_file(path, problem, "export the model again"));
        }
        Err(error) => error,
    };
    token.check()?;
    let (line, column) = (error.line() as u64, error.column() as u64);
    let text = error.to_string();
    let text = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text).replace('`', "'");
    let (problem, advice) = if error.is_eof() {
        ("the JSON ends too early".to_owned(), "the file is cut off: copy or download it again")
    } else if text.starts_with("recursion limit") {
        ("lists and objects are nested too deeply".to_owned(), "export the model again")
    } else {
        (format!("is not JSON: {text}"), "export the model again, or correct it with a text editor")
    };
    Err(LoadError::at(path, FileLocation::Column(line, column), problem, advice))
}

/// The types of the crate from repaired JSON, entry by entry so that it can be cancelled.
fn root(path: &Path, mut fields: Map<String, Value>, token: &CancelToken) -> Result<Root, LoadError> {
    let (mut accessors, mut views, mut buffers, mut images) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut nodes, mut meshes, mut skins) = (Vec::new(), Vec::new(), Vec::new());
    let (mut materials, mut textures) = (Vec::new(), Vec::new());
    take(&mut fields, "accessors", &mut accessors, token)
        .and_then(|()| take(&mut fields, "bufferViews", &mut views, token))
        .and_then(|()| take(&mut fields, "buffers", &mut buffers, token))
        .and_then(|()| take(&mut fields, "images", &mut images, token))
        .and_then(|()| take(&mut fields, "nodes", &mut nodes, token))
        .and_then(|()| take(&mut fields, "meshes", &mut meshes, token))
        .and_then(|()| take(&mut fields, "skins", &mut skins, token))
        .and_then(|()| take(&mut fields, "materials", &mut materials, token))
        .and_then(|()| take(&mut fields, "textures", &mut textures, token))
        .and_then(|()| serde_json::from_value::<Root>(Value::Object(fields)))
        .map(|root| Root {
            accessors,
            buffer_views: views,
            buffers,
            images,
            nodes,
            meshes,
            skins,
            materials,
            textures,
            ..root
        })
        .map_err(|error| {
            token.check().map_or_else(LoadError::from, |()| {
                LoadError::of_file(path, format!("is not glTF: {error}"), "export the model again")
            })
        })
}

/// Moves the entries of a list into `list`.
fn take<T: DeserializeOwned>(
    fields: &mut Map<String, Value>,
    name: &str,
    list: &mut Vec<T>,
    token: &CancelToken,
) -> Result<(), serde_json::Error> {
    let Some(Value::Array(entries)) = fields.remove(name) else { return Ok(()) };
    list.reserve(entries.len());
    for entry in entries {
        token.check().map_err(serde::de::Error::custom)?;
        list.push(serde_json::from_value(entry)?);
    }
    Ok(())
}

fn read_buffers<'a>(
    document: &gltf::Document,
    binary: Option<&'a [u8]>,
    images: &Images,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Vec<Bytes<'a>>, Cancelled> {
    let mut by_name: HashMap<&str, usize> = HashMap::new();
    let mut buffers: Vec<Bytes<'a>> = Vec::with_capacity(document.buffers().len());
    for (index, json) in document.as_json().buffers.iter().enumerate() {
        token.check()?;
        let uri = json.uri.as_deref();
        let known = uri.and_then(|uri| by_name.get(uri)).and_then(|&known| buffers.get(known)).cloned();
        let bytes = match (known, uri) {
            (Some(known), _) => known,
            (None, Some(uri)) => {
                by_name.insert(uri, index);
                let named = |reason| if is_data(uri) { reason } else { format!("{}: {reason}", quoted(uri)) };
                read_uri(uri, images).map(|bytes| Rc::new(Cow::Owned(bytes))).map_err(named)
            }
            (None, None) => {
                let binary = binary.filter(|_| index == 0).map(|bytes| Rc::new(Cow::Borrowed(bytes)));
                binary.ok_or_else(|| "it has neither data nor a uri".to_owned())
            }
        };
        token.check()?;
        let path = || format!("buffers[{index}]");
        let is_fallback = || {
            let extensions = json.extensions.as_ref().map(|extensions| &extensions.others);
            extensions.is_some_and(|names| extension::MESHOPT.iter().any(|&name| names.contains_key(name)))
        };
        match &bytes {
            Ok(bytes) if (bytes.len() as u64) < json.byte_length.0 => {
                let name = uri.filter(|uri| !is_data(uri)).map(quoted).unwrap_or_default();
                let detail = format!("{} of {} bytes {name}", bytes.len(), json.byte_length.0);
                warnings.add("buffers shorter than declared", || FileLocation::in_json(path(), detail.trim_end()));
            }
            // The fallback of compressed data is empty on purpose.
            Err(reason) if !is_fallback() => {
                warnings.add("buffers left out", || FileLocation::in_json(path(), reason));
            }
            _ => {}
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Checks the budget for the parsed JSON, which is far larger than its text.
fn check_json(path: &Path, text: &[u8], token: &CancelToken) -> Result<(), LoadError> {
    // Per object: its map of values and the largest struct, a material or a node, in a list that doubles as it grows. Per entry: its
    // value, its name and an index.
    const OBJECT: u64 = 2048;
    const ENTRY: u64 = 128;
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
