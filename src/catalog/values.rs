//! The numbers of one tree by the names of their rows.

use std::collections::BTreeMap;

use serde::de::{Deserialize, Deserializer};
use serde::ser::{Serialize, SerializeMap as _, Serializer};
use serde_json::Value;

use super::numbers::{NUMBERS, Number};
use super::reading::TreeReading;

/// The numbers of one tree, in JSON and CSV under the names of their rows. A number that does not apply has no value; one that is
/// not known is null.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Values(BTreeMap<&'static str, Value>);

impl Values {
    /// All numbers that `tree` has.
    pub fn of(tree: &TreeReading<'_>) -> Self {
        let mut values = Self::default();
        for number in NUMBERS {
            if let Some(value) = (number.get)(tree) {
                values.0.insert(number.key, value);
            }
            if let Some((key, read)) = number.spread
                && let Some(spread) = read(tree)
            {
                values.0.insert(key, spread.to_vec().into());
            }
        }
        values
    }

    /// The value as it is in JSON; `None` where the tree has no such number.
    pub fn value(&self, number: &Number) -> Option<&Value> {
        self.0.get(number.key)
    }

    /// A number that is known.
    pub fn known(&self, number: &Number) -> Option<f64> {
        self.value(number)?.as_f64()
    }

    /// A number; NaN where it is not known.
    pub fn number(&self, number: &Number) -> f64 {
        self.known(number).unwrap_or(f64::NAN)
    }

    /// A count; 0 where it is not known.
    pub fn count(&self, number: &Number) -> u64 {
        self.value(number).and_then(Value::as_u64).unwrap_or(0)
    }

    /// Fastest and slowest repetition of a time.
    pub fn spread(&self, number: &Number) -> Option<[f64; 2]> {
        let list = self.0.get(number.spread?.0)?.as_array()?;
        <[f64; 2]>::try_from(list.iter().filter_map(Value::as_f64).collect::<Vec<_>>()).ok()
    }

    /// Sets a number; NaN makes it unknown.
    pub fn set(&mut self, number: &Number, value: impl Into<Value>) {
        self.0.insert(number.key, value.into());
    }

    /// Sets fastest and slowest repetition of a time, or removes them.
    pub fn set_spread(&mut self, number: &Number, spread: Option<[f64; 2]>) {
        let Some((key, _)) = number.spread else { return };
        match spread {
            Some(spread) => self.0.insert(key, spread.to_vec().into()),
            None => self.0.remove(key),
        };
    }

    /// Removes all numbers but these and their spreads.
    pub fn keep(&mut self, numbers: &[&Number]) {
        let is_kept = |key: &str| {
            let mut kept = numbers.iter();
            kept.any(|number| number.key == key || number.spread.is_some_and(|(spread, _)| spread == key))
        };
        self.0.retain(|key, _| is_kept(key));
    }

    /// Removes a number.
    pub fn remove(&mut self, number: &Number) {
        self.0.remove(number.key);
    }
}

/// Names of all numbers and of their spreads, in the order of JSON and CSV.
pub fn keys() -> impl Iterator<Item = &'static str> {
    NUMBERS.iter().flat_map(|number| [Some(number.key), number.spread.map(|(key, _)| key)]).flatten()
}

impl Serialize for Values {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for key in keys() {
            if let Some(value) = self.0.get(key) {
                map.serialize_entry(key, value)?;
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut read = BTreeMap::<String, Value>::deserialize(deserializer)?;
        Ok(Self(keys().filter_map(|key| Some((key, read.remove(key)?))).collect()))
    }
}
