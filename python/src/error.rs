//! Failures as exceptions of Python.

use std::io;

use bvhscope_engine::tree_file::TreeFileError;
use bvhscope_engine::{BuildError, Cancelled};
use pyo3::PyErr;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};

/// Why there is no result.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The work was cancelled, which only Ctrl-C does.
    Cancelled,
    /// An argument is wrong: field and remedy.
    Value(String),
    /// A file could not be written.
    Io(io::Error),
    /// The work panicked, with this message.
    Bug(String),
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Cancelled(_) => Self::Cancelled,
            BuildError::Refused(refusal) => Self::Value(refusal),
        }
    }
}

impl From<TreeFileError> for Failure {
    fn from(error: TreeFileError) -> Self {
        match error {
            TreeFileError::Cancelled(_) => Self::Cancelled,
            _ => Self::Value(format!("the tree file {error}: {}", error.advice())),
        }
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.downcast::<Cancelled>() {
            Ok(Cancelled) => Self::Cancelled,
            Err(error) => Self::Io(error),
        }
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Cancelled => PyKeyboardInterrupt::new_err(()),
            Failure::Value(message) => PyValueError::new_err(message),
            Failure::Io(error) => error.into(),
            Failure::Bug(message) => PyRuntimeError::new_err(format!(
                "internal error of bvhscope: {message}; please report it with the call that led to it"
            )),
        }
    }
}

/// A `ValueError`: the argument `field`, and what is wrong with it and what to do.
pub(crate) fn value_error(field: &str, message: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("{field}: {message}"))
}
