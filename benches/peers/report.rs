//! The results as aligned tables, or as one JSON object a line.

use std::time::Duration;

use serde_json::{Value, json};

use crate::measure::{BuildRow, Outcome, TraceRow, TreeRow};

/// Prints tables. `×` is the ratio to the best peer.
pub fn print_tables(outcome: &Outcome) {
    let Outcome { model, triangles, repeat, .. } = outcome;
    println!("{model}: {triangles} triangles, medians of {repeat} interleaved rounds, × to the best peer");
    if !outcome.builds.is_empty() {
        println!("  {:<34} {:>7} {:>9} {:>19} {:>8} {:>6}", "build", "threads", "ms", "least, most", "Mtri/s", "×");
        for row in &outcome.builds {
            let [median, least, most] = row.time.map(millis);
            println!(
                "  {:<34} {:>7} {median:>9.1} {least:>9.1} {most:>9.1} {:>8.2} {:>6}",
                format!("{} {}", row.engine, row.name),
                row.threads,
                rate(*triangles, row.time[0]),
                ratio(row.ratio),
            );
        }
    }
    if !outcome.trees.is_empty() {
        println!("  {:<34} {:>9} {:>6} {:>15}", "tree", "SAH cost", "×", "bytes/triangle");
        for row in &outcome.trees {
            println!(
                "  {:<34} {:>9} {:>6} {:>15}",
                format!("{} {}", row.engine, row.name),
                row.sah_cost.map_or("–".to_owned(), |cost| format!("{cost:.2}")),
                ratio(row.ratio),
                row.bytes.map_or("–".to_owned(), |bytes| format!("{:.1}", bytes as f64 / *triangles as f64)),
            );
        }
    }
    for (index, row) in outcome.traces.iter().enumerate() {
        if index == 0 || outcome.traces[index - 1].work != row.work {
            println!("  {:<34} {:>9} {:>19} {:>8} {:>6} {:>12}", row.work, "ms", "least, most", "Mray/s", "×", "hits");
        }
        let [median, least, most] = row.time.map(millis);
        println!(
            "  {:<34} {median:>9.1} {least:>9.1} {most:>9.1} {:>8.2} {:>6} {:>12}",
            format!("{} {}", row.engine, row.name),
            rate(row.rays, row.time[0]),
            ratio(row.ratio),
            row.tally.hits,
        );
    }
    println!();
}

/// Prints one JSON object for each line of the tables.
pub fn print_json(outcome: &Outcome) {
    let print = |mut row: Value| {
        row["model"] = json!(outcome.model);
        row["triangles"] = json!(outcome.triangles);
        println!("{row}");
    };
    for BuildRow { engine, name, threads, time, ratio } in &outcome.builds {
        print(json!({
            "part": "build", "engine": engine, "setting": name, "threads": threads, "repeat": outcome.repeat,
            "build_ms": millis(time[0]), "build_ms_spread": [millis(time[1]), millis(time[2])],
            "mtris_per_s": rate(outcome.triangles, time[0]), "ratio": ratio,
        }));
    }
    for TreeRow { engine, name, sah_cost, ratio, bytes } in &outcome.trees {
        print(json!({
            "part": "tree", "engine": engine, "setting": name, "sah_cost": sah_cost, "ratio": ratio,
            "bytes_per_triangle": bytes.map(|bytes| bytes as f64 / outcome.triangles as f64),
        }));
    }
    for TraceRow { work, engine, name, rays, tally, time, ratio } in &outcome.traces {
        print(json!({
            "part": work, "engine": engine, "setting": name, "threads": 1, "repeat": outcome.repeat, "rays": rays,
            "hits": tally.hits, "distance_sum": tally.distance, "trace_ms": millis(time[0]),
            "trace_ms_spread": [millis(time[1]), millis(time[2])], "mrays_per_s": rate(*rays, time[0]), "ratio": ratio,
        }));
    }
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
