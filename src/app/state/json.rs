//! JSON of states that are shared or saved: only those values that differ from others.

use serde::Serialize;
use serde_json::Value;

/// `shared` as JSON, by way of text, in which a number has no more digits than it needs.
pub(in crate::app) fn plain_value(shared: &impl Serialize) -> Value {
    let text = serde_json::to_string(shared);
    text.and_then(|text| serde_json::from_str(&text)).unwrap_or_default()
}

/// The part of `value` that differs from `default`; `None` where nothing does. Objects are compared member by member where they have the
/// same members, so that the variants of an enum stay whole.
pub(in crate::app) fn difference(default: &Value, value: Value) -> Option<Value> {
    match (default, value) {
        (default, value) if *default == value => None,
        (Value::Object(default), Value::Object(value)) if default.keys().eq(value.keys()) => {
            let members = value.into_iter().filter_map(|(name, member)| {
                let changed = difference(&default[&name], member)?;
                Some((name, changed))
            });
            Some(Value::Object(members.collect()))
        }
        (_, value) => Some(value),
    }
}

/// Puts a difference back over the default.
pub(in crate::app) fn merge(value: &mut Value, difference: Value) {
    match (value, difference) {
        (Value::Object(value), Value::Object(difference)) if difference.keys().all(|name| value.contains_key(name)) => {
            for (name, member) in difference {
                merge(&mut value[&name], member);
            }
        }
        (value, difference) => *value = difference,
    }
}

/// The members of `value` that are as in `default`.
#[cfg(test)]
pub(super) fn unchanged(default: &Value, value: &Value, name: &str) -> Vec<String> {
    match (default, value) {
        (Value::Object(default), Value::Object(value)) if default.keys().eq(value.keys()) => {
            value.iter().flat_map(|(member, value)| unchanged(&default[member], value, member)).collect()
        }
        _ if default == value => vec![name.to_owned()],
        _ => Vec::new(),
    }
}
