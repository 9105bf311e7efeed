//! Rows of the commands that measure rays in trees of many layouts, in parts of a scene or in forms of it: `layouts` and `copies`.

use serde::Serialize;

use super::conditions::Conditions;
use super::population::Population;
use crate::catalog::settings::Stated;

/// A row, of which `own` is what belongs to its kind alone. Field names are the JSON names.
#[derive(Debug, Clone, Serialize)]
pub struct CostRow<T> {
    /// The command.
    pub command: &'static str,
    /// The model as the user named it.
    pub model: String,
    /// Number of triangles, of all copies where there are copies.
    pub triangles: usize,
    /// Name of the builder.
    pub builder: String,
    /// The file that holds the tree, where it was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree: Option<String>,
    /// The settings of the build.
    #[serde(flatten)]
    pub settings: Stated,
    /// Number of threads.
    pub threads: usize,
    /// The fields of its kind.
    #[serde(flatten)]
    pub own: T,
    /// Width of the view in pixels.
    pub width_px: u32,
    /// Height of the view in pixels.
    pub height_px: u32,
    /// Camera, program and machine.
    #[serde(flatten)]
    pub conditions: Conditions,
    /// Warnings of loading the model.
    pub warnings: Vec<String>,
}

/// The fields of a kind of rows.
pub trait OwnFields: Serialize {
    /// All columns of its CSV, in order.
    fn columns() -> Vec<&'static str>;
    /// The rays.
    fn population(&self) -> Population;
}

/// The fields of `rows` of each population, in order of first appearance.
pub fn by_population<T: OwnFields>(rows: &[CostRow<T>]) -> Vec<Vec<&T>> {
    let mut all: Vec<Vec<&T>> = Vec::new();
    for own in rows.iter().map(|row| &row.own) {
        match all.iter_mut().find(|of| of[0].population() == own.population()) {
            Some(of) => of.push(own),
            None => all.push(vec![own]),
        }
    }
    all
}
