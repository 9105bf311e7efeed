//! The flags of the settings of a tree, made from the rows of the catalogue. Clap's derive reads the fields of a struct, so these
//! flags implement its traits themselves.

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use crate::catalog::settings::{BUILDER, CONTAINER, CURVE, Given, OPTIMIZE, PRESET, ROUNDS, SETTINGS, Setting};

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
