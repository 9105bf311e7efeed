//! What a loader is allowed to do.

/// Permissions for loading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Allows files outside the model's folder to be read.
    pub allow_outside: bool,
}
