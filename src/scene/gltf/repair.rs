//! Makes the JSON of a document fit for the crate `gltf`, which panics where an index points nowhere, a code is unknown or a field
//! is missing: each of them is removed or replaced as the table demands, and counted with its place. A value of a wrong kind is
//! refused with its place, the value found and the kind expected.
//!
//! `4`, `4.0` and `4e0` are the same whole number, and null stands for a missing value.

use std::collections::HashMap;
use std::fmt::{Display, Write as _};
use std::path::Path;

use serde_json::{Map, Value, json};

use super::table::{DOCUMENT, EMPTY_ENTRIES, LIGHTS_LIST, Lost, POSITION, Row, Rule, Target, extension};
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, HEAVY_STEPS};

/// Repairs a document and removes fields that are not in [`DOCUMENT`]. Afterwards each of [`EMPTY_ENTRIES`] is the last of its
/// list. `check` sees the document once its first row is known to be sound.
pub(super) fn repair(
    file: &Path,
    document: &mut Map<String, Value>,
    check: impl FnOnce(&Map<String, Value>, &mut Warnings) -> Result<(), LoadError>,
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let length = |name: &str| document.get(name).and_then(Value::as_array).map_or(0, Vec::len);
    let mut lengths: HashMap<&str, usize> = DOCUMENT.iter().map(|(name, _)| (*name, length(name))).collect();
    let lights = document.get("extensions").and_then(|all| all.get(extension::LIGHTS)?.get(LIGHTS_LIST)?.as_array());
    lengths.insert(LIGHTS_LIST, lights.map_or(0, Vec::len));
    let mut walk = Walk { file, lengths, path: Vec::new(), visited: 0, warnings, token };
    let (first, others) = DOCUMENT.split_at(1);
    walk.fields(first, document)?;
    check(document, walk.warnings)?;
    document.retain(|name, _| DOCUMENT.iter().any(|row| row.0 == name));
    walk.fields(others, document)?;
    for (list, _) in EMPTY_ENTRIES {
        if let Value::Array(entries) = document.entry(list).or_insert_with(|| json!([])) {
            entries.push(empty_entry(list));
        }
    }
    // The crate wants a URI, or a buffer view with a type.
    for image in document.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Value::Object(image) = image {
            let wanted = if image.contains_key("bufferView") { "mimeType" } else { "uri" };
            image.entry(wanted).or_insert_with(|| "".into());
        }
    }
    Ok(())
}

/// The entry that stands for unusable ones of a list.
fn empty_entry(list: &str) -> Value {
    let text = EMPTY_ENTRIES.iter().find(|entry| entry.0 == list).map_or("{}", |entry| entry.1);
    serde_json::from_str(text).unwrap_or_default()
}

/// The fate of a value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    Kept,
    /// The field or the item is removed.
    Removed,
    /// The entry around it cannot be read.
    OwnerLost,
}

/// A step of the path to a value.
enum PathPart {
    Field(String),
    Item(usize),
}

struct Walk<'a> {
    file: &'a Path,
    /// Number of entries of each top-level list.
    lengths: HashMap<&'static str, usize>,
    path: Vec<PathPart>,
    /// Number of values so far.
    visited: usize,
    warnings: &'a mut Warnings,
    token: &'a CancelToken,
}

impl Walk<'_> {
    /// Counts a warning about the present value.
    fn warn(&mut self, warning: &str, detail: impl Display) {
        let path = &self.path;
        self.warnings.add(warning, || FileLocation::in_json(shown(path), detail));
    }

    /// The refusal of the present value.
    fn wrong(&self, problem: String) -> LoadError {
        let place = if self.path.is_empty() { "the outermost object".to_owned() } else { shown(&self.path) };
        LoadError::at(self.file, FileLocation::Json(place), problem, "export the model again")
    }

    fn value(&mut self, rule: &Rule, value: &mut Value) -> Result<Fate, LoadError> {
        self.token.check_every(HEAVY_STEPS, self.visited)?;
        self.visited = self.visited.wrapping_add(1);
        match (rule, &mut *value) {
            (Rule::Needed(rule), value) => self.value(rule, value),
            (Rule::Present, value) => {
                *value = json!({});
                Ok(Fate::Kept)
            }
            (Rule::Index(_) | Rule::Code(..) | Rule::Whole | Rule::Set, Value::Number(_))
            | (Rule::Index(_) | Rule::Code(..) | Rule::Word(..), Value::Null) => self.whole(rule, value),
            (Rule::Label, Value::Number(number)) => {
                *value = Value::String(number.to_string());
                Ok(Fate::Kept)
            }
            (Rule::Word(words, lost, warning), Value::String(word)) => {
                let detail = quoted(&*word);
                Ok(if words.contains(&word.as_str()) { Fate::Kept } else { self.unknown(*lost, warning, &detail) })
            }
            (Rule::Numbers(count), Value::Array(items)) => {
                if items.len() != *count {
                    return Err(self.wrong(format!("has {} numbers instead of {count}", items.len())));
                }
                self.list(&Rule::Number, items)
            }
            (Rule::List(rule), Value::Array(items)) => self.list(rule, items),
            (Rule::Object(rows), Value::Object(fields)) => {
                fields.retain(|name, _| rows.iter().any(|row| row.0 == name));
                self.fields(rows, fields)
            }
            (Rule::Extensions(rows), Value::Object(fields)) => {
                fields.retain(|name, value| {
                    let is_known = rows.iter().any(|row| row.0 == name);
                    if !is_known && !value.is_null() {
                        self.warn(&format!("uses of the extension {} ignored", quoted(name)), "");
                    }
                    is_known
                });
                self.fields(rows, fields)
            }
            (Rule::Extensions(_), _) => Ok(Fate::Removed),
            (Rule::Attributes(target), Value::Object(fields)) => self.attributes(target, fields),
            (Rule::Raw, _)
            | (Rule::Text | Rule::Label, Value::String(_))
            | (Rule::Flag, Value::Bool(_))
            | (Rule::Number, Value::Number(_)) => Ok(Fate::Kept),
            _ => {
                let found = match value {
                    Value::String(text) => format!("the text {}", quoted(&*text)),
                    Value::Array(_) => "a list".to_owned(),
                    Value::Object(_) => "an object".to_owned(),
                    scalar => scalar.to_string(),
                };
                Err(self.wrong(format!("is {found} instead of {}", expected(rule))))
            }
        }
    }

    /// A whole number, or null for a missing one.
    fn whole(&mut self, rule: &Rule, value: &mut Value) -> Result<Fate, LoadError> {
        // A floating-point number above 2^53 may stand for several whole numbers.
        const EXACT: f64 = 9_007_199_254_740_992.0;
        let real = value.as_f64().filter(|number| number.fract() == 0.0 && (0.0..=EXACT).contains(number));
        let number = value.as_u64().or(real.map(|number| number as u64));
        if number.is_none() && !value.is_null() {
            return Err(self.wrong(format!("is {value} instead of {}", expected(rule))));
        }
        *value = number.into();
        Ok(match (rule, number) {
            (Rule::Index(target), _) => self.index(target, value),
            (Rule::Code(codes, ..), Some(code)) if codes.contains(&code) => Fate::Kept,
            (Rule::Code(_, lost, warning) | Rule::Word(_, lost, warning), _) => self.unknown(*lost, warning, &*value),
            (Rule::Set, Some(set)) => {
                *value = set.min(u32::MAX.into()).into();
                Fate::Kept
            }
            _ => Fate::Kept,
        })
    }

    /// Counts a code or a word that the specification does not have.
    fn unknown(&mut self, lost: Lost, warning: &str, value: &dyn Display) -> Fate {
        let field = match self.path.last() {
            Some(PathPart::Field(name)) => name.clone(),
            _ => String::new(),
        };
        self.warn(warning, format_args!("unknown {field} {value}"));
        if lost == Lost::Owner { Fate::OwnerLost } else { Fate::Removed }
    }

    fn index(&mut self, target: &Target, value: &mut Value) -> Fate {
        let Target { list, lost, warning } = *target;
        let length = self.lengths.get(list).copied().unwrap_or(0);
        match value.as_u64() {
            Some(index) if index < length as u64 => return Fate::Kept,
            Some(index) => self.warn(warning, format_args!("{list}[{index}] does not exist, there are {length}")),
            None => self.warn(warning, "is missing"),
        }
        match lost {
            Lost::Field => Fate::Removed,
            Lost::Owner => Fate::OwnerLost,
            Lost::Empty => {
                *value = length.into();
                Fate::Kept
            }
        }
    }

    fn list(&mut self, rule: &Rule, items: &mut Vec<Value>) -> Result<Fate, LoadError> {
        let top = match &self.path[..] {
            [PathPart::Field(name)] => Some(name.clone()),
            _ => None,
        };
        let (mut index, mut result) = (0_usize, Ok(Fate::Kept));
        items.retain_mut(|item| {
            if result != Ok(Fate::Kept) {
                return true;
            }
            self.path.push(PathPart::Item(index));
            index = index.saturating_add(1);
            let fate = if item.is_null() && !matches!(rule, Rule::Present) {
                Err(self.wrong(format!("is null instead of {}", expected(rule))))
            } else {
                self.value(rule, item)
            };
            self.path.pop();
            match fate {
                Ok(Fate::Removed) => return false,
                Ok(Fate::OwnerLost) => match &top {
                    // Indices point to entries of top-level lists, so these stay where they are.
                    Some(list) => *item = empty_entry(list),
                    None if item.is_object() => *item = json!({"attributes": {}, "extensions": {extension::LOST: {}}}),
                    None => result = fate,
                },
                Ok(Fate::Kept) | Err(_) => result = fate,
            }
            true
        });
        result
    }

    /// The fields of an object, those that are needed in any case.
    fn fields(&mut self, rows: &[Row], fields: &mut Map<String, Value>) -> Result<Fate, LoadError> {
        for (name, rule) in rows {
            if fields.get(*name).is_some_and(Value::is_null) {
                fields.remove(*name);
            }
            if let Rule::Needed(rule) = rule {
                fields.entry(*name).or_insert_with(|| match rule {
                    Rule::Object(_) | Rule::Attributes(_) => json!({}),
                    Rule::List(_) => json!([]),
                    Rule::Whole => json!(0),
                    _ => Value::Null,
                });
            }
            let Some(value) = fields.get_mut(*name) else { continue };
            self.path.push(PathPart::Field((*name).to_owned()));
            let fate = self.value(rule, value);
            self.path.pop();
            match fate? {
                Fate::Kept => {}
                Fate::Removed => drop(fields.remove(*name)),
                Fate::OwnerLost => return Ok(Fate::OwnerLost),
            }
        }
        Ok(Fate::Kept)
    }

    fn attributes(&mut self, target: &Target, fields: &mut Map<String, Value>) -> Result<Fate, LoadError> {
        let mut result = Ok(Fate::Kept);
        fields.retain(|name, value| {
            if !is_semantic(name) {
                // Names of applications start with an underscore, those of extensions with their prefix and a colon.
                if !name.starts_with('_') && !name.contains(':') {
                    self.warn("attributes of unknown names ignored", quoted(name));
                }
                return false;
            }
            if value.is_null() {
                return false;
            }
            self.path.push(PathPart::Field(name.clone()));
            let rule = Rule::Index(if name == "POSITION" { POSITION } else { *target });
            let fate = self.value(&rule, value);
            self.path.pop();
            let is_kept = fate == Ok(Fate::Kept);
            if matches!(fate, Ok(Fate::OwnerLost) | Err(_)) && result == Ok(Fate::Kept) {
                result = fate;
            }
            is_kept
        });
        result
    }
}

/// A path as in `nodes[3].mesh`.
fn shown(path: &[PathPart]) -> String {
    let mut text = String::new();
    for step in path {
        let _ = match step {
            PathPart::Field(name) if text.is_empty() => write!(text, "{name}"),
            PathPart::Field(name) => write!(text, ".{name}"),
            PathPart::Item(index) => write!(text, "[{index}]"),
        };
    }
    text
}

fn expected(rule: &Rule) -> &'static str {
    match rule {
        Rule::Needed(rule) => expected(rule),
        Rule::Index(_) | Rule::Code(..) | Rule::Whole | Rule::Set => "a whole number of at least 0",
        Rule::Number => "a number",
        Rule::Word(..) | Rule::Text | Rule::Label => "a text",
        Rule::Flag => "true or false",
        Rule::Present | Rule::Raw => "a value",
        Rule::Numbers(_) | Rule::List(_) => "a list",
        Rule::Object(_) | Rule::Extensions(_) | Rule::Attributes(_) => "an object",
    }
}

/// Whether an attribute has a name of the specification.
fn is_semantic(name: &str) -> bool {
    let is_set = |prefix: &str| name.strip_prefix(prefix).is_some_and(|set| set.parse::<u32>().is_ok());
    matches!(name, "POSITION" | "NORMAL" | "TANGENT")
        || ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"].into_iter().any(is_set)
}
