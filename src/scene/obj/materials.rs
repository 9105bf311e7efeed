//! The materials of an OBJ file: its libraries, each read once, and the one that the next face has.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use super::super::assemble::Assembly;
use super::super::error::FileLocation;
use super::super::images::Images;
use super::super::material::Material;
use super::library;
use super::library_values::{unquoted, without_comment};
use super::statement::Statement;
use crate::text::quoted;

/// A material that was used before it was defined.
struct Undefined {
    material: u32,
    /// Line of its first use.
    line: u64,
}

/// The material that a statement names, which may have a comment after the name or quotes around it.
fn find(by_name: &HashMap<Vec<u8>, u32>, name: &[u8]) -> Option<u32> {
    by_name.get(name).or_else(|| by_name.get(unquoted(without_comment(name)))).copied()
}

/// The materials defined so far and the current one.
pub(super) struct Materials<'a> {
    images: Images<'a>,
    /// Indices of materials by their names' bytes.
    by_name: HashMap<Vec<u8>, u32>,
    /// Names of the libraries met so far.
    names: HashSet<Vec<u8>>,
    /// The files that these name.
    files: HashSet<PathBuf>,
    /// Names that no library has defined when they were used first. Each has a material of its own, which is clay until the end.
    undefined: HashMap<Vec<u8>, Undefined>,
    /// The material of the next face; `None` for the default one.
    current: Option<u32>,
    /// The default material, once a face needed it.
    default: Option<u32>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(images: Images<'a>) -> Self {
        Self {
            images,
            by_name: HashMap::new(),
            names: HashSet::new(),
            files: HashSet::new(),
            undefined: HashMap::new(),
            current: None,
            default: None,
        }
    }

    /// Gives materials that were used before their library was named their definition, and moves what was read with the
    /// materials into `assembly`.
    pub(super) fn finish(self, assembly: &mut Assembly) {
        let mut missing: Vec<(u64, &[u8])> = Vec::new();
        for (name, undefined) in &self.undefined {
            let slot = undefined.material as usize;
            match find(&self.by_name, name).and_then(|index| assembly.materials.get(index as usize)).cloned() {
                Some(material) if slot < assembly.materials.len() => assembly.materials[slot] = material,
                _ => missing.push((undefined.line, name)),
            }
        }
        missing.sort_unstable();
        if let Some((line, first)) = missing.first() {
            let what = format!("materials that no library defines, {} being the first, shown as clay", quoted(first));
            assembly.warnings.add_many(missing.len() as u64, &what, || FileLocation::Line(*line));
        }
        self.images.finish(assembly);
    }

    /// Index of the material of the next face.
    pub(super) fn current(&mut self, assembly: &mut Assembly) -> u32 {
        self.current.or(self.default).unwrap_or_else(|| {
            let index = assembly.materials.len() as u32;
            assembly.materials.push(Material::clay());
            self.default = Some(index);
            index
        })
    }

    /// A statement `usemtl`.
    pub(super) fn choose(&mut self, statement: &Statement<'_>, assembly: &mut Assembly) {
        let name = statement.name();
        if name.is_empty() {
            assembly.warnings.add("statements 'usemtl' without a name", || FileLocation::Line(statement.line));
            return;
        }
        let known = self.undefined.get(name).map(|undefined| undefined.material);
        self.current = find(&self.by_name, name).or(known);
        if self.current.is_none() {
            let material = if self.undefined.len() < library::MAX_MATERIALS {
                assembly.materials.push(Material::clay());
                (assembly.materials.len() as u32).saturating_sub(1)
            } else {
                self.current(assembly)
            };
            self.undefined.insert(name.to_vec(), Undefined { material, line: statement.line });
            self.current = Some(material);
        }
    }

    /// A statement `mtllib`: the name of one library, which may contain spaces, or several names.
    pub(super) fn add_libraries(&mut self, statement: &Statement<'_>, assembly: &mut Assembly) {
        let whole = statement.name();
        if whole.is_empty() {
            assembly.warnings.add("statements 'mtllib' without a name", || FileLocation::Line(statement.line));
            return;
        }
        let bare = unquoted(without_comment(whole));
        let exists = |name: &[u8]| self.images.resolve(&String::from_utf8_lossy(name)).is_ok();
        let whole = if !exists(whole) && exists(bare) { bare } else { whole };
        // Where no file has the name with spaces, its words are names.
        let several = whole.iter().any(u8::is_ascii_whitespace);
        if !several || self.images.resolve(&String::from_utf8_lossy(whole)).is_ok() {
            return self.add_library(whole, statement.line, assembly);
        }
        for name in statement.words().map(unquoted) {
            if self.images.token.is_cancelled() {
                return;
            }
            self.add_library(name, statement.line, assembly);
        }
    }

    /// Reads a library once, by whichever of its names comes first.
    fn add_library(&mut self, name: &[u8], line: u64, assembly: &mut Assembly) {
        if !self.names.insert(name.to_vec()) {
            return;
        }
        let text = String::from_utf8_lossy(name);
        let file = self.images.resolve(&text);
        if file.as_ref().is_ok_and(|file| !self.files.insert(file.clone())) {
            return;
        }
        match file.and_then(|_| self.images.read_relative(&text)) {
            Ok(bytes) => library::read(&bytes, &text, &mut self.images, &mut self.by_name, assembly),
            Err(reason) => {
                let kind = ["libraries ", &format!(" not used: {reason}")];
                assembly.warnings.add_named(kind, name, || FileLocation::Line(line));
            }
        }
    }
}
