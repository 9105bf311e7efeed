//! The statements of a PBRT scene, which change a state, and the shapes that take it over.

use std::collections::HashMap;

use glam::{DMat4, DVec3, Vec3};

use super::files::Files;
use super::parameters::{Parameters, values};
use super::placed::{Item, Placed};
use super::surface::{Surfaces, color};
use super::tokens::{CORRECT, Tokens};
use super::{shapes, view};
use crate::budget::{Budget, OverBudget};
use crate::scene::assemble::Assembly;
use crate::scene::error::LoadError;
use crate::scene::images::Images;
use crate::scene::read::ModelFile;
use crate::text::quoted;

/// Maximum number of blocks within one another.
const MAX_BLOCKS: usize = 1 << 12;
/// Bytes of shapes between two checks of the memory budget.
const MEMORY_INTERVAL: u64 = 1 << 22;
/// Bytes of an entry of one of the lists, about.
const BYTES_PER_ENTRY: u64 = 256;

/// Statements whose parameters do not change what is shown.
const WITHOUT_EFFECT: [&[u8]; 5] = [b"Accelerator", b"Integrator", b"MakeNamedMedium", b"PixelFilter", b"Sampler"];

/// The surface of the shapes that follow.
#[derive(Clone, Copy)]
enum Surface {
    /// The one of shapes before any material, added when the first of them is read.
    Default,
    /// An index into the materials.
    Material(u32),
    /// Shapes are left out.
    None,
}

impl From<Option<u32>> for Surface {
    fn from(material: Option<u32>) -> Self {
        material.map_or(Self::None, Self::Material)
    }
}

/// The values that a block restores at its end.
#[derive(Clone)]
struct State {
    transform: DMat4,
    is_reversed: bool,
    surface: Surface,
    /// The light that shapes emit.
    emission: Vec3,
    /// Transforms are those at the start of a motion; those at its end are not read.
    is_start: bool,
}

/// The kind of a block.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Block {
    Attribute,
    Transform,
    Object,
    /// The contents of a file that is imported.
    Import,
}

pub(super) struct Reader<'a, 'b> {
    pub(super) assembly: &'b mut Assembly,
    pub(super) surfaces: Surfaces<'a>,
    pub(super) placed: Placed,
    pub(super) film: view::Film,
    state: State,
    blocks: Vec<(Block, State)>,
    systems: HashMap<String, DMat4>,
    objects: HashMap<String, usize>,
    /// The object whose shapes are read.
    object: Option<usize>,
    /// Number of objects that have begun within it.
    inner_objects: u32,
    pub(super) files: Files<'a>,
    /// Bytes of what was read, and those at which memory is checked next.
    memory: [u64; 2],
    /// The warning about statements that are not understood, which names the first of them.
    not_understood: Option<String>,
}

impl<'a, 'b> Reader<'a, 'b> {
    pub(super) fn new(file: &ModelFile<'a>, assembly: &'b mut Assembly) -> Self {
        let state = State {
            transform: DMat4::IDENTITY,
            is_reversed: false,
            surface: Surface::Default,
            emission: Vec3::ZERO,
            is_start: true,
        };
        Self {
            assembly,
            files: Files::new(file.path, file.token),
            surfaces: Surfaces::new(Images::new(file)),
            placed: Placed::default(),
            film: view::Film::default(),
            state,
            blocks: Vec::new(),
            systems: HashMap::new(),
            objects: HashMap::new(),
            object: None,
            inner_objects: 0,
            memory: [0, MEMORY_INTERVAL],
            not_understood: None,
        }
    }

    /// Reads a scene and the files that it includes.
    pub(super) fn read(&mut self, tokens: Tokens<'a>) -> Result<(), LoadError> {
        self.files.open(tokens, None);
        while let Some((mut tokens, depth)) = self.files.close() {
            if tokens.peek()?.is_some() {
                let included = self.statement(&mut tokens)?;
                self.files.open(tokens, depth);
                if let Some((tokens, is_import)) = included {
                    let depth = is_import.then_some(self.blocks.len());
                    if is_import {
                        self.begin(Block::Import, &tokens)?;
                    }
                    self.files.open(tokens, depth);
                }
                continue;
            }
            // A file that is imported ends its blocks, and so does the scene.
            let depth = if tokens.name.is_none() { Some(0) } else { depth };
            while let Some(depth) = depth
                && self.blocks.len() > depth
            {
                if self.blocks.last().is_some_and(|block| block.0 != Block::Import) {
                    self.warn("blocks without an end", &tokens);
                }
                if self.blocks.last().is_some_and(|block| block.0 == Block::Object) {
                    (self.object, self.inner_objects) = (None, 0);
                }
                self.restore();
            }
        }
        Ok(())
    }

    /// Reads a statement; returns the file that it includes, and whether it is imported.
    #[expect(clippy::too_many_lines, reason = "a table of statements")]
    fn statement(&mut self, tokens: &mut Tokens<'a>) -> Result<Option<(Tokens<'a>, bool)>, LoadError> {
        let word = tokens.word()?.to_vec();
        match &word[..] {
            b"Shape" => self.shape(tokens)?,
            b"AttributeBegin" => self.begin(Block::Attribute, tokens)?,
            b"AttributeEnd" => {
                self.end(Block::Attribute, tokens);
            }
            b"TransformBegin" => self.begin(Block::Transform, tokens)?,
            b"TransformEnd" => {
                self.end(Block::Transform, tokens);
            }
            b"ObjectBegin" => self.begin_object(tokens)?,
            b"ObjectEnd" => self.end_object(tokens),
            b"ObjectInstance" => self.instance(tokens)?,
            b"ReverseOrientation" => self.state.is_reversed = !self.state.is_reversed,
            b"WorldBegin" => {
                self.state.transform = DMat4::IDENTITY;
                self.systems.insert("world".to_owned(), DMat4::IDENTITY);
            }
            b"WorldEnd" => {}
            b"Include" | b"Import" => {
                let name = tokens.text()?;
                let opened = self.files.include(name, &self.surfaces.images, tokens, &mut self.assembly.warnings)?;
                return Ok(opened.map(|opened| (opened, &word[..] == b"Import")));
            }
            b"Material" | b"MakeNamedMaterial" | b"NamedMaterial" | b"Texture" | b"AreaLightSource" => {
                self.look(&word, tokens)?;
            }
            b"Camera" | b"Film" => {
                let class = tokens.text()?;
                let place = tokens.place();
                let parameters = Parameters::read(tokens)?;
                if word == b"Camera" {
                    let transform = self.state.transform;
                    self.systems.insert("camera".to_owned(), transform.inverse());
                    self.film.add_camera(&class, &parameters, transform, place, &mut self.assembly.warnings);
                } else {
                    self.film.add_film(&parameters);
                }
            }
            b"LightSource" => self.pass("lights not used", tokens)?,
            b"Attribute" => self.pass("statements 'Attribute' not used", tokens)?,
            b"MediumInterface" => {
                while tokens.peek()? == Some(b'"') {
                    tokens.text()?;
                }
            }
            b"ColorSpace" => {
                if tokens.text()? != "srgb" {
                    self.warn("colours of another space read as those of sRGB", tokens);
                }
            }
            b"Option" => {
                tokens.text()?;
                values(tokens)?;
            }
            word if WITHOUT_EFFECT.contains(&word) => {
                tokens.text()?;
                Parameters::read(tokens)?;
            }
            word => {
                if !self.transform(word, tokens)? {
                    self.pass_unknown(word, tokens)?;
                }
            }
        }
        Ok(None)
    }

    /// A statement that changes the transform; returns whether it is one.
    fn transform(&mut self, word: &[u8], tokens: &mut Tokens) -> Result<bool, LoadError> {
        let before = self.state.transform;
        let after = match word {
            b"Identity" => DMat4::IDENTITY,
            b"Translate" => before * DMat4::from_translation(DVec3::from_array(tokens.numbers()?)),
            b"Scale" => before * DMat4::from_scale(DVec3::from_array(tokens.numbers()?)),
            b"Rotate" => {
                let [degrees, x, y, z] = tokens.numbers()?;
                if let Some(axis) = DVec3::new(x, y, z).try_normalize() {
                    before * DMat4::from_axis_angle(axis, degrees.to_radians())
                } else {
                    self.warn("rotations without an axis left out", tokens);
                    before
                }
            }
            b"Transform" => DMat4::from_cols_array(&tokens.numbers()?),
            b"ConcatTransform" => before * DMat4::from_cols_array(&tokens.numbers()?),
            b"LookAt" => {
                let after = self.film.look_at(tokens.numbers()?, before);
                if after.is_none() {
                    self.warn("views without a direction left out", tokens);
                }
                after.unwrap_or(before)
            }
            b"CoordinateSystem" => {
                let name = tokens.text()?;
                self.charge(BYTES_PER_ENTRY, tokens)?;
                self.systems.insert(name, before);
                before
            }
            b"CoordSysTransform" => {
                let name = tokens.text()?;
                self.systems.get(&name).copied().unwrap_or_else(|| {
                    let kind = ["uses of the coordinate system ", " without a definition passed over"];
                    self.assembly.warnings.add_named(kind, &name, || tokens.place());
                    before
                })
            }
            b"ActiveTransform" => {
                self.state.is_start = tokens.word()? != b"EndTime";
                before
            }
            b"TransformTimes" => {
                let _: [f64; 2] = tokens.numbers()?;
                before
            }
            _ => return Ok(false),
        };
        if self.state.is_start {
            self.state.transform = after;
        } else if after != before {
            self.warn("motions shown at the start", tokens);
        }
        Ok(true)
    }

    /// A statement about materials, textures or the light of surfaces.
    fn look(&mut self, word: &[u8], tokens: &mut Tokens) -> Result<(), LoadError> {
        let name = tokens.text()?;
        let place = tokens.place();
        if word == b"NamedMaterial" {
            self.state.surface = self.surfaces.named(&name, &place, self.assembly).into();
            return self.charge(BYTES_PER_ENTRY, tokens);
        }
        let class = if word == b"Texture" { Some((tokens.text()?, tokens.text()?)) } else { None };
        let parameters = Parameters::read(tokens)?;
        self.charge(BYTES_PER_ENTRY, tokens)?;
        match (word, class) {
            (b"Material", _) => {
                self.state.surface = self.surfaces.add(&name, &parameters, &place, self.assembly).into();
            }
            (b"MakeNamedMaterial", _) => self.surfaces.add_named(name, &parameters, &place, self.assembly),
            (_, Some((_, class))) => {
                self.surfaces.add_texture(name, &class, &parameters, &place, self.assembly);
            }
            _ => {
                let light = parameters.get("L").and_then(|light| color(light, self.assembly)).unwrap_or(Vec3::ONE);
                let scale = parameters.number("scale").unwrap_or(1.0) as f32;
                self.state.emission = if scale.is_finite() { light * scale.max(0.0) } else { light };
                let _ = parameters.get("twosided");
                parameters.count_unused("lights of surfaces", &mut self.assembly.warnings);
            }
        }
        Ok(())
    }

    fn shape(&mut self, tokens: &mut Tokens) -> Result<(), LoadError> {
        let class = tokens.text()?;
        let place = tokens.place();
        let parameters = Parameters::read(tokens)?;
        if matches!(self.state.surface, Surface::None) {
            self.assembly.warnings.add("shapes without a surface left out", || place);
            return Ok(());
        }
        if parameters.number("alpha") == Some(0.0) {
            self.assembly.warnings.add("shapes with an alpha of 0 left out", || place);
            return Ok(());
        }
        let warnings = &mut self.assembly.warnings;
        let read = shapes::read(&class, &parameters, &place, &self.surfaces.images, warnings)?;
        let Some(mut mesh) = read else { return Ok(()) };
        let material = match self.state.surface {
            Surface::Material(material) => material,
            _ => self.surfaces.default(self.assembly),
        };
        let emission = self.state.emission;
        let is_dark = emission == Vec3::ZERO;
        mesh.material = if is_dark { material } else { self.surfaces.lamp(material, emission, self.assembly) };
        mesh.transform(self.state.transform, self.state.is_reversed);
        mesh.place = Some(place);
        self.charge(mesh.bytes(), tokens)?;
        match self.object {
            Some(object) => self.placed.add_to(object, mesh),
            None => self.placed.items.push(Item::Mesh(mesh)),
        }
        Ok(())
    }

    fn begin_object(&mut self, tokens: &mut Tokens) -> Result<(), LoadError> {
        let name = tokens.text()?;
        self.begin(Block::Object, tokens)?;
        if self.object.is_some() {
            self.warn("objects within another read as a part of it", tokens);
            self.inner_objects = self.inner_objects.saturating_add(1);
            return Ok(());
        }
        self.charge(BYTES_PER_ENTRY, tokens)?;
        let index = self.placed.begin_object();
        self.object = Some(index);
        self.objects.insert(name, index);
        Ok(())
    }

    fn instance(&mut self, tokens: &mut Tokens) -> Result<(), LoadError> {
        let name = tokens.text()?;
        let (object, place) = (self.objects.get(&name).copied(), tokens.place());
        match object {
            None => {
                let kind = ["copies of objects ", " without a definition left out"];
                self.assembly.warnings.add_named(kind, &name, || place);
            }
            Some(_) if self.object.is_some() => self.warn("copies of objects within an object left out", tokens),
            Some(object) => {
                self.charge(BYTES_PER_ENTRY, tokens)?;
                self.placed.items.push(Item::Copy { object, transform: self.state.transform, place });
            }
        }
        Ok(())
    }

    fn begin(&mut self, block: Block, tokens: &Tokens) -> Result<(), LoadError> {
        if self.blocks.len() >= MAX_BLOCKS {
            return Err(tokens.fault(format!("stands within more than {MAX_BLOCKS} blocks"), CORRECT));
        }
        self.blocks.push((block, self.state.clone()));
        Ok(())
    }

    /// Ends the last block, if it is of the kind that a statement ends. Objects save and restore what attributes do, so that the ends of
    /// both may be exchanged, as version 3 of the format allows.
    fn end(&mut self, block: Block, tokens: &Tokens) -> bool {
        let saves_all = |block: Block| matches!(block, Block::Attribute | Block::Object);
        let ends = self.blocks.last().is_some_and(|last| last.0 == block || saves_all(last.0) && saves_all(block));
        if ends {
            self.restore();
        } else {
            self.warn("ends of blocks that have not begun", tokens);
        }
        ends
    }

    fn end_object(&mut self, tokens: &Tokens) {
        if self.object.is_none() {
            self.warn("ends of blocks that have not begun", tokens);
        } else if self.end(Block::Object, tokens) {
            match self.inner_objects.checked_sub(1) {
                Some(left) => self.inner_objects = left,
                None => self.object = None,
            }
        }
    }

    fn restore(&mut self) {
        let Some((block, state)) = self.blocks.pop() else { return };
        if block == Block::Transform {
            self.state.transform = state.transform;
        } else {
            self.state = state;
        }
    }

    /// Passes over a statement with its parameters, which is counted.
    fn pass(&mut self, what: &str, tokens: &mut Tokens) -> Result<(), LoadError> {
        tokens.text()?;
        self.warn(what, tokens);
        Parameters::read(tokens)?;
        Ok(())
    }

    /// Passes over a word that is no statement, and everything up to the next word.
    fn pass_unknown(&mut self, word: &[u8], tokens: &mut Tokens) -> Result<(), LoadError> {
        let first = || format!("statements not understood and skipped, {} being the first", quoted(word));
        let what = self.not_understood.get_or_insert_with(first);
        self.assembly.warnings.add(what, || tokens.place());
        loop {
            match tokens.peek()? {
                Some(b'"') => drop(tokens.text()?),
                Some(bracket @ (b'[' | b']')) => drop(tokens.skip(bracket)?),
                Some(byte) if !byte.is_ascii_alphabetic() => drop(tokens.word()?.len()),
                _ => return Ok(()),
            }
        }
    }

    /// Counts memory, and checks the budget: the triangles will take about as much again.
    fn charge(&mut self, bytes: u64, tokens: &Tokens) -> Result<(), LoadError> {
        let [used, next] = &mut self.memory;
        *used = used.saturating_add(bytes);
        if *used < *next {
            return Ok(());
        }
        *next = used.saturating_add(MEMORY_INTERVAL);
        let checked = Budget::of_process().check("the shapes", *used);
        checked.map_err(|error| tokens.fault(error.shortage(), OverBudget::ADVICE))
    }

    fn warn(&mut self, what: &str, tokens: &Tokens) {
        self.assembly.warnings.add(what, || tokens.place());
    }
}
