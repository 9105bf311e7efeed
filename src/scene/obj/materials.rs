//! The materials of an OBJ file: its libraries, each read once, and the one that the next face has.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use super::super::assemble::Assembly;
use super::super::error::FileLocation;
use super::super::images::Images;
use super::super::material::Material;
use super::library;
use super::statement::Statement;
use crate::text::quoted;

/// The materials defined so far and the current one.
pub(super) struct Materials<'a> {
    images: Images<'a>,
    /// Indices of materials by their names' bytes.
    by_name: HashMap<Vec<u8>, u32>,
    /// Names of the libraries met so far.
    names: HashSet<Vec<u8>>,
    /// The files that these name.
    files: HashSet<PathBuf>,
    /// Names used without a definition.
    undefined: HashSet<Vec<u8>>,
    /// The warning about undefined materials, which names the first of them.
    undefined_warning: String,
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
            undefined: HashSet::new(),
            undefined_warning: String::new(),
            current: None,
            default: None,
        }
    }

    /// Moves what was read with the materials into `assembly`.
    pub(super) fn finish(self, assembly: &mut Assembly) {
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
        self.current = self.by_name.get(name).copied();
        if self.current.is_none() && !self.undefined.contains(name) {
            if self.undefined.is_empty() {
                let name = quoted(name);
                self.undefined_warning =
                    format!("materials that no library defines, {name} being the first, shown as clay");
            }
            self.undefined.insert(name.to_vec());
            assembly.warnings.add(&self.undefined_warning, || FileLocation::Line(statement.line));
        }
    }

    /// A statement `mtllib`: the name of one library, which may contain spaces, or several names.
    pub(super) fn add_libraries(&mut self, statement: &Statement<'_>, assembly: &mut Assembly) {
        let whole = statement.name();
        if whole.is_empty() {
            assembly.warnings.add("statements 'mtllib' without a name", || FileLocation::Line(statement.line));
            return;
        }
        let several = whole.iter().any(u8::is_ascii_whitespace);
        // Where no file has the name with spaces, its words are names.
        if !several || self.images.resolve(&String::from_utf8_lossy(whole)).is_ok() {
            return self.add_library(whole, statement.line, assembly);
        }
        for name in statement.words() {
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
                let what = format!("libraries {} not used: {reason}", quoted(name));
                assembly.warnings.add(&what, || FileLocation::Line(line));
            }
        }
    }
}
