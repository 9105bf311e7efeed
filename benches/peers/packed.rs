//! Rows as the file of measurements keeps them: a line for each part of a run, with what its rows share, the names of the other
//! columns, and the rows as lists, in which `""` repeats the cell above.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value, json};

/// Columns that follow from the others, and the check that all engines found the same hits.
const LEFT_OUT: [&str; 6] =
    ["ratio", "mrays_per_s", "mtris_per_s", "mtriangles_per_s", "wide_mrays_per_s", "distance_sum"];

/// Packs the rows of one run, with times rounded to four digits and other numbers to five.
#[allow(dead_code, reason = "the tables of the documentation only read")]
pub fn pack(rows: &[Value]) -> Vec<Value> {
    let mut parts: BTreeMap<&str, Vec<&Map<String, Value>>> = BTreeMap::new();
    for row in rows.iter().filter_map(Value::as_object) {
        parts.entry(row.get("part").and_then(Value::as_str).unwrap_or_default()).or_default().push(row);
    }
    parts.into_values().map(pack_part).collect()
}

fn pack_part(mut rows: Vec<&Map<String, Value>>) -> Value {
    let names: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
    let kept = names.into_iter().filter(|name| !LEFT_OUT.contains(&name.as_str()));
    let (shared, columns): (Vec<_>, Vec<_>) =
        kept.partition(|name| rows.iter().all(|row| row.get(*name) == rows[0].get(*name)));
    let mut line: Map<String, Value> =
        shared.into_iter().map(|name| (name.clone(), rounded(name, &rows[0][name]))).collect();
    // Rows with the same names are neighbours, which saves the names.
    let words = |row: &Map<String, Value>| -> Vec<String> {
        columns.iter().filter_map(|name| row.get(*name)?.as_str().map(str::to_owned)).collect()
    };
    rows.sort_by_cached_key(|row| words(row));
    let mut above = vec![Value::Null; columns.len()];
    let mut packed = Vec::new();
    for row in rows {
        let cells: Vec<Value> =
            columns.iter().map(|name| row.get(*name).map_or(Value::Null, |value| rounded(name, value))).collect();
        let repeats =
            |(cell, above): (&Value, &Value)| if cell == above && !cell.is_null() { json!("") } else { cell.clone() };
        packed.push(cells.iter().zip(&above).map(repeats).collect::<Value>());
        above = cells;
    }
    line.insert("columns".to_owned(), json!(columns));
    line.insert("rows".to_owned(), Value::Array(packed));
    Value::Object(line)
}

/// The value of a column with its numbers rounded: times vary more than a thousandth from run to run, counts are exact.
fn rounded(name: &str, value: &Value) -> Value {
    let decimals = if name.contains("_ms") { 3 } else { 4 };
    match value {
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or_default();
            json!(format!("{number:.decimals$e}").parse().unwrap_or(number))
        }
        Value::Array(values) => values.iter().map(|value| rounded(name, value)).collect(),
        Value::Object(fields) => {
            Value::Object(fields.iter().map(|(key, value)| (key.clone(), rounded(name, value))).collect())
        }
        other => other.clone(),
    }
}

/// The rows of a line, or the line where it is a row by itself; `None` where its lists do not fit its columns.
#[allow(dead_code, reason = "the benchmark only writes")]
pub fn unpack(mut line: Value) -> Option<Vec<Value>> {
    let Some(fields) = line.as_object_mut().filter(|fields| fields.contains_key("rows")) else {
        return Some(vec![line]);
    };
    let (columns, rows) = (fields.remove("columns")?, fields.remove("rows")?);
    let columns: Vec<&str> = columns.as_array()?.iter().map(Value::as_str).collect::<Option<_>>()?;
    let mut above: Vec<Value> = Vec::new();
    let mut unpacked = Vec::new();
    for row in rows.as_array()? {
        let cells = row.as_array().filter(|cells| cells.len() == columns.len())?;
        let cell =
            |(index, cell): (usize, &Value)| if cell == "" { above.get(index).cloned() } else { Some(cell.clone()) };
        above = cells.iter().enumerate().map(cell).collect::<Option<_>>()?;
        let own = columns.iter().map(|name| (*name).to_owned()).zip(above.iter().cloned());
        unpacked.push(Value::Object(fields.clone().into_iter().chain(own).collect()));
    }
    Some(unpacked)
}
