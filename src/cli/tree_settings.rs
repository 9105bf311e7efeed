//! The settings of a tree as one argument, for `diff`: the names and values of the tree flags, as in `builder=lbvh
//! container=sphere`.

use std::path::Path;

use super::named::{named, passes, tree_builder};
use super::values;
use crate::headless::diff::DiffTree;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;

/// The settings that can be given, in the order of the help.
const NAMES: [&str; 8] = ["builder", "container", "preset", "threshold", "epsilon", "curve", "optimize", "rounds"];
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
    let mut given: Vec<(&str, &str)> = Vec::new();
    for word in text.split_whitespace() {
        let setting = word
            .split_once('=')
            .ok_or_else(|| format!("'{word}' is no setting NAME=VALUE, with NAME one of {}", NAMES.join(", ")))?;
        if !NAMES.contains(&setting.0) {
            return Err(unknown(setting.0));
        }
        if given.iter().any(|(name, _)| *name == setting.0) {
            return Err(format!("'{}' is set twice", setting.0));
        }
        given.push(setting);
    }
    // The preset is the base of the others, wherever it stands.
    let preset = value_of(&given, "preset", named)?.unwrap_or(Preset::Fast);
    let container = value_of(&given, "container", named)?.unwrap_or(ContainerKind::Aabb);
    let base = BuildSettings::preset(preset, container);
    let settings = BuildSettings {
        builder: value_of(&given, "builder", tree_builder)?.unwrap_or(base.builder),
        container,
        threshold: value_of(&given, "threshold", values::threshold)?.unwrap_or(base.threshold),
        epsilon: value_of(&given, "epsilon", values::epsilon)?.unwrap_or(base.epsilon),
        curve: value_of(&given, "curve", named)?.unwrap_or(base.curve),
        optimize: value_of(&given, "optimize", passes)?.unwrap_or(base.optimize),
        rounds: value_of(&given, "rounds", values::rounds)?.unwrap_or(base.rounds),
    };
    let names_passes = given.iter().any(|(name, _)| *name == "optimize") && container == ContainerKind::Sphere;
    if let Some(pass) = settings.optimize.iter().find(|pass| names_passes && pass.boxes_only()) {
        return Err(format!("the pass '{}' works on boxes only: choose container=box or another pass", pass.name()));
    }
    settings.refusal(0).map_or(Ok(settings), Err)
}

/// The parsed value of a setting, if it is given.
fn value_of<T>(
    given: &[(&str, &str)],
    name: &str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<Option<T>, String> {
    let Some((_, value)) = given.iter().find(|(known, _)| *known == name) else { return Ok(None) };
    parse(value).map(Some).map_err(|error| format!("in '{name}={value}': {error}"))
}

/// The message for a setting that does not exist.
fn unknown(name: &str) -> String {
    let meant = NAMES.into_iter().map(|known| (strsim::damerau_levenshtein(name, known), known)).min();
    match meant.filter(|&(distance, known)| distance <= MAX_DISTANCE && distance < known.len()) {
        Some((_, known)) => format!("there is no setting '{name}'; did you mean '{known}'?"),
        None => format!("there is no setting '{name}': one of {} is expected", NAMES.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use bvhscope_engine::settings::{BuilderKind, Curve, Pass, Passes};

    use super::*;

    #[test]
    fn settings_are_those_of_the_flags() {
        assert_eq!(tree_settings("").unwrap(), BuildSettings::default());
        let hq = BuildSettings::preset(Preset::Hq, ContainerKind::Aabb);
        assert_eq!(tree_settings("preset=hq").unwrap(), hq);
        assert_eq!(tree_settings(" threshold=20  preset=hq ").unwrap(), BuildSettings { threshold: 20, ..hq });
        let given = "builder=lbvh container=sphere epsilon=0.25 curve=hilbert optimize=collapse rounds=7";
        let expected = BuildSettings {
            builder: BuilderKind::Lbvh,
            container: ContainerKind::Sphere,
            epsilon: 0.25,
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
            ("container=cube", &["container=cube", "box, sphere"]),
            ("builder=none", &["builder=none", "aac"]),
            ("preset=", &["preset=", "one of"]),
            ("threshold=6 threshold=7", &["'threshold'", "twice"]),
            ("container=sphere optimize=reinsert", &["'reinsert'", "boxes only"]),
            ("container=sphere builder=binned-sah", &["boxes only"]),
        ] {
            let error = tree_settings(text).unwrap_err();
            assert!(!error.contains('\n'), "one line: {error}");
            for part in parts {
                assert!(error.contains(part), "{text}: '{part}' is missing in: {error}");
            }
        }
    }
}
