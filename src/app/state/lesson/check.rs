//! What must be true of measured numbers, so that a caption is: `tests < 0.5 before.tests`.

use super::numbers::Numbers;

/// A comparison of two products.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    left: Product,
    less: bool,
    right: Product,
    text: String,
}

/// A factor times a number, or the factor alone.
#[derive(Debug, Clone, PartialEq)]
struct Product {
    factor: f64,
    /// The number's name, and whether it is that of the step before.
    number: Option<(String, bool)>,
}

impl Check {
    /// Reads a check; `Err` says what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (less, (left, right)) = match (text.split_once('<'), text.split_once('>')) {
            (Some(sides), None) => (true, sides),
            (None, Some(sides)) => (false, sides),
            _ => return Err(format!("a check compares with one < or >, which '{text}' does not")),
        };
        Ok(Self { left: Product::parse(left)?, less, right: Product::parse(right)?, text: text.trim().to_owned() })
    }

    /// Whether it holds; `None` where a number that it needs is not known.
    pub fn holds(&self, now: &Numbers, before: Option<&Numbers>) -> Option<bool> {
        let (left, right) = (self.left.value(now, before)?, self.right.value(now, before)?);
        Some(if self.less { left < right } else { left > right })
    }

    /// The check as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

impl Product {
    fn parse(text: &str) -> Result<Self, String> {
        let mut product = Self { factor: 1.0, number: None };
        for word in text.split_whitespace() {
            let (name, before) = word.strip_prefix("before.").map_or((word, false), |name| (name, true));
            if let Ok(factor) = word.parse::<f64>() {
                product.factor *= factor;
            } else if Numbers::is_name(name) && product.number.is_none() {
                product.number = Some((name.to_owned(), before));
            } else {
                return Err(format!("'{word}' is no measured number, and there may be one on each side"));
            }
        }
        Ok(product)
    }

    fn value(&self, now: &Numbers, before: Option<&Numbers>) -> Option<f64> {
        let number = match &self.number {
            None => Some(1.0),
            Some((name, true)) => before?.value(name),
            Some((name, false)) => now.value(name),
        };
        Some(self.factor * number?)
    }
}
