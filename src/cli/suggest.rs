//! A mistyped command, which would be taken for the name of a model.

use std::ffi::OsStr;
use std::path::Path;

/// More letters than this that are wrong, missing or too many make another word.
const MOST_WRONG: usize = 2;

/// What to say of a first argument that is no file, has no name of one, and is nearly one of the `commands`.
pub fn suggest<'a>(first: &OsStr, commands: impl Iterator<Item = &'a str>) -> Option<String> {
    let given = first.to_str()?;
    // Whatever has a folder, an extension or a colon is meant as a model.
    let is_word = given.starts_with(char::is_alphabetic) && given.chars().all(|c| c.is_alphanumeric() || c == '-');
    if !is_word || Path::new(first).exists() {
        return None;
    }
    let (distance, meant) =
        commands.map(|name| (strsim::damerau_levenshtein(&given.to_lowercase(), name), name)).min()?;
    let is_near = given != meant && distance <= MOST_WRONG && distance < meant.len();
    is_near.then(|| format!("'{given}' is neither a command nor a file; did you mean '{meant}'?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_words_near_a_command_are_taken_for_one() {
        let meant = |given: &str| suggest(OsStr::new(given), ["render", "plot", "help"].into_iter());
        for (given, command) in [("rendr", "render"), ("redner", "render"), ("Render", "render"), ("plt", "plot")] {
            let text = meant(given).unwrap_or_default();
            assert!(text.contains(given) && text.contains(&format!("'{command}'")), "{given}: {text}");
        }
        // A command itself, flags, models, other words, and a folder that is there.
        for given in ["render", "-rendr", "--plot", "rendr.obj", "./rendr", "builtin:plot", "teapot", "", "src"] {
            assert_eq!(meant(given), None, "{given}");
        }
    }
}
