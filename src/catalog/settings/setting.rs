//! A row of the table of settings.

use bvhscope_engine::settings::BuildSettings;
use serde_json::Value as Json;

/// A setting of a builder, or a name for several of them.
pub struct Setting {
    /// Name as a flag, in the SETTINGS of `diff` and in JSON.
    pub key: &'static str,
    /// Stands for the value in the help of the flag.
    pub value_name: &'static str,
    /// Help of the flag without its default. `{}` stands for the range or the names.
    pub help: &'static str,
    /// Name in the window.
    pub label: &'static str,
    /// Effect of a change, in the window.
    pub tip: &'static str,
    /// Its values.
    pub value: Value,
    /// A build uses it.
    pub applies: fn(&BuildSettings) -> bool,
    /// A copied command line names it.
    pub is_written: fn(&BuildSettings) -> bool,
}

/// The values of a setting, with access to its field.
pub enum Value {
    /// A number.
    Number(Number),
    /// One of several named values.
    One {
        /// The values in the order in which menus list them.
        options: fn() -> Vec<Choice>,
        /// Index of the present value; `None` where it has no name.
        get: fn(&BuildSettings) -> Option<usize>,
        /// Takes the index of the new value.
        set: fn(&mut BuildSettings, usize),
    },
    /// Any of several named values.
    Any {
        /// The values in the order in which menus list them.
        options: fn() -> Vec<Choice>,
        /// The value with this index is wanted.
        get: fn(&BuildSettings, usize) -> bool,
        /// Takes the index of a value and whether it is wanted.
        set: fn(&mut BuildSettings, usize, bool),
        /// Number of the first values that the name "all" stands for.
        all: usize,
        /// Why the value with this index has no effect; `None` where it has.
        refusal: fn(&BuildSettings, usize) -> Option<&'static str>,
    },
}

/// A number in a range. At most 2²⁴ where it is whole.
pub struct Number {
    /// Symbol in formulas and short names; empty for none.
    pub symbol: &'static str,
    /// Minimum and maximum, both included.
    pub range: [f32; 2],
    /// Decimals on the slider; 0 for whole numbers.
    pub decimals: usize,
    /// The slider is logarithmic.
    pub logarithmic: bool,
    /// The present value.
    pub get: fn(&BuildSettings) -> f32,
    /// Takes the new value, which lies within the range.
    pub set: fn(&mut BuildSettings, f32),
}

/// A named value of a setting.
pub struct Choice {
    /// Name in flags and JSON.
    pub name: &'static str,
    /// Name in the window.
    pub label: &'static str,
    /// One sentence about it.
    pub tip: String,
}

impl PartialEq for Setting {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl std::fmt::Debug for Setting {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.key)
    }
}

impl Setting {
    /// Sets the value that `text` names, as flags and SETTINGS of `diff` do. Fails with the values that are expected.
    pub fn parse(&self, build: &mut BuildSettings, text: &str) -> Result<(), String> {
        match &self.value {
            Value::Number(number) => (number.set)(build, number.parse(text)?),
            Value::One { options, set, .. } => set(build, index_of(&options(), text)?),
            Value::Any { options, set, all, .. } => {
                let options = options();
                let chosen: Vec<usize> = match text {
                    "none" => Vec::new(),
                    "all" => (0..*all).collect(),
                    _ => text.split(',').map(|name| index_of(&options, name)).collect::<Result<_, _>>()?,
                };
                for index in 0..options.len() {
                    set(build, index, chosen.contains(&index));
                }
            }
        }
        Ok(())
    }

    /// `build` with another number within the range; unchanged where the setting is no number.
    #[must_use]
    pub fn with_number(&self, mut build: BuildSettings, value: f32) -> BuildSettings {
        if let Value::Number(number) = &self.value {
            (number.set)(&mut build, value);
        }
        build
    }

    /// `build` with its number `steps` of the slider's smallest steps higher, within the range.
    #[must_use]
    pub fn stepped(&self, build: BuildSettings, steps: i32) -> BuildSettings {
        let Value::Number(Number { range: [low, high], decimals, get, .. }) = &self.value else { return build };
        if steps == 0 {
            return build;
        }
        let scale = 10_f32.powi(*decimals as i32);
        let value = ((get(&build) * scale).round() + steps as f32) / scale;
        self.with_number(build, value.clamp(*low, *high))
    }

    /// The value as [`Setting::parse`] reads it. Empty where it has no name.
    pub fn text(&self, build: &BuildSettings) -> String {
        match &self.value {
            Value::Number(number) => (number.get)(build).to_string(),
            Value::One { options, get, .. } => {
                get(build).map_or_else(String::new, |index| options()[index].name.into())
            }
            Value::Any { options, get, refusal, .. } => {
                let takes_effect = |index: &usize| get(build, *index) && refusal(build, *index).is_none();
                let options = options();
                let names: Vec<_> = (0..options.len()).filter(takes_effect).map(|index| options[index].name).collect();
                if names.is_empty() { "none".to_owned() } else { names.join(",") }
            }
        }
    }

    /// The value in JSON: a number, a name or a list of names. Null where it has no name.
    pub fn json(&self, build: &BuildSettings) -> Json {
        match &self.value {
            Value::Number(Number { decimals: 0, get, .. }) => (get(build) as u32).into(),
            // An f32 with its own digits: 0.2 and not 0.20000000298023224.
            Value::Number(_) => self.text(build).parse::<f64>().map_or(Json::Null, Json::from),
            Value::One { get, .. } if get(build).is_none() => Json::Null,
            Value::One { .. } => self.text(build).into(),
            Value::Any { .. } => match self.text(build).as_str() {
                "none" => Json::Array(Vec::new()),
                names => names.split(',').collect(),
            },
        }
    }

    /// Symbol of a number in formulas and short names; `None` where it has none.
    pub fn symbol(&self) -> Option<&'static str> {
        match self.value {
            Value::Number(Number { symbol, .. }) if !symbol.is_empty() => Some(symbol),
            _ => None,
        }
    }

    /// The value as the window shows it.
    pub fn shown(&self, build: &BuildSettings) -> String {
        match &self.value {
            Value::One { options, get, .. } => {
                get(build).map_or_else(String::new, |index| options()[index].label.into())
            }
            _ => self.text(build),
        }
    }

    /// The help of the flag, with its values and its default.
    pub fn flag_help(&self) -> String {
        let values = match &self.value {
            Value::Number(Number { range: [low, high], .. }) => format!("{low} to {high}"),
            Value::One { options, .. } | Value::Any { options, .. } => {
                let names: Vec<&str> = options().iter().map(|choice| choice.name).collect();
                names.split_last().map_or_else(String::new, |(last, rest)| format!("{} or {last}", rest.join(", ")))
            }
        };
        let default = self.text(&BuildSettings::default());
        format!("{} [default: {default}]", self.help.replace("{}", &values))
    }
}

impl Number {
    /// The number that `text` holds. Fails where it is outside the range.
    pub fn parse(&self, text: &str) -> Result<f32, String> {
        let [low, high] = self.range;
        let (number, kind) = if self.decimals == 0 {
            (text.parse::<u32>().ok().map(|whole| whole as f32), "whole number")
        } else {
            (text.parse().ok(), "number")
        };
        let number = number.filter(|number| (low..=high).contains(number));
        number.ok_or_else(|| format!("a {kind} from {low} to {high} is expected"))
    }
}

#[cfg(test)]
impl Setting {
    /// Both ends of the range, or every name.
    pub(super) fn examples(&self) -> Vec<String> {
        match &self.value {
            Value::Number(Number { range, .. }) => range.map(|end| end.to_string()).into(),
            Value::One { options, .. } | Value::Any { options, .. } => {
                options().iter().map(|choice| choice.name.to_owned()).collect()
            }
        }
    }
}

/// Index of the choice with this name.
fn index_of(choices: &[Choice], name: &str) -> Result<usize, String> {
    choices.iter().position(|choice| choice.name == name).ok_or_else(|| {
        let names: Vec<&str> = choices.iter().map(|choice| choice.name).collect();
        format!("one of {} is expected", names.join(", "))
    })
}
