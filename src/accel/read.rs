//! Trees that files hold, of any builder: read, checked and shown like those that are built here.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::file_tree::FileTree;
use super::two_levels::TwoLevels;
use super::{Accel, build_bytes_per_triangle, peak_bytes_per_triangle};
use crate::budget::Budget;
use crate::scene::{LoadError, Scene, SceneCopies, read_file};
use bvhscope_engine::build_cache::NodeRecycler;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree_file::serde_json::{Value, from_str, to_string};
use bvhscope_engine::tree_file::{Fault, Header, KnownScene, LevelTree, TreeFile, TwoLevelFile};
use bvhscope_engine::{
    AnyTree, BuildError, BuildReport, BuildSettings, CancelToken, Pass, Passes, Preset, WideBvh, orient,
};

impl Accel {
    /// Reads the tree of `scene` that the file at `path` holds, in two levels that of a scene of copies, and orients it where `passes` has
    /// [`Pass::Orient`], the one pass that moves no node. Its wide tree is made on request, in two levels at once. The settings are the default ones with the container of the tree; times are
    /// those of the file, zero where it has none.
    ///
    /// # Errors
    ///
    /// Where the file cannot be read, is no tree of this scene, or does not fit into the memory budget.
    pub fn read(scene: &Arc<Scene>, path: &Path, passes: Passes, token: &CancelToken) -> Result<Self, LoadError> {
        if let Some(copies) = &scene.copies {
            return Self::read_two_levels(scene, copies, path, passes, token);
        }
        let bytes = read_file(path, None, token)?;
        let file = TreeFile::read(&bytes, Some(&scene.triangles), Budget::of_process().allowance(), token)
            .map_err(|error| LoadError::of_tree_file(path, &error))?;
        drop(bytes);
        let TreeFile { header, tree, empty_nodes, numbers, faults, .. } = file;
        check_memory(path, tree.primitive_indices().len(), build_bytes_per_triangle(tree.container_kind()))?;
        let path = path.to_path_buf();
        let file = FileTree { path, label: None, header, faults, empty_nodes, numbers, ids: None };
        let accel = Self::of_file(scene, tree, file, token)?;
        if passes.contains(Pass::Orient) { accel.oriented(token) } else { Ok(accel) }
    }

    /// [`Accel::read`] of both levels of a scene of `copies`, with the wide trees.
    fn read_two_levels(
        scene: &Arc<Scene>,
        copies: &Arc<SceneCopies>,
        path: &Path,
        passes: Passes,
        token: &CancelToken,
    ) -> Result<Self, LoadError> {
        let refused = |error: BuildError| match error {
            BuildError::Cancelled(cancelled) => LoadError::Cancelled(cancelled),
            BuildError::Refused(text) => {
                let (problem, advice) =
                    text.split_once("; ").unwrap_or((&text, "load the model with --instances flat"));
                LoadError::of_file(path, problem, advice)
            }
        };
        let wanted = BuildSettings { optimize: passes, ..BuildSettings::default() };
        if let Some(text) = Self::refusal(scene, &wanted).filter(|_| passes.contains(Pass::Orient)) {
            return Err(refused(BuildError::Refused(text)));
        }
        let bytes = read_file(path, None, token)?;
        let places = copies.copies();
        let known = KnownScene {
            meshes: (0..copies.mesh_count() as u32).map(|mesh| copies.mesh(mesh)).collect(),
            instances: (0..places.len() as u32).map(|copy| (places.mesh(copy), places.place(copy))).collect(),
        };
        let file = TwoLevelFile::read(&bytes, Some(&known), Budget::of_process().allowance(), token)
            .map_err(|error| LoadError::of_tree_file(path, &error))?;
        drop((bytes, known));
        let TwoLevelFile { header, top, meshes, ids, faults, .. } = file;
        let trees: Vec<AnyTree> = meshes.into_iter().map(|mesh| mesh.tree.tree).collect();
        let primitives = trees.iter().chain([&top.tree]).map(|tree| tree.primitive_indices().len()).sum();
        check_memory(path, primitives, build_bytes_per_triangle(ContainerKind::Aabb))?;
        let LevelTree { tree, empty_nodes, numbers } = top;
        let wide = Arc::new(WideBvh::new(&tree, scene.built_triangles(), token)?);
        let mut levels = TwoLevels::of_trees(copies, &wide, trees, token).map_err(refused)?;
        let tree = levels.unfold(tree, &scene.unfolded.copies, token)?;
        let path = path.to_path_buf();
        let mut file = FileTree { path, label: None, header, faults, empty_nodes, numbers, ids };
        if let Some(unfolded) = levels.unfolded() {
            file.unfold(unfolded);
        }
        let mut accel = Self::of_file(scene, tree, file, token)?;
        (accel.wide, accel.levels) = (wide.into(), Some(levels));
        Ok(accel)
    }

    /// The `tree` of `scene` that `file` describes.
    fn of_file(scene: &Arc<Scene>, tree: AnyTree, file: FileTree, token: &CancelToken) -> Result<Self, LoadError> {
        let container = match tree.container_kind() {
            // No builder makes them.
            ContainerKind::Oriented => ContainerKind::Aabb,
            other => other,
        };
        let settings = BuildSettings::preset(Preset::Fast, container);
        let build_time = file.header.build_ms.and_then(|ms| Duration::try_from_secs_f64(ms / 1e3).ok());
        let report = BuildReport::of_tree(&tree, &scene.triangles, token)?;
        let report = BuildReport { build_time: build_time.unwrap_or_default(), ..report };
        let mut accel = Self::new(scene, &settings, tree, report, NodeRecycler::default());
        accel.file = Some(file);
        Ok(accel)
    }

    /// This tree, which was read, with oriented boxes; a copy of one of other containers than boxes.
    ///
    /// # Errors
    ///
    /// Where it does not fit into the memory budget beside this one, or the token is cancelled.
    pub fn oriented(&self, token: &CancelToken) -> Result<Self, LoadError> {
        let settings = BuildSettings { optimize: self.settings.optimize.with(Pass::Orient), ..self.settings };
        let path = self.file.as_ref().map_or(Path::new(""), |file| &file.path);
        check_memory(path, self.tree.primitive_indices().len(), peak_bytes_per_triangle(&settings))?;
        let start = Instant::now();
        let tree = orient(&self.tree, &self.scene.triangles, token)?;
        let time = start.elapsed();
        let mut stages = self.report.stages.clone();
        stages.stages.push((Pass::Orient.name(), time));
        let report = BuildReport {
            stages,
            build_time: self.report.build_time + time,
            stats: tree_stats(&tree, token)?,
            tree_bytes: tree.bytes(),
            ..self.report.clone()
        };
        let mut accel = Self::new(&self.scene, &settings, tree, report, NodeRecycler::default());
        accel.file.clone_from(&self.file);
        Ok(accel)
    }

    /// Name of the builder, on the command line and in JSON; that of the file for a tree that was read.
    pub fn builder_name(&self) -> Cow<'_, str> {
        self.file.as_ref().map_or(Cow::Borrowed(self.settings.builder.name()), FileTree::builder)
    }

    /// Time of the build in milliseconds; `None` for a tree whose file does not say.
    pub fn build_ms(&self) -> Option<f64> {
        match &self.file {
            Some(file) => file.header.build_ms,
            None => Some(self.report.build_time.as_secs_f64() * 1e3),
        }
    }

    /// Faults of a tree that was read; none for one that was built here.
    pub fn faults(&self) -> &[Fault] {
        self.file.as_ref().map_or(&[], |file| &file.faults)
    }

    /// The header for a file of this tree or of its wide tree: that of the file it was read from, or builder, settings
    /// and time of the build.
    pub fn file_header(&self, wide: bool) -> Header {
        if let Some(file) = &self.file {
            // The tree that was made from it is another.
            let build_ms = file.header.build_ms.filter(|_| !wide);
            return Header { build_ms, ..file.header.clone() };
        }
        // Through the text, in which an f32 has the digits of its own precision: 0.2 and not 0.20000000298023224.
        let text = to_string(&self.settings).unwrap_or_default();
        let mut settings: Value = from_str(&text).unwrap_or_default();
        if let Value::Object(fields) = &mut settings {
            // These two are in the header already.
            fields.remove("builder");
            fields.remove("container");
            if wide {
                fields.insert("wide".to_owned(), true.into());
            }
        }
        Header {
            builder: Some(self.builder_name().into_owned()),
            settings: Some(settings),
            build_ms: self.build_ms(),
            ..Header::new(self.scene.built_triangles().len())
        }
    }
}

/// Refuses a tree of the file at `path` where what is derived from it does not fit into the memory budget: the wide tree, triangles in leaf
/// order, lists of nodes.
fn check_memory(path: &Path, primitives: usize, bytes_per_triangle: u64) -> Result<(), LoadError> {
    let needed = (primitives as u64).saturating_mul(bytes_per_triangle);
    Budget::of_process().check("the tree", needed).map_err(|error| LoadError::over_budget(path, &error))
}
