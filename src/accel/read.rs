//! Trees that files hold, of any builder: read, checked and shown like those that are built here.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::file_tree::FileTree;
use super::{Accel, build_bytes_per_triangle, peak_bytes_per_triangle};
use crate::budget::Budget;
use crate::scene::{LoadError, Scene, read_file};
use bvhscope_engine::build_cache::NodeRecycler;
use bvhscope_engine::builders::StageTimes;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree_file::serde_json::{Value, from_str, to_string};
use bvhscope_engine::tree_file::{Fault, Header, TreeFile};
use bvhscope_engine::{BuildReport, BuildSettings, CancelToken, Pass, Passes, Preset, orient};

impl Accel {
    /// Reads the tree of `scene` that the file at `path` holds, and orients it where `passes` has [`Pass::Orient`], the one pass that
    /// moves no node. Its wide tree is made on request. The settings are the default ones with the container of the tree; times are
    /// those of the file, zero where it has none.
    ///
    /// # Errors
    ///
    /// Where the file cannot be read, is no tree of this scene, or does not fit into the memory budget.
    pub fn read(scene: &Arc<Scene>, path: &Path, passes: Passes, token: &CancelToken) -> Result<Self, LoadError> {
        if scene.copies.is_some() {
            let advice = "load the model with --instances flat";
            return Err(LoadError::of_file(path, "holds a tree of triangles, and the model is one of copies", advice));
        }
        let bytes = read_file(path, None, token)?;
        let budget = Budget::of_process();
        let file = TreeFile::read(&bytes, Some(&scene.triangles), budget.allowance(), token)
            .map_err(|error| LoadError::of_tree_file(path, &error))?;
        drop(bytes);
        let TreeFile { header, tree, empty_nodes, numbers, faults, .. } = file;
        // For what is derived from it: the wide tree, triangles in leaf order, lists of nodes.
        check_memory(path, tree.primitive_indices().len(), build_bytes_per_triangle(tree.container_kind()))?;
        let container = match tree.container_kind() {
            // No builder makes them.
            ContainerKind::Oriented => ContainerKind::Aabb,
            other => other,
        };
        let settings = BuildSettings::preset(Preset::Fast, container);
        let build_time = header.build_ms.and_then(|ms| Duration::try_from_secs_f64(ms / 1e3).ok());
        let report = BuildReport {
            stages: StageTimes::default(),
            build_time: build_time.unwrap_or_default(),
            threads: rayon::current_num_threads(),
            stats: tree_stats(&tree, token)?,
            tree_bytes: tree.bytes(),
            triangle_bytes: size_of_val(&scene.triangles[..]),
        };
        let mut accel = Self::new(scene, &settings, tree, report, NodeRecycler::default());
        accel.file = Some(FileTree { path: path.to_path_buf(), label: None, header, faults, empty_nodes, numbers });
        if passes.contains(Pass::Orient) { accel.oriented(token) } else { Ok(accel) }
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
            ..Header::new(self.scene.triangles.len())
        }
    }
}

/// Refuses a tree of the file at `path` whose number of `primitives` does not fit into the memory budget.
fn check_memory(path: &Path, primitives: usize, bytes_per_triangle: u64) -> Result<(), LoadError> {
    let needed = (primitives as u64).saturating_mul(bytes_per_triangle);
    Budget::of_process().check("the tree", needed).map_err(|error| LoadError::over_budget(path, &error))
}
