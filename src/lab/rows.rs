//! Measurements as text for programs: JSON lines or CSV. Errors are messages for the user.

use std::collections::BTreeSet;
use std::io::Write;

use serde_json::Value;

use super::cost_row::{CostRow, OwnFields};
use super::measurement::Measurement;
use super::population::Population;
use crate::catalog::fields::columns;
use crate::text::printable;

/// Writes one JSON object per line, as the measuring commands do with `--json`.
pub fn write_json_lines(rows: &[Measurement], writer: &mut dyn Write) -> Result<(), String> {
    for row in rows {
        let text = serde_json::to_string(row).map_err(|error| error.to_string())?;
        writeln!(writer, "{text}").map_err(failed)?;
    }
    Ok(())
}

/// Writes CSV with the JSON names as columns; spreads and stages are joined into one cell each, and each number of the populations has a
/// column of its own. Names that no row has are omitted.
pub fn write_csv(rows: &[Measurement], writer: &mut dyn Write) -> Result<(), String> {
    // Through the text, in which each number has the digits of its own precision.
    let value = |row: &Measurement| serde_json::from_str(&serde_json::to_string(row)?);
    let mut rows: Vec<Value> =
        rows.iter().map(value).collect::<Result<_, serde_json::Error>>().map_err(|error| error.to_string())?;
    let of_rays = spread_populations(&mut rows);
    let names = columns().into_iter().flat_map(|name| match name {
        "populations" => of_rays.clone(),
        name => vec![name.to_owned()],
    });
    let names: Vec<String> = names.filter(|name| rows.iter().any(|row| row.get(name).is_some())).collect();
    write_records(&names, &rows, writer)
}

/// [`write_csv`] of rows of what rays cost: those columns that a row has.
pub fn write_costs_csv<T: OwnFields>(rows: &[CostRow<T>], writer: &mut dyn Write) -> Result<(), String> {
    let rows: Vec<Value> = rows
        .iter()
        .map(serde_json::to_value)
        .collect::<Result<_, serde_json::Error>>()
        .map_err(|error| error.to_string())?;
    let is_known = |name: &&str| rows.iter().any(|row| row.get(*name).is_some());
    let names: Vec<String> = T::columns().into_iter().filter(is_known).map(str::to_owned).collect();
    write_records(&names, &rows, writer)
}

/// Writes the fields `names` of `rows` under these names.
fn write_records(names: &[String], rows: &[Value], writer: &mut dyn Write) -> Result<(), String> {
    let mut csv = csv::Writer::from_writer(writer);
    if !names.is_empty() {
        csv.write_record(names).map_err(failed)?;
    }
    for row in rows {
        csv.write_record(names.iter().map(|name| row.get(name).map(cell).unwrap_or_default())).map_err(failed)?;
    }
    csv.flush().map_err(failed)
}

/// Gives each number of the populations of `rows` a field of its own, such as `ao_cost`. Returns the names of these fields, those of one
/// population side by side.
fn spread_populations(rows: &mut [Value]) -> Vec<String> {
    let mut names = Vec::new();
    for population in Population::of_rows().map(Population::name) {
        let mut of_population = BTreeSet::new();
        for row in rows.iter_mut().filter_map(Value::as_object_mut) {
            let listed = row.get("populations").and_then(Value::as_array).into_iter().flatten();
            let fields = listed
                .filter_map(Value::as_object)
                .find(|rays| rays.get("population").and_then(Value::as_str) == Some(population));
            let Some(fields) = fields.cloned() else { continue };
            for (key, value) in fields.into_iter().filter(|(key, _)| key != "population") {
                let name = format!("{population}_{key}");
                row.insert(name.clone(), value);
                of_population.insert(name);
            }
        }
        names.extend(of_population);
    }
    names
}

fn failed(error: impl std::fmt::Display) -> String {
    format!("cannot be written: {error}")
}

/// A text as a cell: what could drive a terminal is escaped, and what a spreadsheet would take for a formula begins with an apostrophe.
fn text_cell(text: &str) -> String {
    let mark = if text.starts_with(['=', '+', '-', '@']) { "'" } else { "" };
    format!("{mark}{}", printable(text))
}

/// A JSON value as the text of a cell.
fn cell(value: &Value) -> String {
    match value {
        Value::String(text) => text_cell(text),
        // Sentences and objects are separated by semicolons, numbers by spaces.
        Value::Array(items) if items.iter().any(|item| item.is_string() || item.is_object()) => {
            items.iter().map(cell).collect::<Vec<_>>().join("; ")
        }
        Value::Array(items) => items.iter().map(cell).collect::<Vec<_>>().join(" ").trim().to_owned(),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| format!("{name}={}", cell(value))).collect::<Vec<_>>().join(" ")
        }
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::{BUILD_MS, SPEEDUP, TRACE_SPEEDUP};
    use crate::lab::sample::{assert_same, sample};

    fn csv(rows: &[Measurement]) -> Vec<Vec<String>> {
        let mut bytes = Vec::new();
        write_csv(rows, &mut bytes).unwrap();
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(&bytes[..]);
        reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect()
    }

    #[test]
    fn json_lines_are_read_as_they_were_written() {
        let rows = [sample(), sample().with(BUILD_MS, f64::NAN)];
        let mut text = Vec::new();
        write_json_lines(&rows, &mut text).unwrap();
        let lines: Vec<Measurement> =
            std::str::from_utf8(&text).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(lines.len(), 2);
        lines.iter().zip(&rows).for_each(|(line, row)| assert_same(line, row));
    }

    #[test]
    fn csv_has_every_column_under_its_name() {
        let (tree, label) = (Some("mine.bvh".to_owned()), Some("mine".to_owned()));
        let sample = || Measurement { tree: tree.clone(), label: label.clone(), ..sample() };
        let row = serde_json::to_value(sample()).unwrap();
        let mut unnamed: Vec<&String> = row.as_object().unwrap().keys().collect();
        unnamed.retain(|name| !columns().contains(&name.as_str()));
        assert!(unnamed.is_empty(), "{unnamed:?} are in no column");
        let table = csv(&[sample()]);
        let absent = ["optimize_sah_costs", "children_per_node", "nodes_per_arity"];
        let of_rays = ["cost", "predicted_visits", "rays", "root_hits", "visits"].map(|key| format!("ao_{key}"));
        let names = columns().into_iter().filter(|name| !absent.contains(name)).flat_map(|name| match name {
            "populations" => of_rays.to_vec(),
            name => vec![name.to_owned()],
        });
        assert_eq!(table[0], names.collect::<Vec<_>>());
        for (name, cell) in table[0].iter().zip(&table[1]) {
            let expected = match name.as_str() {
                "build_ms_spread" => "17.0 23.0".to_owned(),
                "ray_ns_spread" => "40.5 43.0".to_owned(),
                "trace_ms_spread" => "47.0 61.0".to_owned(),
                "mrays_per_s_spread" => "2.0 2.5".to_owned(),
                "eye" => "1.25 2.25 3.25".to_owned(),
                "target" => "4.25 5.25 6.25".to_owned(),
                "up" => "0.0 0.0 1.0".to_owned(),
                "leaf_size" => "1.0 2.5 7.0".to_owned(),
                "times" => "build_ms=16.0 17.0 20.0 23.0 24.0 trace_ms=61.0 50.0 47.0 46.0 62.0 wide_trace_ms=4.5 4.25 4.125 4.75 5.0".to_owned(),
                "verdicts" => "against=hq, box break_even_interval=128000.0 break_even_rays=257000.0 factor=1.375 interval=1.125 1.75 less=0 \
                               number=wide_trace_ms pays_from=11 rounds=9 verdict=worse".to_owned(),
                "optimize" => "collapse".to_owned(),
                "build_stages_ms" => "sort=2.5 tree=13.5".to_owned(),
                "ao_cost" => "1.25".to_owned(),
                "ao_predicted_visits" => "2.5".to_owned(),
                "ao_rays" => "19".to_owned(),
                "ao_root_hits" => "17".to_owned(),
                "ao_visits" => "13".to_owned(),
                "predicted_scaling" => {
                    assert!(
                        cell.starts_with("build=curve=cores=1 lower=1.0 speedup=1.0 upper=1.0; cores=2 "),
                        "{cell}"
                    );
                    cell.clone()
                }
                "warnings" => "2 faces skipped; 1 texture missing".to_owned(),
                _ => row[name].as_str().map_or_else(|| row[name].to_string(), str::to_owned),
            };
            assert_eq!(*cell, expected, "{name}");
        }
    }

    #[test]
    fn a_build_time_that_is_not_known_is_no_number() {
        let mut unknown = sample().with(BUILD_MS, f64::NAN);
        unknown.values.set_spread(BUILD_MS, None);
        let mut text = Vec::new();
        write_json_lines(std::slice::from_ref(&unknown), &mut text).unwrap();
        let text = std::str::from_utf8(&text).unwrap();
        assert!(text.contains("\"build_ms\":null,\"ready_ms\""), "{text}");
        let read: Measurement = serde_json::from_str(text).unwrap();
        assert!(read.number(BUILD_MS).is_nan());
        let table = csv(&[unknown]);
        let column = table[0].iter().position(|column| column == "build_ms").unwrap();
        assert_eq!(table[1][column], "");
    }

    #[test]
    fn columns_that_no_row_has_are_left_out() {
        let mut without = sample();
        without.values.remove(SPEEDUP);
        without.values.remove(TRACE_SPEEDUP);
        let table = csv(&[without.clone(), without.clone()]);
        assert!(!table[0].iter().any(|name| name.ends_with("speedup")), "{:?}", table[0]);
        let table = csv(&[without, sample()]);
        let column = table[0].iter().position(|name| name == "speedup").unwrap();
        assert_eq!((table[1][column].as_str(), table[2][column].as_str()), ("", "2.75"));
        assert_eq!(csv(&[]), Vec::<Vec<String>>::new());
    }

    #[test]
    fn cells_neither_drive_a_terminal_nor_are_formulas() {
        for (text, expected) in [
            ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
            ("+1", "'+1"),
            ("-1", "'-1"),
            ("@sum", "'@sum"),
            ("a\u{1b}[2J\nb", r"a\u{1b}[2J\nb"),
            ("x=1", "x=1"),
        ] {
            assert_eq!(cell(&Value::from(text)), expected);
        }
        assert_eq!(cell(&Value::from(-1.5)), "-1.5", "a number");
    }
}
