//! Settings, one row each: those of a builder here, those of picture and overlay where their structs are. Flags, their checks and help,
//! the SETTINGS of `diff`, copied command lines, controls, limits of saved settings and lists of settings follow from the rows.
//!
//! To add a setting: its field in the struct, its row in the table beside it.

mod setting;

mod rows;

mod given;

mod stated;

#[cfg(test)]
mod check;

use bvhscope_engine::settings::{BuildSettings, Pass};

#[cfg(test)]
pub(crate) use check::{check_rows, each_other_value};
pub use given::Given;
pub use rows::{BUILDER, CONTAINER, OPTIMIZE, PRESET, SETTINGS, THRESHOLD, container_sentence};
pub use rows::{CURVE, EPSILON, ROUNDS};
pub use setting::{Choice, Limits, Number, Setting, Settings, Value, Written, limit};
pub use stated::{Stated, parameters};

/// The settings that a copied command line names, with their values.
pub fn written<T: Settings>(settings: &T) -> impl Iterator<Item = (&'static Setting<T>, String)> {
    let rows = T::rows().iter().copied().filter(|row| row.is_written(settings));
    rows.map(|row| (row, row.text(settings)))
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
    fn rows_keep_their_word() {
        check_rows::<BuildSettings>();
    }
}
