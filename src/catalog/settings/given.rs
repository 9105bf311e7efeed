//! Settings that a user names, the rest being left as it is.

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Preset};
use bvhscope_engine::tree::ContainerKind;

use super::rows::{BUILDER, CONTAINER, OPTIMIZE, PRESET, SETTINGS};
use super::setting::Setting;

/// Values of some settings, as flags or `NAME=VALUE`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Given {
    /// Key and value, which has been parsed once.
    values: Vec<(&'static str, String)>,
}

impl Given {
    /// Adds a value. Fails where the setting has no such value.
    pub fn insert(&mut self, setting: &Setting, text: &str) -> Result<(), String> {
        setting.parse(&mut BuildSettings::default(), text)?;
        self.values.push((setting.key, text.to_owned()));
        Ok(())
    }

    /// Nothing is given.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The value of a setting; `None` where it is not given.
    pub fn get(&self, setting: &Setting) -> Option<&str> {
        self.values.iter().find(|(key, _)| *key == setting.key).map(|(_, text)| text.as_str())
    }

    /// Changes the given settings of `build`. A preset comes first, wherever it is on the command line. Where a given setting is of AAC only and
    /// no builder is given, AAC is taken; where builder and container exclude each other, the one that is not given is replaced.
    pub fn apply(&self, build: &mut BuildSettings) {
        let rest = SETTINGS.into_iter().filter(|row| row.key != PRESET.key);
        for row in std::iter::once(&PRESET).chain(rest) {
            if let Some(text) = self.get(row) {
                // Parsed before, so it cannot fail.
                let _ = row.parse(build, text);
            }
        }
        let [has_builder, has_container] = [&BUILDER, &CONTAINER].map(|row| self.get(row).is_some());
        let aac = BuildSettings { builder: BuilderKind::Aac, ..*build };
        let of_aac = |row: &&Setting| self.get(row).is_some() && !(row.applies)(build) && (row.applies)(&aac);
        if !has_builder && SETTINGS.into_iter().any(|row| of_aac(&row)) {
            build.builder = BuilderKind::Aac;
        }
        if build.refusal(0).is_some() {
            match (has_builder, has_container) {
                (true, false) => build.container = ContainerKind::Aabb,
                (false, true) => build.builder = BuilderKind::Aac,
                _ => {}
            }
        }
    }

    /// The default settings with these.
    pub fn settings(&self) -> BuildSettings {
        let mut build = BuildSettings::default();
        self.apply(&mut build);
        build
    }

    /// The preset, where nothing else is given.
    pub fn only_preset(&self) -> Option<Preset> {
        let name = self.get(&PRESET).filter(|_| self.values.len() == 1)?;
        Preset::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// A given pass that works on boxes only, if there is one.
    pub fn pass_for_boxes(&self) -> Option<Pass> {
        self.get(&OPTIMIZE)?;
        self.settings().optimize.iter().find(|pass| pass.boxes_only())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::super::{EPSILON, THRESHOLD};
    use super::*;

    fn given(values: &[(&Setting, &str)]) -> Given {
        let mut given = Given::default();
        for (setting, text) in values {
            given.insert(setting, text).unwrap();
        }
        given
    }

    #[test]
    fn a_preset_is_the_base_of_the_others() {
        let hq = BuildSettings::preset(Preset::Hq, ContainerKind::Sphere);
        let values = given(&[(&THRESHOLD, "20"), (&CONTAINER, "sphere"), (&PRESET, "hq")]);
        assert_eq!(values.settings(), BuildSettings { threshold: 20, ..hq });
    }

    #[test]
    fn what_is_given_decides_about_the_rest() {
        let lbvh = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
        let applied = |given: Given, mut build: BuildSettings| {
            given.apply(&mut build);
            (build.builder, build.container)
        };
        assert_eq!(applied(given(&[(&EPSILON, "0.1")]), lbvh).0, BuilderKind::Aac);
        assert_eq!(applied(given(&[(&EPSILON, "0.1"), (&BUILDER, "lbvh")]), lbvh).0, BuilderKind::Lbvh);
        let spheres = BuildSettings { container: ContainerKind::Sphere, ..BuildSettings::default() };
        let boxes = (BuilderKind::BinnedSah, ContainerKind::Aabb);
        assert_eq!(applied(given(&[(&BUILDER, "binned-sah")]), spheres), boxes);
        let binned = BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() };
        assert_eq!(applied(given(&[(&CONTAINER, "sphere")]), binned), (BuilderKind::Aac, ContainerKind::Sphere));
    }
}
