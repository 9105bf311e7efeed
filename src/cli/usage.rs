//! Output of clap: help, version, and errors about the command line.

use std::ffi::OsString;
use std::io::{IsTerminal as _, Write as _};

use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::console::{self, Output, note};
use crate::text::{printable, without_middle};

/// Prints `error`, which may also be the help or the version that was asked for, and returns the exit code.
pub fn print(mut error: clap::Error) -> u8 {
    escape(&mut error);
    drop_tip_about_values(&mut error);
    explain_absence(&mut error);
    let code = u8::try_from(error.exit_code()).unwrap_or(2);
    if error.use_stderr() {
        // Only on a terminal it has colours, and no reader that may be slow.
        if !(std::io::stderr().is_terminal() && error.print().is_ok()) {
            note(error.render().to_string().trim_end());
        }
        return code;
    }
    if std::io::stdout().is_terminal() && error.print().is_ok() {
        return code;
    }
    let mut out = Output;
    let printed = out.write_all(error.render().to_string().as_bytes()).and_then(|()| out.finish());
    match printed {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            note(format_args!("bvhscope: this cannot be printed: {error}"));
            1
        }
        _ => code,
    }
}

/// Bytes of the beginning and of the end of a long message that are kept: it may repeat an argument of any length.
pub const KEPT_OF_MESSAGE: [usize; 2] = [2_000, 500];

/// An error with a message of our own, as clap shows it.
pub fn error(mut command: clap::Command, kind: clap::error::ErrorKind, text: &str) -> clap::Error {
    command.error(kind, console::printable_lines(&without_middle(text, KEPT_OF_MESSAGE)))
}

/// Flags of the settings of a tree that commands lack, because they measure all values, and the tip in place of each.
const ABSENT: [(&str, &[&str], &str); 2] = [
    ("compare", &["--builder", "--preset"], "compare measures all builders and presets; bench measures one"),
    (
        "sweep",
        &["--builder", "--preset"],
        "sweep measures AAC with the thresholds of --threshold; compare measures all builders",
    ),
];

/// Name of the command that the arguments name; anything else where they name none.
pub fn given_name() -> OsString {
    std::env::args_os().nth(1).unwrap_or_default()
}

/// Adds a tip about a flag that other commands have.
fn explain_absence(error: &mut clap::Error) {
    let Some(ContextValue::String(flag)) = error.get(ContextKind::InvalidArg) else { return };
    let command = given_name();
    let known = ABSENT.iter().find(|(name, flags, _)| command == *name && flags.contains(&flag.as_str()));
    if let Some((.., tip)) = known.filter(|_| error.kind() == ErrorKind::UnknownArgument) {
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![(*tip).into()]));
    }
}

/// Drops the tip to pass an unknown flag as a value behind `--`: no value here begins with a dash.
fn drop_tip_about_values(error: &mut clap::Error) {
    if let Some(ContextValue::StyledStrs(tips)) = error.get(ContextKind::Suggested) {
        let kept = tips.iter().filter(|tip| !tip.to_string().starts_with("to pass ")).cloned().collect();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(kept));
    }
}

/// Bytes of the beginning and of the end of a long text that are kept of what was given.
const KEPT_BYTES: [usize; 2] = [200, 50];

fn shown(text: &str) -> String {
    printable(&without_middle(text, KEPT_BYTES)).into_owned()
}

/// Escapes and shortens what was given on the command line, and may drive the terminal that it is shown on.
fn escape(error: &mut clap::Error) {
    let escaped: Vec<(ContextKind, ContextValue)> = error
        .context()
        .filter_map(|(kind, value)| match value {
            ContextValue::String(text) => Some((kind, ContextValue::String(shown(text)))),
            ContextValue::Strings(texts) => {
                Some((kind, ContextValue::Strings(texts.iter().map(|text| shown(text)).collect())))
            }
            _ => None,
        })
        .collect();
    for (kind, value) in escaped {
        error.insert(kind, value);
    }
    // "To pass '--builder' as a value, use '-- --builder'": no command takes such values.
    if error.context().any(|(kind, value)| {
        kind == ContextKind::Suggested && matches!(value, ContextValue::StyledStrs(tips) if tips.iter().any(|tip| tip.to_string().contains("as a value")))
    }) {
        error.remove(ContextKind::Suggested);
    }
}
