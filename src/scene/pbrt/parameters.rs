//! The parameters of a directive: a type, a name, and numbers or texts.

use std::cell::Cell;

use super::tokens::Tokens;
use crate::budget::Budget;
use crate::scene::error::{FileLocation, LoadError, Warnings};
use crate::text::quoted;

/// Numbers of a list between two checks of the memory budget.
const MEMORY_INTERVAL: usize = 1 << 18;
/// Bytes of a number in a list, which doubles when it grows.
const BYTES_PER_NUMBER: u64 = 16;

/// The values of a parameter.
pub(super) enum Values {
    Numbers(Vec<f64>),
    /// Texts, and words such as true and false.
    Texts(Vec<String>),
}

/// A parameter as it stands in the file.
pub(super) struct Parameter {
    /// The type, as in "rgb".
    pub(super) kind: String,
    name: String,
    pub(super) values: Values,
    place: FileLocation,
    is_used: Cell<bool>,
}

impl Parameter {
    /// The place of its type and name.
    pub(super) fn place(&self) -> &FileLocation {
        &self.place
    }
}

/// The parameters of a directive.
pub(super) struct Parameters {
    list: Vec<Parameter>,
}

impl Parameters {
    /// Reads all that follow.
    pub(super) fn read(tokens: &mut Tokens) -> Result<Self, LoadError> {
        let mut list = Vec::new();
        while tokens.peek()? == Some(b'"') {
            let declared = tokens.text()?;
            let place = tokens.place();
            let mut words = declared.split_ascii_whitespace();
            let (kind, name) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
            let values = values(tokens)?;
            let (kind, name) = (kind.to_owned(), name.to_owned());
            list.push(Parameter { kind, name, values, place, is_used: Cell::new(false) });
        }
        Ok(Self { list })
    }

    /// The parameter of a name, which counts as used.
    pub(super) fn get(&self, name: &str) -> Option<&Parameter> {
        let found = self.list.iter().find(|parameter| parameter.name == name)?;
        found.is_used.set(true);
        Some(found)
    }

    /// The numbers of a parameter; `None` where there are none.
    pub(super) fn numbers(&self, name: &str) -> Option<&[f64]> {
        let found = self.list.iter().find(|parameter| parameter.name == name)?;
        let Values::Numbers(numbers) = &found.values else { return None };
        found.is_used.set(true);
        Some(numbers)
    }

    /// The first number of a parameter.
    pub(super) fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name)?.first().copied()
    }

    /// The texts of a parameter.
    pub(super) fn texts(&self, name: &str) -> Option<&[String]> {
        let found = self.list.iter().find(|parameter| parameter.name == name)?;
        let Values::Texts(texts) = &found.values else { return None };
        found.is_used.set(true);
        Some(texts)
    }

    /// The first text of a parameter.
    pub(super) fn text(&self, name: &str) -> Option<&str> {
        self.texts(name)?.first().map(String::as_str)
    }

    /// Counts the parameters that nothing has used; `owner` is in the plural, as in "shapes".
    pub(super) fn count_unused(&self, owner: &str, warnings: &mut Warnings) {
        for parameter in self.list.iter().filter(|parameter| !parameter.is_used.get()) {
            let what = format!("parameters {} of {owner} not used", quoted(&parameter.name));
            warnings.add(&what, || parameter.place.clone());
        }
    }
}

/// A single value, or those of a list.
pub(super) fn values(tokens: &mut Tokens) -> Result<Values, LoadError> {
    let is_list = tokens.skip(b'[')?;
    let is_text = |byte: u8| byte == b'"' || byte.is_ascii_alphabetic();
    if tokens.peek()?.is_some_and(is_text) {
        let mut texts = Vec::new();
        while let Some(byte) = tokens.peek()?.filter(|&byte| is_text(byte)) {
            texts.push(if byte == b'"' {
                tokens.text()?
            } else {
                String::from_utf8_lossy(tokens.word()?).into_owned()
            });
            if !is_list {
                return Ok(Values::Texts(texts));
            }
        }
        tokens.close()?;
        return Ok(Values::Texts(texts));
    }
    if !is_list {
        return Ok(Values::Numbers(vec![tokens.number()?]));
    }
    let mut numbers = Vec::new();
    while tokens.peek()?.is_some_and(|byte| byte != b']') {
        if numbers.len().is_multiple_of(MEMORY_INTERVAL) {
            let bytes = (numbers.len() as u64).saturating_mul(BYTES_PER_NUMBER);
            let checked = Budget::of_process().check("the numbers of a list", bytes);
            checked.map_err(|error| tokens.fault(error.shortage(), crate::budget::OverBudget::ADVICE))?;
        }
        numbers.push(tokens.number()?);
    }
    tokens.close()?;
    Ok(Values::Numbers(numbers))
}
