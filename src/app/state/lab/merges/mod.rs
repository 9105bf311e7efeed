//! State of the view "Merges": the step that it shows, how it plays, and what was derived for it.

mod standing;

mod parameters;

pub use parameters::{CutKind, MergePage, MergesState, SharedMerges};
pub use standing::{ChoiceOf, CutNodes, MergeStudy, Standing};
