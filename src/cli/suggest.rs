//! Suggests the command that a mistyped first argument resembles, which would otherwise be taken for a model.

use std::ffi::OsStr;
use std::path::Path;

/// Maximum edit distance between a mistyped command and the suggested one.
const MAX_DISTANCE: usize = 2;

/// The error message for a first argument that is neither a file nor named like one and resembles one of `commands`.
pub fn suggest<'a>(first: &OsStr, commands: impl Iterator<Item = &'a str>) -> Option<String> {
    let given = first.to_str()?;
    // Arguments with a folder, an extension or a colon are models.
    let is_word = given.starts_with(char::is_alphabetic) && given.chars().all(|c| c.is_alphanumeric() || c == '-');
    if !is_word || Path::new(first).exists() {
        return None;
    }
    let (distance, meant) =
        commands.map(|name| (strsim::damerau_levenshtein(&given.to_lowercase(), name), name)).min()?;
    let is_near = given != meant && distance <= MAX_DISTANCE && distance < meant.len();
    is_near.then(|| format!("'{given}' is neither a command nor a file; did you mean '{meant}'?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_words_close_to_a_command_are_suggested() {
        let meant = |given: &str| suggest(OsStr::new(given), ["render", "plot", "help"].into_iter());
        for (given, command) in [("rendr", "render"), ("redner", "render"), ("Render", "render"), ("plt", "plot")] {
            let text = meant(given).unwrap_or_default();
            assert!(text.contains(given) && text.contains(&format!("'{command}'")), "{given}: {text}");
        }
        // A command itself, flags, models, other words, and an existing folder.
        for given in ["render", "-rendr", "--plot", "rendr.obj", "./rendr", "builtin:plot", "teapot", "", "src"] {
            assert_eq!(meant(given), None, "{given}");
        }
    }
}
