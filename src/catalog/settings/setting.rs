//! A row of a table of settings.

use bvhscope_engine::settings::BuildSettings;
use serde_json::Value as Json;

/// A struct of settings with its table of rows.
pub trait Settings: Clone + Default + 'static {
    /// Heading of its flags in help texts.
    const HEADING: &'static str;

    /// All rows, in the order in which window, help texts and copied command lines have them.
    fn rows() -> &'static [&'static Setting<Self>];

    /// A row that names several settings and comes before the others, wherever it is given.
    fn base() -> Option<&'static Setting<Self>> {
        None
    }

    /// Changes what does not go with the rows of which `is_given` holds.
    fn settle(&mut self, _is_given: &dyn Fn(&Setting<Self>) -> bool) {}
}

/// Clamps the numbers to their ranges.
pub fn limit<T: Settings>(settings: &mut T) {
    for row in T::rows() {
        row.limit(settings);
    }
}

/// A setting in `T`, or a name for several of them.
pub struct Setting<T: 'static = BuildSettings> {
    /// Name as a flag, in the SETTINGS of `diff` and in JSON.
    pub key: &'static str,
    /// Stands for the value in the help of the flag; a switch has none.
    pub value_name: &'static str,
    /// Help of the flag without its default. `{}` stands for the range or the names.
    pub help: &'static str,
    /// Name in the window; empty for a setting without a control in a panel.
    pub label: &'static str,
    /// Effect of a change, in the window.
    pub tip: &'static str,
    /// Its values.
    pub value: Value<T>,
    /// The other settings leave it an effect.
    pub applies: fn(&T) -> bool,
    /// When a copied command line names it.
    pub written: Written<T>,
}

/// When a copied command line names a setting.
pub enum Written<T> {
    /// In every line, so that other defaults of a later version change nothing.
    Always,
    /// Where it is not the default.
    Changed,
    /// Where this holds.
    If(fn(&T) -> bool),
}

/// The values of a setting, with access to its field.
pub enum Value<T: 'static = BuildSettings> {
    /// On or off; the flag has no value and means on.
    Switch {
        /// Name beside the check box.
        name: &'static str,
        /// It is on.
        get: fn(&T) -> bool,
        /// Switches it.
        set: fn(&mut T, bool),
    },
    /// A number.
    Number(Number<T>),
    /// A number, or none for what suits the model.
    Optional {
        /// The numbers that can be given.
        limits: Limits,
        /// Name of none; empty where it cannot be named.
        none: &'static str,
        /// The present value.
        get: fn(&T) -> Option<f32>,
        /// Takes the new value, which lies within the limits.
        set: fn(&mut T, Option<f32>),
    },
    /// A smallest and a largest number, or none for what suits the model.
    Range {
        /// The numbers that can be given.
        limits: Limits,
        /// The message for what is no such range.
        expected: &'static str,
        /// Both numbers may be equal; a number alone stands for such a range.
        single: bool,
        /// The present value.
        get: fn(&T) -> Option<[f32; 2]>,
        /// Takes the new value, which lies within the limits.
        set: fn(&mut T, Option<[f32; 2]>),
    },
    /// One of several named values.
    One {
        /// The values in the order in which menus list them.
        options: fn() -> Vec<Choice>,
        /// Index of the present value; `None` where it has no name.
        get: fn(&T) -> Option<usize>,
        /// Takes the index of the new value.
        set: fn(&mut T, usize),
    },
    /// Any of several named values.
    Any {
        /// The values in the order in which menus list them.
        options: fn() -> Vec<Choice>,
        /// The value with this index is wanted.
        get: fn(&T, usize) -> bool,
        /// Takes the index of a value and whether it is wanted.
        set: fn(&mut T, usize, bool),
        /// Number of the first values that the name "all" stands for.
        all: usize,
        /// Further names, each with the list that it stands for.
        names: &'static [(&'static str, &'static str)],
        /// Why the value with this index has no effect; `None` where it has.
        refusal: fn(&T, usize) -> Option<&'static str>,
    },
}

/// A number in a range.
pub struct Number<T: 'static = BuildSettings> {
    /// Symbol in formulas and short names; empty for none.
    pub symbol: &'static str,
    /// The numbers that can be given.
    pub limits: Limits,
    /// The present value.
    pub get: fn(&T) -> f32,
    /// Takes the new value, which lies within the limits.
    pub set: fn(&mut T, f32),
}

/// The numbers that a setting takes. At most 2²⁴ where they are whole.
pub struct Limits {
    /// Minimum and maximum, both included.
    pub range: [f32; 2],
    /// Minimum and maximum of the slider.
    pub slider: [f32; 2],
    /// Decimals on the slider; 0 for whole numbers.
    pub decimals: usize,
    /// The slider is logarithmic.
    pub logarithmic: bool,
}

/// A named value of a setting.
pub struct Choice {
    /// Name in flags and JSON.
    pub name: &'static str,
    /// Name in the window.
    pub label: &'static str,
    /// One sentence about it.
    pub tip: String,
    /// Flags can name it.
    pub is_flag: bool,
    /// Names in earlier versions, which are still read.
    pub former_names: &'static [&'static str],
}

impl Choice {
    /// A value that flags can name.
    pub fn new(name: &'static str, label: &'static str, tip: impl Into<String>) -> Self {
        Self { name, label, tip: tip.into(), is_flag: true, former_names: &[] }
    }
}

impl<T> PartialEq for Setting<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl<T> std::fmt::Debug for Setting<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.key)
    }
}

impl<T: Settings> Setting<T> {
    /// Sets the value that `text` names, as flags and SETTINGS of `diff` do. Fails with the values that are expected.
    pub fn parse(&self, settings: &mut T, text: &str) -> Result<(), String> {
        match &self.value {
            Value::Switch { set, .. } => match text {
                "on" | "off" => set(settings, text == "on"),
                _ => return Err("on or off is expected".to_owned()),
            },
            Value::Number(number) => (number.set)(settings, number.limits.parse(text)?),
            Value::Optional { none, set, .. } if !none.is_empty() && text == *none => set(settings, None),
            Value::Optional { limits, none: "", set, .. } => set(settings, Some(limits.parse(text)?)),
            Value::Optional { limits, none, set, .. } => {
                set(settings, Some(limits.parse(text).map_err(|error| format!("{none}, or {error}"))?));
            }
            Value::Range { limits, expected, single, set, .. } => {
                let range = limits.parse_range(text, *single).ok_or_else(|| (*expected).to_owned())?;
                set(settings, Some(range));
            }
            Value::One { options, set, .. } => set(settings, index_of(&options(), text)?),
            Value::Any { options, set, all, names, .. } => {
                let options = options();
                let list = names.iter().find(|(name, _)| *name == text).map_or(text, |(_, list)| *list);
                let chosen: Vec<usize> = match list {
                    "none" => Vec::new(),
                    "all" => (0..*all).collect(),
                    _ => list.split(',').map(|name| index_of(&options, name)).collect::<Result<_, _>>()?,
                };
                for index in 0..options.len() {
                    set(settings, index, chosen.contains(&index));
                }
            }
        }
        Ok(())
    }

    /// `settings` with another number within the range; unchanged where the setting is no number.
    #[must_use]
    pub fn with_number(&self, mut settings: T, value: f32) -> T {
        if let Value::Number(number) = &self.value {
            (number.set)(&mut settings, value);
        }
        settings
    }

    /// `settings` with its number `steps` of the slider's smallest steps higher, within the range.
    #[must_use]
    pub fn stepped(&self, settings: T, steps: i32) -> T {
        let Value::Number(Number { limits: Limits { range: [low, high], decimals, .. }, get, .. }) = &self.value else {
            return settings;
        };
        if steps == 0 {
            return settings;
        }
        let scale = 10_f32.powi(*decimals as i32);
        let value = ((get(&settings) * scale).round() + steps as f32) / scale;
        self.with_number(settings, value.clamp(*low, *high))
    }

    /// Clamps numbers to their ranges.
    pub fn limit(&self, settings: &mut T) {
        match &self.value {
            Value::Number(Number { limits, get, set, .. }) => {
                let within = limits.clamp(get(settings));
                set(settings, within);
            }
            Value::Optional { limits, get, set, .. } => {
                let within = get(settings).map(|value| limits.clamp(value));
                set(settings, within);
            }
            Value::Range { limits, single, get, set, .. } => {
                let within = get(settings).map(|range| range.map(|end| limits.clamp(end)));
                set(settings, within.filter(|[low, high]| low < high || *single && low == high));
            }
            Value::Switch { .. } | Value::One { .. } | Value::Any { .. } => {}
        }
    }

    /// The value as [`Setting::parse`] reads it. Empty where it has no name.
    pub fn text(&self, settings: &T) -> String {
        match &self.value {
            Value::Switch { get, .. } => if get(settings) { "on" } else { "off" }.to_owned(),
            Value::Number(number) => (number.get)(settings).to_string(),
            Value::Optional { none, get, .. } => {
                get(settings).map_or_else(|| (*none).to_owned(), |value| value.to_string())
            }
            Value::Range { get, .. } => get(settings).map_or_else(String::new, |[low, high]| format!("{low}..{high}")),
            Value::One { options, get, .. } => {
                get(settings).map_or_else(String::new, |index| options()[index].name.into())
            }
            Value::Any { options, get, refusal, .. } => {
                let takes_effect = |index: &usize| get(settings, *index) && refusal(settings, *index).is_none();
                let options = options();
                let names: Vec<_> = (0..options.len()).filter(takes_effect).map(|index| options[index].name).collect();
                if names.is_empty() { "none".to_owned() } else { names.join(",") }
            }
        }
    }

    /// The value in JSON: a number, a name or a list of names. Null where it has no name.
    pub fn json(&self, settings: &T) -> Json {
        match &self.value {
            Value::Number(Number { limits: Limits { decimals: 0, .. }, get, .. }) => (get(settings) as u32).into(),
            // An f32 with its own digits: 0.2 and not 0.20000000298023224.
            Value::Number(_) => self.text(settings).parse::<f64>().map_or(Json::Null, Json::from),
            Value::Any { .. } => match self.text(settings).as_str() {
                "none" => Json::Array(Vec::new()),
                names => names.split(',').collect(),
            },
            _ => Some(self.text(settings)).filter(|text| !text.is_empty()).map_or(Json::Null, Json::from),
        }
    }

    /// Symbol of a number in formulas and short names; `None` where it has none.
    pub const fn symbol(&self) -> Option<&'static str> {
        match self.value {
            Value::Number(Number { symbol, .. }) if !symbol.is_empty() => Some(symbol),
            _ => None,
        }
    }

    /// The value as the window shows it.
    pub fn shown(&self, settings: &T) -> String {
        match &self.value {
            Value::One { options, get, .. } => {
                get(settings).map_or_else(String::new, |index| options()[index].label.into())
            }
            _ => self.text(settings),
        }
    }

    /// A copied command line names it.
    pub fn is_written(&self, settings: &T) -> bool {
        match self.written {
            Written::Always => true,
            Written::Changed => self.text(settings) != self.text(&T::default()),
            Written::If(holds) => holds(settings),
        }
    }

    /// The help of the flag, with its values and its default, unless that is none or off.
    pub fn flag_help(&self) -> String {
        let values = match &self.value {
            Value::Number(Number { limits, .. }) | Value::Optional { limits, .. } | Value::Range { limits, .. } => {
                let [low, high] = limits.range;
                format!("{low} to {high}")
            }
            Value::One { options, .. } | Value::Any { options, .. } => {
                let options = options();
                let names: Vec<&str> =
                    options.iter().filter(|choice| choice.is_flag).map(|choice| choice.name).collect();
                names.split_last().map_or_else(String::new, |(last, rest)| format!("{} or {last}", rest.join(", ")))
            }
            Value::Switch { .. } => String::new(),
        };
        let help = self.help.replace("{}", &values);
        let default = self.text(&T::default());
        if default.is_empty() || matches!(self.value, Value::Switch { .. }) || help.ends_with(']') {
            return help;
        }
        format!("{help} [default: {default}]")
    }
}

impl Limits {
    /// Whole numbers of this range, on a linear slider.
    pub const fn whole(low: u32, high: u32) -> Self {
        Self::decimal(low as f32, high as f32, 0)
    }

    /// Numbers of this range, on a linear slider with so many decimals.
    pub const fn decimal(low: f32, high: f32, decimals: usize) -> Self {
        Self { range: [low, high], slider: [low, high], decimals, logarithmic: false }
    }

    /// The same on a logarithmic slider.
    #[must_use]
    pub const fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }

    /// The same with a slider of a part of the range.
    #[must_use]
    pub const fn slider(self, low: f32, high: f32) -> Self {
        Self { slider: [low, high], ..self }
    }

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

    /// The range `A..B` or `A..=B` that `text` holds, or `A` where it may be `single`; `None` where it is none.
    fn parse_range(&self, text: &str, single: bool) -> Option<[f32; 2]> {
        let (low, high) = match text.split_once("..") {
            Some((low, high)) => (low, high.strip_prefix('=').unwrap_or(high)),
            None if single => (text, text),
            None => return None,
        };
        let [low, high] = [self.parse(low).ok()?, self.parse(high).ok()?];
        (low < high || single && low == high).then_some([low, high])
    }

    /// The nearest number within the range.
    fn clamp(&self, value: f32) -> f32 {
        let [low, high] = self.range;
        value.clamp(low, high)
    }
}

#[cfg(test)]
impl<T: Settings> Setting<T> {
    /// Both ends of the range, or every name.
    pub(crate) fn examples(&self) -> Vec<String> {
        match &self.value {
            Value::Switch { .. } => ["on", "off"].map(str::to_owned).into(),
            Value::Number(Number { limits, .. }) | Value::Optional { limits, .. } => {
                limits.range.map(|end| end.to_string()).into()
            }
            Value::Range { limits: Limits { range: [low, high], .. }, .. } => vec![format!("{low}..{high}")],
            Value::One { options, .. } | Value::Any { options, .. } => {
                let options = options();
                options.iter().filter(|choice| choice.is_flag).map(|choice| choice.name.to_owned()).collect()
            }
        }
    }
}

/// Index of the choice with this name.
fn index_of(choices: &[Choice], name: &str) -> Result<usize, String> {
    let is_named = |choice: &Choice| choice.is_flag && (choice.name == name || choice.former_names.contains(&name));
    choices.iter().position(is_named).ok_or_else(|| {
        let names: Vec<&str> = choices.iter().filter(|choice| choice.is_flag).map(|choice| choice.name).collect();
        format!("one of {} is expected", names.join(", "))
    })
}
