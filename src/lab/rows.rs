//! Measurements as text for programs: JSON lines or CSV. Errors are messages for the user.

use std::io::Write;

use serde_json::Value;

use super::measurement::Measurement;

/// CSV columns: the JSON names that all commands share, then the conditions of the measurement.
const COLUMNS: [&str; 49] = [
    "command",
    "model",
    "triangles",
    "builder",
    "preset",
    "container",
    "threshold",
    "epsilon",
    "curve",
    "optimize",
    "threads",
    "build_ms",
    "build_ms_spread",
    "build_stages_ms",
    "mtriangles_per_s",
    "trace_ms",
    "trace_ms_spread",
    "rays",
    "hits",
    "mrays_per_s",
    "tests_per_ray",
    "container_tests_per_ray",
    "primitive_tests_per_ray",
    "sah_cost",
    "traversal_cost",
    "intersection_cost",
    "epo",
    "nodes",
    "leaves",
    "max_depth",
    "mean_leaf_depth",
    "leaf_size",
    "tree_bytes",
    "triangle_bytes",
    "bytes_per_triangle",
    "collapse_ms",
    "wide_trace_ms",
    "wide_mrays_per_s",
    "wide_node_bytes",
    "wide_triangle_bytes",
    "wide_bytes_per_triangle",
    "overlay_bytes",
    "speedup",
    "trace_speedup",
    "traversal",
    "width_px",
    "height_px",
    "repeat",
    "warnings",
];

/// Writes one JSON object per line, as the measuring commands do with `--json`.
pub fn write_json_lines(rows: &[Measurement], writer: &mut dyn Write) -> Result<(), String> {
    for row in rows {
        let text = serde_json::to_string(row).map_err(|error| error.to_string())?;
        writeln!(writer, "{text}").map_err(failed)?;
    }
    Ok(())
}

/// Writes CSV with the JSON names as columns; spreads and stages are joined into one cell each. Names that no row has are
/// omitted.
pub fn write_csv(rows: &[Measurement], writer: &mut dyn Write) -> Result<(), String> {
    let rows =
        rows.iter().map(serde_json::to_value).collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())?;
    let names: Vec<&str> = COLUMNS.into_iter().filter(|name| rows.iter().any(|row| row.get(name).is_some())).collect();
    let mut csv = csv::Writer::from_writer(writer);
    if !names.is_empty() {
        csv.write_record(&names).map_err(failed)?;
    }
    for row in &rows {
        csv.write_record(names.iter().map(|name| row.get(name).map(cell).unwrap_or_default())).map_err(failed)?;
    }
    csv.flush().map_err(failed)
}

fn failed(error: impl std::fmt::Display) -> String {
    format!("cannot be written: {error}")
}

/// A JSON value as the text of a cell.
fn cell(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        // Sentences are separated by semicolons, numbers by spaces.
        Value::Array(items) if items.iter().any(Value::is_string) => {
            items.iter().map(cell).collect::<Vec<_>>().join("; ")
        }
        Value::Array(items) => items.iter().map(cell).collect::<Vec<_>>().join(" "),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| format!("{name}={}", cell(value))).collect::<Vec<_>>().join(" ")
        }
        Value::Null => String::new(),
        other => other.to_string(),
    }
}
