//! The runs that the file of measurements keeps: the newest of each machine and set of flags, as many as fit.

use std::collections::BTreeMap;

use serde_json::Value;

/// Bytes that the file may have in the repository.
pub const MAX_BYTES: usize = 300_000;

/// The lines of `text`, JSON objects with machine, flags and date, without those that the same machine has measured again with the same
/// flags. Where more than `max_bytes` remain, the oldest runs are left out, but never the newest.
pub fn newest(text: &str, max_bytes: usize) -> serde_json::Result<String> {
    let mut newest: BTreeMap<[String; 2], String> = BTreeMap::new();
    let mut lines = Vec::new();
    for line in text.lines() {
        let run: Value = serde_json::from_str(line)?;
        let [machine, flags, date] =
            ["machine", "flags", "date"].map(|name| run[name].as_str().unwrap_or_default().to_owned());
        let key = [machine, flags];
        let known = newest.entry(key.clone()).or_default();
        *known = date.clone().max(std::mem::take(known));
        lines.push((line, key, date));
    }
    lines.retain(|(_, key, date)| newest.get(key) == Some(date));
    // Bytes of each run by date: the newest first, as long as they fit.
    let mut sizes: BTreeMap<(&str, &[String; 2]), usize> = BTreeMap::new();
    for (line, key, date) in &lines {
        *sizes.entry((date, key)).or_default() += line.len() + 1;
    }
    let mut bytes = 0;
    let within = |(run, size): (_, usize)| {
        let is_first = bytes == 0;
        bytes += size;
        (is_first || bytes <= max_bytes).then_some(run)
    };
    let kept: Vec<(&str, &[String; 2])> = sizes.into_iter().rev().map_while(within).collect();
    let is_kept = |key: &[String; 2], date: &str| kept.contains(&(date, key));
    Ok(lines.iter().filter(|(_, key, date)| is_kept(key, date)).map(|(line, ..)| format!("{line}\n")).collect())
}
