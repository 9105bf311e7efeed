//! Reading rays in chunks, whatever form they have.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Ray;
use glam::{DVec3, Vec3};

use super::error::RayFileError;
use super::faults::{RayFault, RayFaults};
use super::layout::{self, RayHeader};
use super::native::Native;
use super::npy::{self, Npy};
use super::ray::{CHUNK_RAYS, FileRay, RawRay, Seekable};
use super::text::Text;
use crate::budget::Budget;
use crate::console::{open_input, standard_input};
use crate::scene::from_file;

enum Source<'a> {
    Native(Box<Native<'a>>),
    Npy(Npy<'a>),
    Text(Text<'a>),
}

/// A file of rays under way.
pub struct RayReader<'a> {
    source: Source<'a>,
    header: RayHeader,
    /// That of the file less that of the scene.
    offset: DVec3,
    next: u64,
    faults: RayFaults,
    raw: Vec<RawRay>,
}

impl<'a> RayReader<'a> {
    /// Opens a file, a pipe, or standard input for `-`. `offset` is that of the scene which the rays belong to.
    pub fn open(path: &Path, offset: DVec3, token: &'a CancelToken) -> Result<Self, RayFileError> {
        if path.as_os_str() == "-" {
            return Self::of_stream(Box::new(standard_input(token)), offset);
        }
        let failed = |error: std::io::Error| RayFileError::of_read(&error);
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if metadata.is_dir() {
            return Err(RayFileError::new("is a folder", "name a file of rays in it"));
        }
        if metadata.is_file() {
            return Self::of_file(Box::new(File::open(path).map_err(failed)?), offset);
        }
        Self::of_stream(Box::new(open_input(path, token).map_err(failed)?), offset)
    }

    /// Reads a source of any form.
    pub fn of_file(mut file: Box<dyn Seekable + 'a>, offset: DVec3) -> Result<Self, RayFileError> {
        let start = beginning(&mut file)?;
        file.seek(SeekFrom::Start(0)).map_err(|error| RayFileError::of_read(&error))?;
        if start.starts_with(layout::MAGIC) {
            let (native, header) = Native::open(file)?;
            return Ok(Self::new(Source::Native(Box::new(native)), header, offset));
        }
        Self::plain(&start, Box::new(file), offset)
    }

    /// Reads a source that cannot be read at any place: text, or an array of NumPy.
    pub fn of_stream(mut stream: Box<dyn Read + 'a>, offset: DVec3) -> Result<Self, RayFileError> {
        let start = beginning(&mut stream)?;
        if start.starts_with(layout::MAGIC) {
            let problem = "is a ray file in a pipe, of which the arrays are read side by side";
            return Err(RayFileError::new(problem, "name the file; pipes take text and arrays of NumPy"));
        }
        let source = std::io::Cursor::new(start.clone()).chain(stream);
        Self::plain(&start, Box::new(source), offset)
    }

    /// A form that is read from its beginning to its end.
    fn plain(start: &[u8], source: Box<dyn Read + 'a>, offset: DVec3) -> Result<Self, RayFileError> {
        if start.is_empty() {
            return Err(RayFileError::new("is empty", "write the rays again"));
        }
        if start.starts_with(npy::MAGIC) {
            let (npy, rays) = Npy::open(source)?;
            let header = RayHeader { rays: Some(rays), ..RayHeader::default() };
            return Ok(Self::new(Source::Npy(npy), header, offset));
        }
        Ok(Self::new(Source::Text(Text::new(source)), RayHeader::default(), offset))
    }

    fn new(source: Source<'a>, header: RayHeader, offset: DVec3) -> Self {
        let of_file = header.offset.map_or(DVec3::ZERO, DVec3::from_array);
        // As a point of the file, that of the scene is its origin.
        let offset = DVec3::from_array(std::array::from_fn(|axis| offset[axis] - of_file[axis]));
        Self { source, header, offset, next: 0, faults: RayFaults::default(), raw: Vec::new() }
    }

    /// Everything in the header but the arrays.
    pub fn header(&self) -> &RayHeader {
        &self.header
    }

    /// The rays that were skipped so far.
    pub fn faults(&self) -> &RayFaults {
        &self.faults
    }

    /// Number of rays that were read so far, with those that were skipped.
    pub fn position(&self) -> u64 {
        self.next
    }

    /// Replaces `rays` by the next ones, at most [`CHUNK_RAYS`]. Returns whether the file had any. Reports progress through `token` where
    /// the number of rays is known.
    pub fn read(&mut self, rays: &mut Vec<FileRay>, token: &CancelToken) -> Result<bool, RayFileError> {
        token.check()?;
        rays.clear();
        self.raw.clear();
        let read = match &mut self.source {
            Source::Native(native) => native.read(self.next, CHUNK_RAYS, &mut self.raw),
            Source::Npy(npy) => npy.read(self.next, CHUNK_RAYS, &mut self.raw),
            Source::Text(text) => text.read(CHUNK_RAYS, &mut self.raw),
        };
        // A read that was interrupted has failed, too.
        token.check()?;
        read?;
        for raw in &self.raw {
            let ray = in_scene(raw, self.next, self.offset);
            match RayFault::of(&ray) {
                None => rays.push(ray),
                Some(fault) => self.faults.add(fault, self.next),
            }
            self.next = self.next.saturating_add(1);
        }
        if let Some(all) = self.header.rays.filter(|&all| all > 0) {
            token.set_progress((self.next as f64 / all as f64) as f32);
        }
        Ok(!self.raw.is_empty())
    }
}

/// The first bytes.
fn beginning(source: &mut impl Read) -> Result<Vec<u8>, RayFileError> {
    let mut start = Vec::new();
    let most = layout::MAGIC.len() as u64;
    source.by_ref().take(most).read_to_end(&mut start).map_err(|error| RayFileError::of_read(&error))?;
    Ok(start)
}

/// A ray in the coordinates of the scene.
fn in_scene(raw: &RawRay, index: u64, offset: DVec3) -> FileRay {
    let [x, y, z, t_min, dx, dy, dz, t_max] = raw.numbers;
    let direction = Vec3::new(dx as f32, dy as f32, dz as f32);
    let ray =
        Ray { origin: from_file(DVec3::new(x, y, z), offset), direction, t_min: t_min as f32, t_max: t_max as f32 };
    let RawRay { any, expected_triangle, expected_t, weight, pixel, .. } = *raw;
    FileRay { index, ray, any, weight, expected_triangle, expected_t, pixel }
}

/// All rays of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct RaySet {
    /// The file.
    pub path: PathBuf,
    /// Its header.
    pub header: RayHeader,
    /// Its rays, without those that were skipped.
    pub rays: Vec<FileRay>,
    /// Those that were skipped.
    pub faults: RayFaults,
}

/// Appends `more` to `rays`, within the memory limit.
pub fn append_rays(rays: &mut Vec<FileRay>, more: &[FileRay]) -> Result<(), RayFileError> {
    if rays.len().saturating_add(more.len()) > rays.capacity() {
        let bytes = (rays.capacity() as u64).saturating_mul(2).saturating_mul(size_of::<FileRay>() as u64);
        Budget::of_process().check("the rays", bytes)?;
    }
    rays.extend_from_slice(more);
    Ok(())
}

impl RaySet {
    /// Reads all rays of a file, within the memory limit.
    pub fn read(path: &Path, offset: DVec3, token: &CancelToken) -> Result<Self, RayFileError> {
        let mut reader = RayReader::open(path, offset, token)?;
        let known = reader.header.rays.unwrap_or_default();
        Budget::of_process().check("the rays", known.saturating_mul(size_of::<FileRay>() as u64))?;
        // Headers may lie.
        let mut rays = Vec::with_capacity(known.min(1 << 20) as usize);
        let mut chunk = Vec::new();
        while reader.read(&mut chunk, token)? {
            append_rays(&mut rays, &chunk)?;
        }
        Ok(Self { path: path.to_owned(), header: reader.header, rays, faults: reader.faults })
    }
}
