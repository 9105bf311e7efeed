//! Rows of the measuring commands: as JSON lines, as tables or CSV on standard output, as CSV files and plots.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::context::{Failure, ignore_missing_reader};
use super::picture::note_written;
use crate::console::{printable_json, printable_lines};
use crate::export::{Protected, check_target, write_bytes, write_file};
use crate::lab::cost_row::{CostRow, OwnFields};
use crate::lab::plot::{Figure, PlotFormat, draw};
use crate::lab::report_table::{ReportTable, TableFormat};
use crate::lab::rows::write_costs_csv;
use crate::text::counted;
use bvhscope_engine::cancel::CancelToken;

/// The name that stands for standard output, and for standard input.
pub(super) const STDOUT: &str = "-";

/// Output options of a measuring command.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Output {
    /// Print JSON lines instead of tables.
    pub json: bool,
    /// How tables are written.
    pub format: TableFormat,
    /// CSV file to write as well; `-` takes the place of the tables.
    pub csv: Option<PathBuf>,
    /// Plot to draw as well.
    pub plot: Option<PathBuf>,
}

/// Writes rows as CSV.
pub(super) type WriteCsv<R> = fn(&[R], &mut dyn Write) -> Result<(), String>;

impl Output {
    /// Fails where both JSON and CSV would be printed, or the plot has another ending than those that are drawn.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.json && self.prints_csv() {
            return Err(Failure::Usage("--json and --csv - both write to standard output: leave one out".to_owned()));
        }
        self.plot.as_ref().map_or(Ok(()), |path| PlotFormat::of(path).map(|_| ()).map_err(Failure::Usage))
    }

    /// Checks that both files can be written, are two and none of those `read`.
    pub(super) fn check_files(&self, read: &Protected) -> Result<(), Failure> {
        let mut protected = read.clone();
        for path in self.csv_file().into_iter().chain(&self.plot) {
            check_target(path, &protected)?;
            protected.add_output(path);
        }
        Ok(())
    }

    /// True if the rows are printed as CSV.
    pub(super) fn prints_csv(&self) -> bool {
        self.csv.as_deref().is_some_and(|path| path == Path::new(STDOUT))
    }

    /// The file for CSV, where it is one.
    pub(super) fn csv_file(&self) -> Option<&PathBuf> {
        self.csv.as_ref().filter(|_| !self.prints_csv())
    }

    /// Writes the CSV file, and the plot where there are rows. Both are attempted even if one fails.
    pub(super) fn write_files<R>(
        &self,
        rows: &[R],
        write_csv: WriteCsv<R>,
        figure: impl FnOnce(&[R]) -> Result<Figure, String>,
        read: &Protected,
    ) -> Result<(), Failure> {
        let mut protected = read.clone();
        let mut written = Ok(());
        let count = counted(rows.len() as u64, "rows");
        if let Some(path) = self.csv_file() {
            written = write_file(path, &protected, |writer| write_csv(rows, writer)).map_err(Failure::from);
            if written.is_ok() {
                note_written(path, &count);
            }
            protected.add_read([path]);
        }
        if let Some(path) = self.plot.as_ref().filter(|_| !rows.is_empty()) {
            let format = PlotFormat::of(path).map_err(Failure::Usage)?;
            // Also drawn of an interrupted measurement, whose token is cancelled.
            let picture = draw(&figure(rows).map_err(Failure::Failed)?, format, &CancelToken::new())?;
            let drawn = write_bytes(path, &protected, &picture).map_err(Failure::from);
            if drawn.is_ok() {
                note_written(path, &format!("plot of {count}"));
            }
            written = written.and(drawn);
        }
        written
    }

    /// Prints rows as JSON lines, CSV or tables, where there are any.
    pub(super) fn print<R: Serialize>(
        &self,
        rows: &[R],
        write_csv: WriteCsv<R>,
        tables: impl FnOnce(&[R]) -> Vec<ReportTable>,
        out: &mut dyn Write,
    ) -> std::io::Result<()> {
        if self.json {
            return rows.iter().try_for_each(|row| out.write_all(json_line(row)?.as_bytes()));
        }
        if rows.is_empty() {
            return Ok(());
        }
        if self.prints_csv() {
            return write_csv(rows, out).map_err(std::io::Error::other);
        }
        for (index, table) in tables(rows).iter().enumerate() {
            if index > 0 {
                writeln!(out)?;
            }
            write!(out, "{}", printable_lines(&table.written(self.format)))?;
        }
        Ok(())
    }
}

impl Output {
    /// Writes the files and prints `rows` of what rays cost, where there are any: those that were measured before an early end, too, whose
    /// `outcome` is returned after both were attempted.
    pub(super) fn deliver<T: OwnFields>(
        &self,
        rows: &[CostRow<T>],
        tables: impl FnOnce(&[CostRow<T>]) -> Vec<ReportTable>,
        figure: impl FnOnce(&[CostRow<T>]) -> Result<Figure, String>,
        read: &Protected,
        out: &mut dyn Write,
        outcome: Result<(), Failure>,
    ) -> Result<(), Failure> {
        let written = if rows.is_empty() { Ok(()) } else { self.write_files(rows, write_costs_csv, figure, read) };
        let printed = self.print(rows, write_costs_csv, tables, out);
        written?;
        outcome?;
        Ok(ignore_missing_reader(printed)?)
    }
}

/// A row or summary as a line of JSON.
pub(super) fn json_line(row: &impl Serialize) -> std::io::Result<String> {
    Ok(format!("{}\n", printable_json(&serde_json::to_string(row)?)))
}
