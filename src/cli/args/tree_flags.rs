//! The flags of the settings of a tree, made from the rows of the catalogue. Clap's derive reads the fields of a struct, so these
//! flags implement its traits themselves.

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use crate::catalog::settings::{
    BUILDER, CONTAINER, CURVE, Given, Number, OPTIMIZE, PRESET, ROUNDS, SETTINGS, Setting, THRESHOLD, Value, parameters,
};
use crate::cli::values::{Numbers, numbers};
use bvhscope_engine::settings::BuildSettings;

/// Flags of all settings of a tree.
pub type TreeFlags = SettingFlags<true>;
/// Flags of all settings but builder and container, for commands that offer other values of these.
pub type ShapeFlags = SettingFlags<false>;

/// The values that were given by flags.
#[derive(Debug, Clone, Default)]
pub struct SettingFlags<const ALL: bool>(pub Given);

/// Settings that `--help` lists last, in this order.
static LAST: [&Setting; 4] = [&PRESET, &OPTIMIZE, &ROUNDS, &CURVE];

/// The settings in the order of `--help`.
fn rows(all: bool) -> impl Iterator<Item = &'static Setting> {
    let is_in = |list: &[&Setting], row: &Setting| list.iter().any(|other| other.key == row.key);
    let first = SETTINGS.into_iter().filter(move |row| !is_in(&LAST, row));
    first.chain(LAST).filter(move |row| all || !is_in(&[&BUILDER, &CONTAINER], row))
}

impl<const ALL: bool> Args for SettingFlags<ALL> {
    fn augment_args(command: Command) -> Command {
        rows(ALL).fold(command, |command, row| {
            let check = |text: &str| Given::default().insert(row, text).map(|()| text.to_owned());
            let flag = Arg::new(row.key).long(row.key).value_name(row.value_name).help(row.flag_help());
            command.arg(flag.value_parser(check))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const ALL: bool> FromArgMatches for SettingFlags<ALL> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Given::default();
        for row in rows(ALL) {
            if let Some(text) = matches.get_one::<String>(row.key) {
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

fn ranges() -> impl Iterator<Item = (&'static Setting, &'static Number)> {
    let used = parameters().filter(|row| (row.applies)(&BuildSettings::default()));
    used.filter_map(|row| if let Value::Number(number) = &row.value { Some((row, number)) } else { None })
}

/// The threshold is what sweeps are about.
fn default_range(row: &Setting) -> String {
    if row == &THRESHOLD { "2..=32".to_owned() } else { row.text(&BuildSettings::default()) }
}

impl Args for RangeFlags {
    fn augment_args(command: Command) -> Command {
        ranges().fold(command, |command, (row, number)| {
            let [low, high] = number.range;
            let (forms, value_name) = if number.decimals == 0 {
                ("N, A,B,C or A..B with both ends", "RANGE")
            } else {
                ("a number, or several separated by commas", "X,…")
            };
            let help = format!("{}: {forms}, within {low} to {high} [default: {}]", row.label, default_range(row));
            let flag = Arg::new(row.key).long(row.key).value_name(value_name).help(help);
            command.arg(flag.value_parser(|text: &str| numbers(number, text)))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for RangeFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let values = |(row, number): (&'static Setting, &Number)| {
            let given = matches.get_one::<Numbers>(row.key).cloned();
            Some((row, given.or_else(|| numbers(number, &default_range(row)).ok())?.0))
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
