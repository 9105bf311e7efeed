//! Flags of settings, made from the rows of their tables. Clap's derive reads the fields of a struct, so these flags implement its
//! traits themselves.

use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};

use crate::catalog::settings::{
    BUILDER, CONTAINER, Given, Limits, Number, Setting, Settings, THRESHOLD, Value, parameters,
};
use crate::cli::values::{Numbers, numbers};
use bvhscope_engine::settings::BuildSettings;

/// Flags of all settings but builder and container, for commands that offer other values of these.
pub type ShapeFlags = SettingFlags<BuildSettings, false>;

/// The values of settings that were given by flags: of all of them, or of all but builder and container.
#[derive(Debug, Clone)]
pub struct SettingFlags<T: Settings, const ALL: bool = true>(pub Given<T>);

/// The settings that have flags.
fn rows<T: Settings>(all: bool) -> impl Iterator<Item = &'static Setting<T>> {
    let others = [BUILDER.key, CONTAINER.key];
    T::rows().iter().copied().filter(move |row| all || !others.contains(&row.key))
}

fn flag<T: Settings>(row: &'static Setting<T>) -> Arg {
    let flag = Arg::new(row.key).long(row.key).help(row.flag_help()).help_heading(T::HEADING);
    if let Value::Switch { .. } = row.value {
        return flag.action(ArgAction::SetTrue);
    }
    let check = |text: &str| Given::default().insert(row, text).map(|()| text.to_owned());
    // A value with a minus is one, if a wrong one, and no flag.
    let has_minus = match &row.value {
        Value::Range { .. } => true,
        Value::Optional { limits, .. } | Value::Number(Number { limits, .. }) => limits.range[0] < 0.0,
        _ => false,
    };
    flag.value_name(row.value_name).allow_hyphen_values(has_minus).value_parser(check)
}

impl<T: Settings, const ALL: bool> Args for SettingFlags<T, ALL> {
    fn augment_args(command: Command) -> Command {
        rows::<T>(ALL).fold(command, |command, row| command.arg(flag(row)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<T: Settings, const ALL: bool> FromArgMatches for SettingFlags<T, ALL> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Given::default();
        for row in rows::<T>(ALL) {
            let text = match row.value {
                Value::Switch { .. } => matches.get_flag(row.key).then_some("on"),
                _ => matches.get_one::<String>(row.key).map(String::as_str),
            };
            if let Some(text) = text {
                given.insert(row, text).map_err(|error| clap::Error::raw(ErrorKind::ValueValidation, error))?;
            }
        }
        Ok(Self(given))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Flags of `sweep`: values of each number that the default builder uses. The threshold varies fastest.
#[derive(Debug, Clone)]
pub struct RangeFlags(pub Vec<(&'static Setting, Vec<f32>)>);

fn ranges() -> impl Iterator<Item = (&'static Setting, &'static Limits)> {
    let used = parameters().filter(|row| (row.applies)(&BuildSettings::default()));
    used.filter_map(|row| if let Value::Number(number) = &row.value { Some((row, &number.limits)) } else { None })
}

/// The threshold is what sweeps are about.
fn default_range(row: &Setting) -> String {
    if row == &THRESHOLD { "2..=32".to_owned() } else { row.text(&BuildSettings::default()) }
}

impl Args for RangeFlags {
    fn augment_args(command: Command) -> Command {
        ranges().fold(command, |command, (row, limits)| {
            let [low, high] = limits.range;
            let (forms, value_name) = if limits.decimals == 0 {
                ("N, A,B,C or A..B with both ends", "RANGE")
            } else {
                ("a number, or several separated by commas", "X,…")
            };
            let help = format!("{}: {forms}, within {low} to {high} [default: {}]", row.label, default_range(row));
            let flag = Arg::new(row.key).long(row.key).value_name(value_name).help(help);
            command.arg(flag.value_parser(|text: &str| numbers(limits, text)))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for RangeFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let values = |(row, limits): (&'static Setting, &Limits)| {
            let given = matches.get_one::<Numbers>(row.key).cloned();
            Some((row, given.or_else(|| numbers(limits, &default_range(row)).ok())?.0))
        };
        let mut values: Vec<_> = ranges().filter_map(values).collect();
        values.reverse();
        Ok(Self(values))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
