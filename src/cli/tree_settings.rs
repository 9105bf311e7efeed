//! The settings of a tree as one argument, for `diff`: the names and values of the tree flags, as in `builder=lbvh
//! container=sphere`.

use std::path::Path;

use super::named::tree_builder;
use crate::catalog::settings::{BUILDER, Given, SETTINGS};
use crate::headless::diff::DiffTree;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::ContainerKind;

/// Maximum edit distance between a mistyped name and the suggested one.
const MAX_DISTANCE: usize = 3;

/// Parses a tree of `diff`: a tree file, by its name, or settings.
pub fn diff_tree(text: &str) -> Result<DiffTree, String> {
    let path = Path::new(text);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bvh")) {
        return Ok(DiffTree::File(path.to_path_buf()));
    }
    tree_settings(text).map(DiffTree::Built)
}

/// Parses settings `NAME=VALUE`, separated by blanks; what is not given has its default.
pub fn tree_settings(text: &str) -> Result<BuildSettings, String> {
    let mut given = Given::default();
    for word in text.split_whitespace() {
        let (name, value) = word
            .split_once('=')
            .ok_or_else(|| format!("'{word}' is no setting NAME=VALUE, with NAME one of {}", names().join(", ")))?;
        let setting = SETTINGS.into_iter().find(|row| row.key == name).ok_or_else(|| unknown(name))?;
        if given.get(setting).is_some() {
            return Err(format!("'{name}' is set twice"));
        }
        // Without a tree there is nothing to compare.
        let is_tree = if name == BUILDER.key { tree_builder(value).map(|_| ()) } else { Ok(()) };
        is_tree.and_then(|()| given.insert(setting, value)).map_err(|error| format!("in '{word}': {error}"))?;
    }
    let settings = given.settings();
    if let Some(pass) = given.pass_for_boxes().filter(|_| settings.container != ContainerKind::Aabb) {
        return Err(format!("the pass '{}' works on boxes only: choose container=box or another pass", pass.name()));
    }
    settings.refusal(0).map_or(Ok(settings), Err)
}

fn names() -> [&'static str; SETTINGS.len()] {
    SETTINGS.map(|row| row.key)
}

/// The message for a setting that does not exist.
fn unknown(name: &str) -> String {
    let meant = names().into_iter().map(|known| (strsim::damerau_levenshtein(name, known), known)).min();
    match meant.filter(|&(distance, known)| distance <= MAX_DISTANCE && distance < known.len()) {
        Some((_, known)) => format!("there is no setting '{name}'; did you mean '{known}'?"),
        None => format!("there is no setting '{name}': one of {} is expected", names().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use bvhscope_engine::settings::{BuilderKind, Curve, Pass, Passes, Preset};

    use super::*;

    #[test]
    fn settings_are_those_of_the_flags() {
        assert_eq!(tree_settings("").unwrap(), BuildSettings::default());
        let hq = BuildSettings::preset(Preset::Hq, ContainerKind::Aabb);
        assert_eq!(tree_settings("preset=hq").unwrap(), hq);
        assert_eq!(tree_settings(" threshold=20  preset=hq ").unwrap(), BuildSettings { threshold: 20, ..hq });
        let given = "builder=lbvh container=sphere curve=hilbert optimize=collapse rounds=7";
        let expected = BuildSettings {
            builder: BuilderKind::Lbvh,
            container: ContainerKind::Sphere,
            curve: Curve::Hilbert,
            optimize: Passes::NONE.with(Pass::Collapse),
            rounds: 7,
            ..BuildSettings::default()
        };
        assert_eq!(tree_settings(given).unwrap(), expected);
    }

    #[test]
    fn a_name_that_ends_as_tree_files_do_is_a_file() {
        for name in ["mine.bvh", "a folder/b=c.BVH"] {
            assert_eq!(diff_tree(name).unwrap(), DiffTree::File(name.into()));
        }
        assert_eq!(diff_tree("preset=fast").unwrap(), DiffTree::Built(BuildSettings::default()));
        assert!(diff_tree("mine.obj").unwrap_err().contains("NAME=VALUE"));
    }

    #[test]
    fn faults_are_named_with_a_way_out() {
        for (text, parts) in [
            ("fast", &["'fast'", "NAME=VALUE", "preset"][..]),
            ("treshold=6", &["'treshold'", "did you mean 'threshold'"]),
            ("optimise=all", &["did you mean 'optimize'"]),
            ("colour=red", &["'colour'", "builder, container"]),
            ("threshold=1", &["threshold=1", "2 to 64"]),
            ("container=cube", &["container=cube", "box, sphere, dop"]),
            ("builder=none", &["builder=none", "aac"]),
            ("preset=", &["preset=", "one of"]),
            ("threshold=6 threshold=7", &["'threshold'", "twice"]),
            ("container=sphere optimize=reinsert", &["'reinsert'", "boxes only"]),
            ("container=dop optimize=split", &["'split'", "boxes only"]),
            ("container=sphere builder=binned-sah", &["no spheres"]),
        ] {
            let error = tree_settings(text).unwrap_err();
            assert!(!error.contains('\n'), "one line: {error}");
            for part in parts {
                assert!(error.contains(part), "{text}: '{part}' is missing in: {error}");
            }
        }
    }
}
