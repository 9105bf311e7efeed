//! Settings that a user names, the rest being left as it is.

use std::marker::PhantomData;

use bvhscope_engine::settings::{BuildSettings, Pass, Preset};

use super::rows::{OPTIMIZE, PRESET};
use super::setting::{Setting, Settings};

/// Values of some settings, as flags or `NAME=VALUE`.
#[derive(Debug, Clone, PartialEq)]
pub struct Given<T: 'static = BuildSettings> {
    /// Key and value, which has been parsed once.
    values: Vec<(&'static str, String)>,
    of: PhantomData<T>,
}

impl<T> Default for Given<T> {
    fn default() -> Self {
        Self { values: Vec::new(), of: PhantomData }
    }
}

impl<T: Settings> Given<T> {
    /// Adds a value. Fails where the setting has no such value.
    pub fn insert(&mut self, setting: &Setting<T>, text: &str) -> Result<(), String> {
        setting.parse(&mut T::default(), text)?;
        self.values.push((setting.key, text.to_owned()));
        Ok(())
    }

    /// Nothing is given.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The value of a setting; `None` where it is not given.
    pub fn get(&self, setting: &Setting<T>) -> Option<&str> {
        self.values.iter().find(|(key, _)| *key == setting.key).map(|(_, text)| text.as_str())
    }

    /// Changes the given settings, and what does not go with them.
    pub fn apply(&self, settings: &mut T) {
        let rest = T::rows().iter().copied().filter(|row| Some(*row) != T::base());
        for row in T::base().into_iter().chain(rest) {
            if let Some(text) = self.get(row) {
                // Parsed before, so it cannot fail.
                let _ = row.parse(settings, text);
            }
        }
        settings.settle(&|row| self.get(row).is_some());
    }

    /// The default settings with these.
    pub fn settings(&self) -> T {
        let mut settings = T::default();
        self.apply(&mut settings);
        settings
    }
}

impl Given {
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

    use bvhscope_engine::settings::BuilderKind;
    use bvhscope_engine::tree::ContainerKind;

    use super::super::rows::{BUILDER, CONTAINER, EPSILON, THRESHOLD};
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
