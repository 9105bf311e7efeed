//! The results as aligned tables, and as one JSON object a row.

use std::time::Duration;

use serde_json::{Value, json};

use crate::measure::{BuildRow, Outcome, PictureRow, RayCounts, TraceRow, TreeRow};

/// Prints tables. `×` is the ratio to the best peer.
pub fn print_tables(outcome: &Outcome) {
    let Outcome { model, triangles, repeat, .. } = outcome;
    println!("{model}: {triangles} triangles, medians of {repeat} interleaved rounds, × to the best peer");
    for (title, rows) in [("build", &outcome.builds), ("update", &outcome.updates)] {
        if rows.is_empty() {
            continue;
        }
        println!(
            "  {title:<30} {:>7} {:>14} {:>15} {:>18} {:>9} {:>6}",
            "threads", "binary tree ms", "ready to trace", "least, most", "Mtri/s", "×"
        );
        for row in rows {
            let [median, least, most] = row.ready.map(millis);
            println!(
                "  {:<30} {:>7} {:>14} {median:>15.1} {least:>8.1} {most:>9.1} {:>9.2} {:>6}",
                format!("{} {}", row.engine, row.name),
                row.threads,
                row.binary.map_or("–".to_owned(), |binary| format!("{:.1}", millis(binary[0]))),
                rate(*triangles, row.ready[0]),
                ratio(row.ratio),
            );
        }
    }
    if !outcome.trees.is_empty() {
        println!(
            "  {:<30} {:>9} {:>6} {:>7} {:>15} {:>22}",
            "tree", "SAH cost", "×", "EPO", "bytes/triangle", "containers + triangles, reads"
        );
        for row in &outcome.trees {
            let counts = row.counts.iter().map(|(work, RayCounts { containers, triangles, bytes })| {
                format!("{work} {containers:.1} + {triangles:.1}, {bytes:.0} B")
            });
            println!(
                "  {:<30} {:>9} {:>6} {:>7} {:>15} {}",
                format!("{} {}", row.engine, row.name),
                row.sah_cost.map_or("–".to_owned(), |cost| format!("{cost:.2}")),
                ratio(row.ratio),
                row.overlap.map_or("–".to_owned(), |overlap| format!("{overlap:.2}")),
                row.bytes.map_or("–".to_owned(), |bytes| format!("{:.1}", bytes as f64 / *triangles as f64)),
                counts.collect::<Vec<_>>().join("; "),
            );
        }
    }
    for (index, row) in outcome.traces.iter().enumerate() {
        let is_first = index == 0 || {
            let before = &outcome.traces[index - 1];
            (before.work, before.threads) != (row.work, row.threads)
        };
        if is_first {
            let title = format!("{}, threads: {}", row.work, row.threads);
            println!("  {title:<30} {:>9} {:>19} {:>8} {:>6} {:>12}", "ms", "least, most", "Mray/s", "×", "hits");
        }
        let [median, least, most] = row.time.map(millis);
        println!(
            "  {:<30} {median:>9.1} {least:>9.1} {most:>9.1} {:>8.2} {:>6} {:>12}",
            format!("{} {} {}", row.engine, row.setting, row.name),
            rate(row.rays, row.time[0]),
            ratio(row.ratio),
            row.tally.hits,
        );
    }
    if !outcome.pictures.is_empty() {
        println!("  {:<30} {:>7} {:>7} {:>9} {:>6}", "build and picture", "threads", "samples", "ms", "×");
        for row in &outcome.pictures {
            println!(
                "  {:<30} {:>7} {:>7} {:>9.1} {:>6}",
                format!("{} {}", row.engine, row.name),
                row.threads,
                row.samples,
                millis(row.time),
                ratio(row.ratio),
            );
        }
    }
    println!();
}

/// One JSON object for each line of the tables.
pub fn rows(outcome: &Outcome) -> Vec<Value> {
    let mut rows = Vec::new();
    let updates = outcome.updates.iter().map(|row| ("update", row));
    for (part, row) in outcome.builds.iter().map(|row| ("build", row)).chain(updates) {
        let BuildRow { engine, name, threads, ready, binary, ratio } = row;
        rows.push(json!({
            "part": part, "engine": engine, "setting": name, "threads": threads, "repeat": outcome.repeat,
            "build_ms": binary.map(|binary| millis(binary[0])), "build_ms_spread": binary.map(range),
            "ready_ms": millis(ready[0]), "ready_ms_spread": range(*ready),
            "mtris_per_s": rate(outcome.triangles, ready[0]), "ratio": ratio,
        }));
    }
    for TreeRow { engine, name, sah_cost, ratio, overlap, counts, bytes } in &outcome.trees {
        let mut row = json!({
            "part": "tree", "engine": engine, "setting": name, "sah_cost": sah_cost, "ratio": ratio, "epo": overlap,
            "bytes_per_triangle": bytes.map(|bytes| bytes as f64 / outcome.triangles as f64),
        });
        for (work, RayCounts { containers, triangles, bytes }) in counts {
            row[format!("{work}_container_tests_per_ray")] = json!(containers);
            row[format!("{work}_primitive_tests_per_ray")] = json!(triangles);
            row[format!("{work}_bytes_per_ray")] = json!(bytes);
        }
        rows.push(row);
    }
    for TraceRow { work, engine, setting, name, threads, rays, tally, time, ratio } in &outcome.traces {
        rows.push(json!({
            "part": work, "engine": engine, "setting": setting, "interface": name, "threads": threads,
            "repeat": outcome.repeat, "rays": rays, "hits": tally.hits, "distance_sum": tally.distance,
            "trace_ms": millis(time[0]), "trace_ms_spread": range(*time), "mrays_per_s": rate(*rays, time[0]),
            "ratio": ratio,
        }));
    }
    for PictureRow { engine, name, threads, samples, time, ratio } in &outcome.pictures {
        rows.push(json!({
            "part": "picture", "engine": engine, "setting": name, "threads": threads, "repeat": outcome.repeat,
            "samples": samples, "picture_ms": millis(*time), "ratio": ratio,
        }));
    }
    for row in &mut rows {
        row["model"] = json!(outcome.model);
        row["triangles"] = json!(outcome.triangles);
    }
    rows
}

/// Shortest and longest, in milliseconds.
fn range([_, least, most]: [Duration; 3]) -> [f64; 2] {
    [millis(least), millis(most)]
}

fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Millions a second.
fn rate(count: usize, time: Duration) -> f64 {
    count as f64 / time.as_secs_f64() / 1e6
}

fn ratio(ratio: Option<f64>) -> String {
    ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.2}"))
}
