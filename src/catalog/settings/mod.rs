//! The settings of a builder, one row each. Flags, their checks and help, the SETTINGS of `diff`, copied command lines, sliders,
//! limits of saved settings and lists of settings follow from the rows.
//!
//! To add a setting: its field in [`BuildSettings`], its row in `rows`.

mod setting;

mod rows;

mod given;

mod stated;

use bvhscope_engine::settings::{BuildSettings, Pass};

pub use given::Given;
pub use rows::{BUILDER, CONTAINER, OPTIMIZE, PRESET, SETTINGS, THRESHOLD};
pub use rows::{CURVE, EPSILON, ROUNDS};
pub use setting::{Choice, Number, Setting, Value};
pub use stated::{Stated, parameters};

/// The keys and values by which a copied command line makes the same tree.
pub fn written(build: &BuildSettings) -> impl Iterator<Item = (&'static str, String)> {
    let rows = SETTINGS.into_iter().filter(|row| (row.is_written)(build));
    rows.map(|row| (row.key, row.text(build)))
}

/// Name of the preset that has these settings, whatever the containers; `None` if none has.
pub fn preset_name(build: &BuildSettings) -> Option<String> {
    Some(PRESET.text(&on_plain_boxes(build))).filter(|name| !name.is_empty())
}

/// The same without the pass that makes oriented boxes: settings of the tree before it.
fn on_plain_boxes(build: &BuildSettings) -> BuildSettings {
    BuildSettings { optimize: build.optimize.without(Pass::Orient), ..*build }
}

/// Builder, numbers and containers of a build, then curve and passes that are not the defaults: "AAC δ 6 ε 0.2, boxes, collapse
/// reinsert". Oriented boxes stand for the pass that makes them.
pub fn short_name(build: &BuildSettings) -> String {
    let stated = Stated::of(&on_plain_boxes(build));
    let builder = [&[build.builder.label().to_owned()], &stated.by_symbol()[..]].concat().join(" ");
    let named = stated.by_name().into_iter().map(|names| names.replace(',', " "));
    [builder, build.tree_container().plural().to_owned()].into_iter().chain(named).collect::<Vec<_>>().join(", ")
}

/// The settings that a build uses, with their names in the window.
pub fn used(build: &BuildSettings) -> impl Iterator<Item = (&'static str, String)> {
    let rows = SETTINGS.into_iter().filter(|row| (row.applies)(build));
    rows.map(|row| (row.label, row.shown(build))).filter(|(_, value)| !value.is_empty())
}

/// Clamps the numbers to their ranges.
pub fn limit(build: &mut BuildSettings) {
    for row in SETTINGS {
        if let Value::Number(Number { range: [low, high], get, set, .. }) = &row.value {
            let within = get(build).clamp(*low, *high);
            set(build, within);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;
    use bvhscope_engine::settings::{BuilderKind, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn short_names_name_the_containers_of_the_finished_tree() {
        let of = |container: ContainerKind| short_name(&BuildSettings::default().for_container(container));
        let expected = ["boxes", "spheres", "14-DOPs", "oriented boxes"].map(|kind| format!("AAC δ 6 ε 0.2, {kind}"));
        assert_eq!(ContainerKind::WITH_ORIENTED.map(of), expected);
        let passes = Passes::NONE.with(Pass::Collapse).with(Pass::Orient);
        let build = BuildSettings { optimize: passes, ..BuildSettings::default() };
        assert_eq!(short_name(&build), "AAC δ 6 ε 0.2, oriented boxes, collapse");
    }

    #[test]
    fn presets_are_found_by_their_settings() {
        for preset in Preset::ALL {
            for container in ContainerKind::WITH_ORIENTED {
                let build = BuildSettings::preset(preset, ContainerKind::Aabb).for_container(container);
                assert_eq!(preset_name(&build).as_deref(), Some(preset.name()), "{container:?}");
                assert_eq!(preset_name(&BuildSettings { threshold: 31, ..build }), None);
            }
        }
        assert_eq!(preset_name(&BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() }), None);
    }

    #[test]
    fn each_value_is_read_as_it_is_written() {
        for row in SETTINGS {
            for text in row.examples() {
                let mut build = BuildSettings::default();
                row.parse(&mut build, &text).unwrap();
                assert_eq!(row.text(&build), text, "{}", row.key);
            }
        }
    }

    #[test]
    fn the_help_of_a_flag_names_every_value() {
        for row in SETTINGS {
            let help = row.flag_help();
            let (Value::One { options, .. } | Value::Any { options, .. }) = &row.value else { continue };
            for choice in options() {
                let mut words = help.split(|c: char| !(c.is_alphanumeric() || c == '-'));
                assert!(words.any(|word| word == choice.name), "{help} lacks {}", choice.name);
            }
        }
    }

    #[test]
    fn values_outside_are_refused_and_limited() {
        for row in SETTINGS {
            let mut build = BuildSettings::default();
            let Value::Number(Number { range: [_, high], set, .. }) = &row.value else { continue };
            let above = (high + 1.0).to_string();
            assert!(row.parse(&mut build, &above).unwrap_err().contains(&high.to_string()), "{}", row.key);
            set(&mut build, high + 1.0);
            limit(&mut build);
            assert_eq!(row.text(&build), high.to_string());
        }
    }
}
