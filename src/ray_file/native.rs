//! Reading the format of `docs/ray-file.md`.

use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};

use serde_json::{Map, Value};

use super::error::RayFileError;
use super::layout::{ARRAYS, MAGIC, MAX_HEADER, RayHeader, VERSION};
use super::ray::{RawRay, Seekable};

/// Maximum length of the version in the first line.
const MAX_VERSION: u64 = 20;

const CORRECT_HEADER: &str = "correct the header; docs/ray-file.md lists its fields";
const CUT_OFF: &str = "the file may be cut off; otherwise correct 'rays' or 'arrays' in the header";

/// A file of this format under way.
pub(super) struct Native<'a> {
    file: BufReader<Box<dyn Seekable + 'a>>,
    rays: u64,
    /// Where each array of [`ARRAYS`] begins in the file.
    begins: [Option<u64>; ARRAYS.len()],
    /// Bytes of each array, of the rays that are being read.
    bytes: [Vec<u8>; ARRAYS.len()],
}

impl<'a> Native<'a> {
    /// Reads the header of a file from its beginning.
    pub(super) fn open(file: Box<dyn Seekable + 'a>) -> Result<(Self, RayHeader), RayFileError> {
        let mut file = BufReader::new(file);
        let most = MAX_VERSION.saturating_add(MAGIC.len() as u64);
        let first = line(&mut file, most)?;
        let version = first.as_deref().and_then(|line| line.strip_prefix(MAGIC)).unwrap_or_default();
        if version.ends_with(b"\r") {
            let problem = "was written in text mode: the first line ends in CR LF";
            return Err(RayFileError::new(problem, "open it in binary mode (\"wb\")"));
        }
        if version != VERSION.to_string().as_bytes() {
            let version = String::from_utf8_lossy(version).escape_debug().to_string();
            let problem = format!("is a ray file of version '{version}', not {VERSION}");
            return Err(RayFileError::new(problem, "take a newer bvhscope, or write version 1"));
        }
        let Some(json) = line(&mut file, MAX_HEADER)? else {
            let problem = format!("the header, its second line, does not end within {MAX_HEADER} bytes");
            return Err(RayFileError::new(problem, "end the header with a line feed, and write it in one line"));
        };
        let fields: Map<String, Value> = serde_json::from_slice(&json)
            .map_err(|error| header_fault(format!("the header, its second line, is no JSON object: {error}")))?;
        let arrays = fields.get("arrays").and_then(Value::as_object).cloned();
        let arrays = arrays.ok_or_else(|| header_fault("the header has no object 'arrays'"))?;
        let header: RayHeader = serde_json::from_value(Value::Object(fields))
            .map_err(|error| header_fault(format!("the header is wrong: {error}")))?;
        let rays = header.rays.ok_or_else(|| header_fault("the header has no 'rays', the number of rays"))?;
        if header.offset.is_some_and(|offset| offset.iter().any(|number| !number.is_finite())) {
            return Err(header_fault("the header has an 'offset' that is not finite"));
        }
        let start = file.stream_position().map_err(|error| RayFileError::of_read(&error))?;
        let end = file.seek(SeekFrom::End(0)).map_err(|error| RayFileError::of_read(&error))?;
        let begins = begins(&arrays, rays, end.saturating_sub(start))?;
        let begins = begins.map(|begin| begin.map(|begin| begin.saturating_add(start)));
        Ok((Self { file, rays, begins, bytes: std::array::from_fn(|_| Vec::new()) }, header))
    }

    /// Appends at most `most` rays from number `first` on.
    pub(super) fn read(&mut self, first: u64, most: usize, rays: &mut Vec<RawRay>) -> Result<(), RayFileError> {
        let count = self.rays.saturating_sub(first).min(most as u64);
        for (((_, row), begin), bytes) in ARRAYS.iter().zip(self.begins).zip(&mut self.bytes) {
            let Some(begin) = begin else { continue };
            // Within the file, whose length has been compared.
            bytes.resize(count.saturating_mul(*row) as usize, 0);
            let at = begin.saturating_add(first.saturating_mul(*row));
            let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(bytes));
            read.map_err(|error| RayFileError::of_read(&error))?;
        }
        rays.extend((0..count as usize).map(|at| self.ray(at)));
        Ok(())
    }

    /// The ray in row `at` of what has been read.
    fn ray(&self, at: usize) -> RawRay {
        let words = |array: usize| -> Option<&[u8]> {
            self.begins[array]?;
            let row = ARRAYS[array].1 as usize;
            self.bytes[array].chunks_exact(row).nth(at)
        };
        let word =
            |array: usize, place: usize| -> Option<[u8; 4]> { words(array)?.as_chunks::<4>().0.get(place).copied() };
        let number = |place: usize| word(0, place).map_or(f64::NAN, |word| f64::from(f32::from_le_bytes(word)));
        RawRay {
            numbers: std::array::from_fn(number),
            any: words(1).is_some_and(|flag| flag != [0]),
            expected_triangle: word(2, 0).map(u32::from_le_bytes),
            expected_t: word(3, 0).map(f32::from_le_bytes),
            weight: word(4, 0).map_or(1.0, f32::from_le_bytes),
            pixel: word(5, 0).zip(word(5, 1)).map(|(x, y)| [x, y].map(u32::from_le_bytes)),
        }
    }
}

/// A line without its end; `None` where there is none within `most` bytes.
fn line(file: &mut BufReader<Box<dyn Seekable + '_>>, most: u64) -> Result<Option<Vec<u8>>, RayFileError> {
    let mut line = Vec::new();
    let most = most.saturating_add(1);
    file.by_ref().take(most).read_until(b'\n', &mut line).map_err(|error| RayFileError::of_read(&error))?;
    Ok((line.pop() == Some(b'\n')).then_some(line))
}

fn header_fault(problem: impl Into<String>) -> RayFileError {
    RayFileError::new(problem, CORRECT_HEADER)
}

/// Where the arrays of so many rays begin in data of `length` bytes.
fn begins(arrays: &Map<String, Value>, rays: u64, length: u64) -> Result<[Option<u64>; ARRAYS.len()], RayFileError> {
    let mut begins = [None; ARRAYS.len()];
    let mut spans = Vec::new();
    for ((name, row), begin) in ARRAYS.into_iter().zip(&mut begins) {
        let Some(value) = arrays.get(name).filter(|value| !value.is_null()) else { continue };
        let at = value.as_u64().ok_or_else(|| {
            header_fault(format!("'arrays' in the header has no whole number as '{name}', where that array begins"))
        })?;
        let end = rays.checked_mul(row).and_then(|bytes| bytes.checked_add(at));
        let Some(end) = end.filter(|&end| end <= length) else {
            let problem = format!("array '{name}' of {rays} rays begins at byte {at} of the data, which has {length}");
            return Err(RayFileError::new(problem, CUT_OFF));
        };
        *begin = Some(at);
        spans.push((at, end, name));
    }
    if begins[0].is_none() {
        return Err(header_fault("'arrays' in the header has no 'rays'"));
    }
    spans.sort_unstable();
    for pair in spans.windows(2) {
        if let [(_, end, first), (begin, _, second)] = pair
            && begin < end
        {
            let problem =
                format!("array '{first}' ends at byte {end} of the data, '{second}' begins at {begin}: they overlap");
            return Err(RayFileError::new(problem, CUT_OFF));
        }
    }
    Ok(begins)
}
