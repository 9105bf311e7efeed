//! Models of files, by the readers of the program.

use std::ffi::OsString;

use bvhscope::scene::{Instancing, LoadError, LoadOptions, SceneSource, load};
use bvhscope::text::counted;
use pyo3::prelude::*;

use crate::core::Core;
use crate::error::{Failure, value_error};
use crate::mesh::Gathered;
use crate::model::Model;
use crate::run::{run, thread_count};
use crate::settings::Keywords;

/// Builds the trees of a model file or of a built-in model. Returns its warnings as well.
#[pyfunction]
pub(crate) fn read_model(
    py: Python<'_>,
    path: OsString,
    allow_outside: bool,
    keywords: Keywords,
    threads: i64,
) -> PyResult<(Core, Vec<String>)> {
    let settings = keywords.settings()?;
    let source = SceneSource::parse(&path).map_err(|error| value_error("path", error))?;
    // Triangles are wanted, of every copy.
    let options = LoadOptions { allow_outside, instances: Instancing::Flat, ..LoadOptions::default() };
    let (model, warnings) = run(py, thread_count(threads)?, move |token| {
        let scene = load(&source, &options, token)?;
        let warnings =
            scene.warnings.entries.iter().map(|warning| for_python(&counted(warning.count, &warning.what))).collect();
        let mesh = Gathered { triangles: scene.triangles, offset: scene.offset };
        Ok((Model::build(mesh, &settings, token)?, warnings))
    })?;
    Ok((Core::new(model), warnings))
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Cancelled(_) => Self::Cancelled,
            LoadError::Unusable { .. } => Self::Value(for_python(&error.to_string())),
        }
    }
}

/// A text of the program with the name that its option has here.
fn for_python(text: &str) -> String {
    text.replace("--allow-outside", "allow_outside=True")
}
