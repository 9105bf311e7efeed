//! Settings of a build from names and numbers.

use std::ops::RangeInclusive;

use bvhscope_engine::tree_file::serde_json::{self, Value};
use bvhscope_engine::{BuildSettings, BuilderKind, ContainerKind, Curve, Pass, Passes, Preset, Traversal};
use pyo3::prelude::*;

use crate::error::value_error;

/// The settings of keyword arguments; those that are not given have the values of the preset.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Keywords {
    preset: String,
    container: String,
    builder: Option<String>,
    threshold: Option<i64>,
    epsilon: Option<f64>,
    curve: Option<String>,
    passes: Option<Vec<String>>,
    rounds: Option<i64>,
}

impl Keywords {
    /// The settings.
    pub(crate) fn settings(self) -> PyResult<BuildSettings> {
        let preset = named("preset", &self.preset, &Preset::ALL, Preset::name)?;
        let container = named("container", &self.container, &ContainerKind::WITH_ORIENTED, ContainerKind::name)?;
        let mut settings = BuildSettings::preset(preset, ContainerKind::Aabb);
        if let Some(builder) = self.builder {
            settings.builder = named("builder", &builder, &BuilderKind::ALL, BuilderKind::name)?;
        }
        if let Some(threshold) = self.threshold {
            let range = i64::from(BuildSettings::MIN_THRESHOLD)..=i64::from(BuildSettings::MAX_THRESHOLD);
            settings.threshold = within("threshold", threshold, range)? as u32;
        }
        if let Some(epsilon) = self.epsilon {
            settings.epsilon = within("epsilon", epsilon, 0.0..=f64::from(BuildSettings::MAX_EPSILON))? as f32;
        }
        if let Some(curve) = self.curve {
            settings.curve = named("curve", &curve, &Curve::ALL, Curve::name)?;
        }
        if let Some(passes) = self.passes {
            let passes = passes.iter().map(|pass| named("passes", pass, &Pass::ALL, Pass::name));
            settings.optimize = passes.collect::<PyResult<Vec<Pass>>>().map(Passes::from)?;
        }
        if let Some(rounds) = self.rounds {
            settings.rounds = within("rounds", rounds, 1..=i64::from(BuildSettings::MAX_ROUNDS))? as u32;
        }
        Ok(settings.for_container(container))
    }
}

/// The order in which children are visited, by name.
pub(crate) fn traversal(name: &str) -> PyResult<Traversal> {
    named("traversal", name, &Traversal::ALL, Traversal::name)
}

/// The one of `all` that has this name.
fn named<T: Copy>(field: &str, name: &str, all: &[T], name_of: impl Fn(T) -> &'static str) -> PyResult<T> {
    all.iter().copied().find(|&one| name_of(one) == name).ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|&one| format!("'{}'", name_of(one))).collect();
        value_error(field, format!("'{name}' is none of {}", names.join(", ")))
    })
}

fn within<T: PartialOrd + std::fmt::Debug>(field: &str, number: T, range: RangeInclusive<T>) -> PyResult<T> {
    if range.contains(&number) {
        return Ok(number);
    }
    Err(value_error(field, format!("{number:?}: give {:?} to {:?}", range.start(), range.end())))
}

/// The settings for the header of a tree file, where builder and container have fields of their own.
pub(crate) fn for_header(settings: &BuildSettings) -> Value {
    // Through the text, in which an f32 has the digits of its own precision: 0.2 and not 0.20000000298023224.
    let text = serde_json::to_string(settings).unwrap_or_default();
    let mut fields: Value = serde_json::from_str(&text).unwrap_or_default();
    if let Value::Object(fields) = &mut fields {
        fields.remove("builder");
        fields.remove("container");
    }
    fields
}
