//! `plot`: draws the JSON lines of the measuring commands, from any number of files, as a plot.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::context::{Context, Failure, Finished};
use super::picture::note_written;
use crate::console::{open_input, standard_input};
use crate::export::{Protected, check_target, write_bytes};
use crate::lab::Measurement;
use crate::lab::plot::{Figure, PlotFormat, draw};
use crate::text::{counted, quoted, shown_path};

/// Maximum length of a line in bytes; a row has about a thousand.
const MAX_LINE: u64 = 1 << 20;

/// Magnitudes of the numbers of a row, but for 0: no measurement is beyond, and axes could not be divided.
const MAGNITUDES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// The commands whose rows have plots.
const PLOTTED: &str = "bench, sweep, scaling, compare and animate";

/// Settings of `plot`.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotCommand {
    /// Files of JSON lines; `-` is standard input.
    pub files: Vec<PathBuf>,
    /// The picture to write.
    pub output: PathBuf,
}

/// Reads the rows, draws the plot and writes it.
pub fn run(command: &PlotCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    let format = PlotFormat::of(&command.output).map_err(Failure::Usage)?;
    let mut read = Protected::default();
    read.add_read(&command.files);
    read.add_standard_streams();
    check_target(&command.output, &read)?;
    let token = &context.token;
    let mut rows = Vec::new();
    for path in &command.files {
        token.check()?;
        let appended = if path.as_os_str() == "-" {
            read_rows(Path::new("standard input"), standard_input(token), &mut rows)
        } else {
            let file = open_input(path, token)
                .map_err(|error| Failure::Failed(format!("{}: cannot be read: {error}", shown_path(path))))?;
            read_rows(path, file, &mut rows)
        };
        // A read that was interrupted has failed too.
        token.check()?;
        appended?;
    }
    let picture = draw(&Figure::of_rows(&rows).map_err(Failure::Failed)?, format, token)?;
    write_bytes(&command.output, &read, &picture)?;
    note_written(&command.output, &format!("plot of {}", counted(rows.len() as u64, "rows")));
    Ok(Finished::default())
}

/// Appends the rows of one file to `rows`; blank lines are skipped.
fn read_rows(path: &Path, file: impl Read, rows: &mut Vec<Measurement>) -> Result<(), Failure> {
    let mut reader = BufReader::new(file);
    let mut line = String::new();
    for number in 1.. {
        line.clear();
        let at = |reason: &str| Failure::Failed(format!("{}:{number}: {reason}", shown_path(path)));
        let read = (&mut reader).take(MAX_LINE).read_line(&mut line).map_err(|error| at(&error.to_string()))?;
        if read == 0 {
            break;
        }
        if read as u64 == MAX_LINE {
            return Err(at("this line is too long to be a row"));
        }
        if !line.trim().is_empty() {
            rows.extend(row(&line).map_err(|reason| at(&reason))?);
        }
    }
    Ok(())
}

/// The row in `line`; `None` for a correlation over several rows, which follows these. Refuses numbers that nothing could have been
/// measured as.
fn row(line: &str) -> Result<Option<Measurement>, String> {
    let not_a_row = |error| format!("not a row of {PLOTTED}: {error}");
    let fields: Value = serde_json::from_str(line).map_err(not_a_row)?;
    let command = fields.get("command").and_then(Value::as_str);
    if let Some(command) = command.filter(|command| ["copies", "diff", "info", "layouts", "render"].contains(command)) {
        return Err(format!("a row of {command}, of which there is no plot: plots show {PLOTTED}"));
    }
    if fields.get("alpha_r").is_some() {
        return Ok(None);
    }
    if let Some((name, number)) = fields.as_object().into_iter().flatten().find_map(|(name, value)| {
        let number = number_beyond(value)?;
        Some((name, number))
    }) {
        return Err(format!("{} is {number:e}, beyond 1e-30 to 1e30", quoted(name)));
    }
    serde_json::from_value(fields).map(Some).map_err(not_a_row)
}

/// A number in `value` that is out of range.
fn number_beyond(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64().filter(|number| *number != 0.0 && !MAGNITUDES.contains(&number.abs())),
        Value::Array(values) => values.iter().find_map(number_beyond),
        Value::Object(fields) => fields.values().find_map(number_beyond),
        _ => None,
    }
}
