//! Settings as rows of JSON and CSV state them.

use std::collections::BTreeMap;

use bvhscope_engine::settings::BuildSettings;
use serde::de::{Deserialize, Deserializer};
use serde::ser::{Serialize, SerializeMap as _, Serializer};
use serde_json::Value as Json;

use super::rows::{BUILDER, CONTAINER, PRESET, SETTINGS};
use super::setting::{Setting, Value};

/// The settings of a build under their keys. Those that the build does not use are absent, and of a tree from a file all.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stated(BTreeMap<&'static str, Json>);

/// The settings that rows state by their keys: all but builder, container and preset, for which rows have fields of their own.
pub fn parameters() -> impl Iterator<Item = &'static Setting> {
    SETTINGS.into_iter().filter(|row| ![&BUILDER, &CONTAINER, &PRESET].contains(row))
}

impl Stated {
    /// The settings that a build with `build` uses.
    pub fn of(build: &BuildSettings) -> Self {
        let used = parameters().filter(|row| (row.applies)(build));
        Self(used.map(|row| (row.key, row.json(build))).collect())
    }

    /// The value of a number; `None` where it is not stated.
    pub fn number(&self, setting: &Setting) -> Option<f64> {
        self.0.get(setting.key)?.as_f64()
    }

    /// The value as flags take it; `None` where it is not stated.
    pub fn text(&self, setting: &Setting) -> Option<String> {
        self.0.get(setting.key).map(text_of)
    }

    /// All stated settings with their values as flags take them.
    pub fn all(&self) -> impl Iterator<Item = (&'static Setting, String)> {
        parameters().filter_map(|row| Some((row, self.text(row)?)))
    }

    /// The numbers with a symbol: `δ 6`, `ε 0.2`.
    pub fn by_symbol(&self) -> Vec<String> {
        self.all().filter_map(|(row, text)| Some(format!("{} {text}", row.symbol()?))).collect()
    }

    /// Names of the values that are not the defaults: `hilbert`, `collapse,reinsert`.
    pub fn by_name(&self) -> Vec<String> {
        let defaults = BuildSettings::default();
        let named =
            self.all().filter(|(row, text)| !matches!(row.value, Value::Number(_)) && *text != row.text(&defaults));
        named.map(|(_, text)| text).collect()
    }

    /// Sets the stated settings of `build`. Values that do not exist leave it as it is.
    pub fn apply(&self, build: &mut BuildSettings) {
        for (row, text) in self.all() {
            let _ = row.parse(build, &text);
        }
    }

    /// The same with another value, as flags take it. One that does not exist leaves it as it is.
    #[must_use]
    pub fn with(mut self, setting: &Setting, text: &str) -> Self {
        let mut build = BuildSettings::default();
        if setting.parse(&mut build, text).is_ok() {
            self.0.insert(setting.key, setting.json(&build));
        }
        self
    }
}

fn text_of(value: &Json) -> String {
    match value {
        Json::String(name) => name.clone(),
        Json::Array(names) if names.is_empty() => "none".to_owned(),
        Json::Array(names) => names.iter().map(text_of).collect::<Vec<_>>().join(","),
        // As f32 are written: 0, not 0.0.
        Json::Number(number) => number.as_f64().map_or_else(|| number.to_string(), |number| number.to_string()),
        other => other.to_string(),
    }
}

impl Serialize for Stated {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for row in parameters() {
            if let Some(value) = self.0.get(row.key) {
                map.serialize_entry(row.key, value)?;
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut read = BTreeMap::<String, Json>::deserialize(deserializer)?;
        Ok(Self(parameters().filter_map(|row| Some((row.key, read.remove(row.key)?))).collect()))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use bvhscope_engine::settings::{BuilderKind, Preset};
    use bvhscope_engine::tree::ContainerKind;

    use super::*;

    #[test]
    fn a_build_is_made_again_from_what_is_stated() {
        for (row, option) in parameters().flat_map(|row| row.examples().into_iter().map(move |text| (row, text))) {
            let mut build = BuildSettings::preset(Preset::Finest, ContainerKind::Aabb);
            row.parse(&mut build, &option).unwrap();
            let json = serde_json::to_string(&Stated::of(&build)).unwrap();
            let mut again = BuildSettings::default();
            serde_json::from_str::<Stated>(&json).unwrap().apply(&mut again);
            assert_eq!(Stated::of(&again), Stated::of(&build), "{} {option}: {json}", row.key);
        }
    }

    #[test]
    fn settings_that_a_build_does_not_use_are_absent() {
        let build = BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() };
        assert_eq!(serde_json::to_string(&Stated::of(&build)).unwrap(), r#"{"optimize":[]}"#);
        let text = serde_json::to_string(&Stated::of(&BuildSettings::default())).unwrap();
        assert_eq!(text, r#"{"threshold":6,"epsilon":0.2,"curve":"morton","optimize":[]}"#);
    }
}
