//! STL loader, binary and text. Normals in the file are ignored: they are often wrong and never smooth.
//!
//! Not based on stl_io 0.11, whose text reader rejects upper case, a bare `solid`, Latin-1 names and any NaN without naming the
//! line, and stops after the first of several solids. Working around that would mean rewriting every line first.

use std::path::Path;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::{FileLocation, LoadError};
use super::read::{READ_PROGRESS, beginning, lines};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Bytes of a triangle in the binary form.
const RECORD: usize = 50;
/// Bytes before the first triangle in the binary form.
const HEADER: usize = 84;
/// Maximum number of bytes of text between two cancellation checks.
const POLL_INTERVAL_BYTES: usize = 1 << 20;

/// Number of triangles that the header of a binary file declares.
fn declared_count(bytes: &[u8]) -> Option<u64> {
    let count: [u8; 4] = bytes.get(80..HEADER)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count)))
}

/// Size in bytes that the header of a binary file implies.
pub(super) fn binary_size(bytes: &[u8]) -> Option<u64> {
    declared_count(bytes)?.checked_mul(RECORD as u64)?.checked_add(HEADER as u64)
}

/// Loads an STL file from memory.
pub(super) fn load(path: &Path, bytes: &[u8], assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    let solid = beginning(bytes).get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid"));
    if solid && binary_size(bytes) != Some(bytes.len() as u64) {
        return load_text(path, bytes, assembly, token);
    }
    let Some(declared) = declared_count(bytes) else {
        let location = FileLocation::Byte(bytes.len() as u64);
        let problem = format!("the file ends in the header of {HEADER} bytes");
        return Err(LoadError::at(path, location, problem, "it may be cut off: export or copy it again"));
    };
    let (records, _) = bytes.get(HEADER..).unwrap_or_default().as_chunks::<RECORD>();
    let missing = declared.saturating_sub(records.len() as u64);
    let message = format!("triangles of {declared} declared missing at the end");
    assembly.warnings.add_many(missing, &message, || FileLocation::Byte(bytes.len() as u64));
    assembly.mesh_count = 1;
    let records = &records[..records.len().min(usize::try_from(declared).unwrap_or(usize::MAX))];
    assembly.reserve(records.len()).map_err(|error| error.in_file(path))?;
    for (index, record) in records.iter().enumerate() {
        if index % 65_536 == 0 {
            token.check()?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * index as f32 / records.len() as f32);
        }
        // The normal, three corners, and two unused bytes.
        let (vectors, _) = record.as_chunks::<12>();
        let corner = |k: usize| {
            Vec3::from_array(bytemuck::pod_read_unaligned::<[[u8; 4]; 3]>(&vectors[k]).map(f32::from_le_bytes))
        };
        let triangle = Triangle { a: corner(1), b: corner(2), c: corner(3) };
        let location = || FileLocation::Byte(index.saturating_mul(RECORD).saturating_add(HEADER) as u64);
        assembly.push(triangle, None, 0, location);
    }
    Ok(())
}

fn load_text(path: &Path, bytes: &[u8], assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    let mut corners = Vec::with_capacity(3);
    let mut is_open = false;
    let (mut done, mut next_poll) = (0_usize, 0);
    for (index, line) in lines(bytes).enumerate() {
        if index % 16_384 == 0 || done >= next_poll {
            token.check()?;
            next_poll = done.saturating_add(POLL_INTERVAL_BYTES);
            // A triangle has seven lines; in an unusual file at least two.
            assembly.reserve(16_384 / 2).map_err(|error| error.in_file(path))?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / bytes.len() as f32);
        }
        done = done.saturating_add(line.len()).saturating_add(1);
        let number = (index as u64).saturating_add(1);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let keyword = words.next().unwrap_or_default();
        if keyword.eq_ignore_ascii_case(b"solid") {
            is_open = true;
            assembly.mesh_count = assembly.mesh_count.saturating_add(1);
        } else if keyword.eq_ignore_ascii_case(b"endsolid") {
            is_open = false;
        } else if keyword.eq_ignore_ascii_case(b"vertex") {
            let mut coordinate = || -> Option<f32> { std::str::from_utf8(words.next()?).ok()?.parse().ok() };
            let (Some(x), Some(y), Some(z)) = (coordinate(), coordinate(), coordinate()) else {
                let location = FileLocation::Line(number);
                return Err(LoadError::at(path, location, "'vertex' needs 3 numbers", "correct the line"));
            };
            corners.push(Vec3::new(x, y, z));
        } else if keyword.eq_ignore_ascii_case(b"endfacet") || keyword.eq_ignore_ascii_case(b"endloop") {
            match corners[..] {
                [] => {}
                [a, b, c] => {
                    assembly.push(Triangle { a, b, c }, None, 0, || FileLocation::Line(number));
                }
                _ => assembly.warnings.add("facets without exactly 3 corners skipped", || FileLocation::Line(number)),
            }
            corners.clear();
        }
    }
    if is_open {
        assembly
            .warnings
            .add("solids without 'endsolid': the file may be cut off", || FileLocation::Byte(bytes.len() as u64));
    }
    Ok(())
}
