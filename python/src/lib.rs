//! The engine for Python: the module `bvhscope._engine`, on which the package in `python/bvhscope` is built.
//!
//! Arrays come in and go out; names, docstrings and defaults are the package's. Modules in reading order, each of which imports
//! only those above it:
//!
//! | module | what it does | must not know |
//! |---|---|---|
//! | [`error`] | failures as exceptions of Python | the engine's types of input |
//! | [`run`] | work on a pool of threads that Ctrl-C ends, without a panic that leaves it | arrays |
//! | [`arrays`] | arrays of NumPy as numbers, without copies | rays, meshes |
//! | [`rays`] | rays and points from arrays, and arrays of their shape | trees |
//! | [`mesh`] | triangles from vertices and faces | trees |
//! | [`settings`] | settings of a build from names and numbers | meshes |
//! | [`model`] | triangles with their trees: built, read, refitted, written | Python |
//! | [`queries`] | answers for many rays and points | Python |
//! | [`core`] | the class `Core`, whose methods are all of the above | files |
//! | `files` | models of files, with the feature of this name | |

mod error;

mod run;

mod arrays;

mod rays;

mod mesh;

mod settings;

mod model;

mod queries;

mod core;

#[cfg(feature = "files")]
mod files;

/// The module `bvhscope._engine`.
#[pyo3::pymodule(gil_used = false)]
mod _engine {
    #[pymodule_export]
    use crate::core::{Core, build, read};

    #[cfg(feature = "files")]
    #[pymodule_export]
    use crate::files::read_model;
}
