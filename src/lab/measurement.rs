//! The measurement of one tree: a table row, a plot point, a JSON line.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::conditions::Conditions;
use super::population::MeasuredRays;
use super::speedup::prediction::ScalingPrediction;
use super::verdict::number::Reading;
use super::verdict::word::RowVerdict;
use crate::catalog::numbers::Number;
use crate::catalog::numbers::millions_per_second;
use crate::catalog::numbers::rows::{BUILD_STAGES_MS, EPO, EPO_MARGIN, MRAYS_PER_S, RAYS, TREE_HASH, WIDE_TRACE_MS};
use crate::catalog::settings::Stated;
use crate::catalog::values::Values;
use crate::text::{file_name, quoted};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::tree::ContainerKind;

pub use crate::threads::{available_threads, pool};

/// The measurement of one tree. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The job that made it: "bench", "sweep", "scaling", "compare", "animate" or "diff".
    pub command: String,
    /// The model as the user named it.
    pub model: String,
    /// Number of triangles of the model.
    pub triangles: usize,
    /// Name of the builder.
    pub builder: String,
    /// The file that holds the tree, where it was read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree: Option<String>,
    /// The name that the user gave the tree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// Name of the preset that has these settings, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Boxes or spheres.
    pub container: ContainerKind,
    /// The settings of the build.
    #[serde(flatten)]
    pub settings: Stated,
    /// Animate: the policy, and the moment that the tree is of.
    #[serde(flatten)]
    pub motion: Option<FrameOfClip>,
    /// Compare: the form of a scene of copies that it is of, where that has rows in others.
    #[serde(flatten)]
    pub form: Option<FormOfCopies>,
    /// Number of threads for building and tracing.
    pub threads: usize,
    /// The numbers of the catalogue.
    #[serde(flatten)]
    pub values: Values,
    /// Scaling: the speed-up predicted for more cores, in the row of one thread, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_scaling: Option<ScalingPrediction>,
    /// Traversal order, "ordered" or "paper".
    pub traversal: String,
    /// Width of the traced picture in pixels.
    pub width_px: u32,
    /// Height of the traced picture in pixels.
    pub height_px: u32,
    /// Number of rounds behind each median.
    pub repeat: usize,
    /// The values of each round by the names of their medians; rows that were measured in turn have those of one round at one place.
    #[serde(default, rename = "times", skip_serializing_if = "BTreeMap::is_empty")]
    pub rounds: BTreeMap<String, Vec<f64>>,
    /// How its times compare with those of another tree that was measured in turn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verdicts: Vec<RowVerdict>,
    /// Camera, program and machine; absent in rows of versions before 0.3.
    #[serde(flatten)]
    pub conditions: Option<Conditions>,
    /// Cost of the rays of each population, where it was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub populations: Vec<MeasuredRays>,
    /// Warnings of loading the model.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Policy and frame of a row of `animate`. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameOfClip {
    /// Name of the policy.
    pub policy: Policy,
    /// Name of the clip.
    pub clip: String,
    /// The frame, from 0.
    pub frame: usize,
    /// Time of the clip in seconds.
    pub time_s: f32,
}

/// The form of a scene of copies, and what rays read of it. Field names are the JSON names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FormOfCopies {
    /// Most parts for each copy in the tree above, 1 for whole copies; `None` of the flat scene.
    pub open: Option<f32>,
    /// Bytes of the wide trees of all levels, and of the places of copies.
    pub traced_bytes: usize,
}

impl FrameOfClip {
    /// The clip in headings: "clip 'run'".
    pub fn clip_text(&self) -> String {
        if self.clip.is_empty() { "an unnamed clip".to_owned() } else { format!("clip {}", quoted(&self.clip)) }
    }
}

/// A model, and where the camera stands whose rays were traced: rows of two cameras are of different rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelView<'a> {
    /// The model as the user named it.
    pub model: &'a str,
    /// Name of the place of the camera; empty in rows of earlier versions.
    pub camera: &'a str,
}

/// The distinct models with their cameras, in order of first appearance.
pub fn model_views(rows: &[Measurement]) -> Vec<ModelView<'_>> {
    let mut views = Vec::new();
    for row in rows {
        if !views.contains(&row.view()) {
            views.push(row.view());
        }
    }
    views
}

impl Measurement {
    /// The model, and where its camera stands.
    pub fn view(&self) -> ModelView<'_> {
        let view = self.conditions.as_ref().and_then(|conditions| conditions.view.as_ref());
        ModelView { model: &self.model, camera: view.map_or("", |view| &view.camera) }
    }

    /// A number of the catalogue; NaN where it is not known.
    pub fn number(&self, number: &Number) -> f64 {
        self.values.number(number)
    }

    /// A number with its value in each round and the margin of an estimate.
    pub fn reading(&self, number: &Number) -> Reading {
        let rounds = if number == MRAYS_PER_S {
            let rays = self.values.count(RAYS);
            self.rounds_of(WIDE_TRACE_MS).iter().map(|&ms| millions_per_second(rays, ms)).collect()
        } else {
            self.rounds_of(number).to_vec()
        };
        let margin = if number == EPO { self.values.known(EPO_MARGIN).unwrap_or(0.0) } else { 0.0 };
        Reading { value: self.number(number), rounds, margin }
    }

    /// The values of a number in each round; none of one that was not repeated.
    pub fn rounds_of(&self, number: &Number) -> &[f64] {
        self.rounds.get(number.key).map_or(&[], Vec::as_slice)
    }

    /// True if both rows measure the same tree, node for node.
    pub fn has_tree_of(&self, other: &Self) -> bool {
        let hash = |row: &Self| row.values.value(TREE_HASH).cloned();
        hash(self).is_some() && hash(self) == hash(other)
    }

    /// The same row with another number; NaN where it shall not be known.
    #[must_use]
    pub fn with(mut self, number: &Number, value: impl Into<Value>) -> Self {
        self.values.set(number, value);
        self
    }

    /// Median time of each build stage in milliseconds.
    pub fn stages_ms(&self) -> BTreeMap<&str, f64> {
        let stages = self.values.value(BUILD_STAGES_MS).and_then(Value::as_object);
        stages.into_iter().flatten().filter_map(|(name, ms)| Some((name.as_str(), ms.as_f64()?))).collect()
    }

    /// Label of a tree from a file, or name of the file with the builder: "mine.bvh (embree)"; `None` for a tree that was built.
    pub fn file_name(&self) -> Option<String> {
        let file = self.tree.as_ref()?;
        Some(self.label.clone().unwrap_or_else(|| file_and_builder(file.as_ref(), &self.builder)))
    }

    /// The tree as a short name: its label, its file, or builder, curve and passes; of a preset that `compare` sets beside others its name.
    pub fn name(&self) -> String {
        if let Some(name) = self.label.clone().or_else(|| self.file_name()) {
            return name;
        }
        if let Some(preset) = self.preset.as_ref().filter(|_| self.command == "compare") {
            return preset.clone();
        }
        let mut parts = vec![self.builder.clone()];
        parts.extend(self.settings.by_name());
        parts.join(" + ")
    }
}

/// Name of a tree from a file: "mine.bvh (embree)".
pub fn file_and_builder(path: &Path, builder: &str) -> String {
    format!("{} ({builder})", file_name(path))
}

/// A duration in milliseconds.
pub fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
