//! Measured rows, by run.

use serde_json::Value;

use super::packed::unpack;

/// The columns that identify a run.
const RUN: [&str; 4] = ["date", "machine", "commit", "flags"];

/// Triangles from which a scene counts as large.
const LARGE: u64 = 2_000_000;

/// Which runs and scenes a table shows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shown<'a> {
    /// Runs limited to this SIMD level; where there is none, runs without a limit.
    pub simd: Option<&'a str>,
    /// Large scenes instead of all others.
    pub large: bool,
}

impl<'a> Shown<'a> {
    /// Parses a marker into a table's name and the rows to show.
    pub fn parse(marker: &'a str) -> (&'a str, Self) {
        let (marker, simd) = marker.split_once(" simd=").map_or((marker, None), |(name, level)| (name, Some(level)));
        let name = marker.strip_suffix(" large");
        (name.unwrap_or(marker), Self { simd, large: name.is_some() })
    }
}

/// All rows of the file, in order.
#[derive(Debug)]
pub struct Rows(pub Vec<Value>);

impl Rows {
    /// Reads one JSON object a line, a row or packed rows; an error names the first line that is not of a run.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut rows = Vec::new();
        for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let line = serde_json::from_str(line).map_err(|error| format!("line {}: {error}", index + 1))?;
            let unpacked =
                unpack(line).ok_or_else(|| format!("line {}: rows that do not fit the columns", index + 1))?;
            for row in unpacked {
                if let Some(name) = RUN.into_iter().chain(["part", "model"]).find(|name| !row[*name].is_string()) {
                    return Err(format!("line {}: no {name}", index + 1));
                }
                rows.push(row);
            }
        }
        Ok(Self(rows))
    }

    /// The rows of `part` to be shown, of the newest run that has any.
    pub fn newest(&self, part: &str, shown: Shown<'_>) -> Vec<&Value> {
        let is_wanted = |row: &&Value| {
            let is_limited = row["flags"].as_str().is_some_and(|flags| flags.contains("--simd"));
            let fits = shown.simd.map_or(!is_limited, |level| is_limited && row["simd"] == level);
            let is_large = row["triangles"].as_u64().is_some_and(|triangles| triangles >= LARGE);
            row["part"] == part && fits && is_large == shown.large
        };
        let wanted: Vec<&Value> = self.0.iter().filter(is_wanted).collect();
        let run_of = |row: &Value| RUN.map(|name| row[name].as_str().unwrap_or_default().to_owned());
        let newest = wanted.iter().map(|row| run_of(row)).max();
        wanted.into_iter().filter(|row| Some(run_of(row)) == newest).collect()
    }
}

/// The run of a table's rows, for its caption.
pub fn source(rows: &[&Value]) -> String {
    let Some(row) = rows.first() else { return String::new() };
    let [date, machine, commit, _] = RUN.map(|name| row[name].as_str().unwrap_or_default());
    format!("{machine}, {}, commit {commit}", date.split('T').next().unwrap_or_default())
}

/// Millions of rays a second.
pub fn rate(row: &Value) -> Option<f64> {
    Some(row["rays"].as_f64()? / row["trace_ms"].as_f64()? / 1e3)
}
