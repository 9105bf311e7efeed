//! A recorded ray as a table: the rows of `bvhscope ray`, and what the window copies.

use super::ray_record::RayRecord;
use super::step::RayStep;
use crate::lab::report_table::ReportTable;
use crate::render::Crossings;
use bvhscope_engine::tree::traverse::TestCounts;
use bvhscope_engine::wide::trace::CacheLines;

/// The steps of `record` under `title`, one row each, with the totals below.
pub fn ray_table(title: String, record: &RayRecord) -> ReportTable {
    let columns = [
        ("step", ""),
        ("node", ""),
        ("depth", ""),
        ("t", ""),
        ("triangle", ""),
        ("containers", "tested"),
        ("triangles", "tested"),
        ("stack", "nodes"),
    ];
    let width = record.steps.len().to_string().len();
    let row = |(index, step): (usize, &RayStep)| {
        let node = |text: String| if step.what.is_about_node() { text } else { String::new() };
        vec![
            format!("{:>width$}  {}", index + 1, step.what.name()),
            node(step.tree_node.to_string()),
            node(step.depth.to_string()),
            step.what.t().map_or_else(String::new, distance),
            step.what.triangle().map_or_else(String::new, |triangle| triangle.to_string()),
            step.counts.containers.to_string(),
            step.counts.primitives.to_string(),
            step.waiting.to_string(),
        ]
    };
    ReportTable {
        title,
        columns: columns.map(|(name, unit)| (name.to_owned(), unit.to_owned())).to_vec(),
        rows: record.steps.iter().enumerate().map(row).collect(),
        notes: notes(record),
        ..ReportTable::default()
    }
}

/// Most hits that a note lists.
const MOST_LISTED: usize = 16;

/// All triangles on the ray as if none ended it: "All 2 hits: front of triangle 1030 at 5.28, back of triangle 7 at 8.86 (3.58 thick)."
fn all_hits(Crossings { hits, has_more }: &Crossings) -> Option<String> {
    let listed = hits.iter().take(MOST_LISTED).map(|hit| {
        let side = if hit.is_front { "front" } else { "back" };
        let thick = hit.thickness.map_or_else(String::new, |thickness| format!(" ({} thick)", distance(thickness)));
        format!("{side} of triangle {} at {}{thick}", hit.triangle, distance(hit.t))
    });
    let rest = match (hits.len().saturating_sub(MOST_LISTED), has_more) {
        (0, false) => String::new(),
        (rest, false) => format!(", and {rest} more"),
        (..) => ", and more".to_owned(),
    };
    let more = if *has_more { "More than " } else { "All " };
    let title = format!("{more}{}", counted(hits.len() as u64, "hit"));
    (!hits.is_empty()).then(|| format!("{title}: {}{rest}.", listed.collect::<Vec<_>>().join(", ")))
}

/// The hit, and the number of tests.
fn notes(record: &RayRecord) -> Vec<String> {
    let [visited, wasted, skipped] = record.visits();
    let TestCounts { containers, primitives } = record.counts;
    let found = match record.hit {
        Some((t, triangle)) => format!("Hits triangle {triangle} at {}.", distance(t)),
        None => "Hits nothing.".to_owned(),
    };
    let mut notes = vec![
        found,
        format!("{}, {}.", counted(containers, "container test"), counted(primitives, "triangle test")),
        format!(
            "Of the containers entered {visited} were visited, {wasted} of these wasted (nothing nearer was found in them), \
             and {skipped} skipped."
        ),
    ];
    notes.extend(all_hits(&record.crossings));
    if let Some(lines) = record.lines {
        let CacheLines { nodes, triangles } = lines;
        notes
            .push(format!("Reads {nodes} cache lines of nodes and {triangles} of triangles, {} bytes.", lines.bytes()));
    }
    if record.omitted > 0 {
        notes.push(format!("{} more steps are not listed; their tests are counted.", record.omitted));
    }
    notes
}

fn counted(count: u64, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// A distance with six digits.
fn distance(t: f32) -> String {
    let before_point = if t == 0.0 { 0.0 } else { t.abs().log10().floor() };
    let decimals = (5.0 - before_point).clamp(0.0, 12.0) as usize;
    format!("{t:.decimals$}")
}
