//! The table of trees by depth.

use super::aligned::ReportTable;
use super::format::number;
use crate::lab::by_depth::Depth;
use crate::lab::population::MeasuredRays;
use crate::text::count;

/// Most lines of a table; the depths below share the last one.
const MAX_LINES: usize = 64;

/// A tree by depth: its name above its columns, empty where it is the only one, its depths, and the sums of the rays that visited it.
pub type TreeByDepth<'a> = (&'a str, &'a [Depth], &'a [&'a MeasuredRays]);

/// Nodes, leaves, area, SAH cost, empty space and visits of each depth, of one tree or of several side by side.
pub fn depth_table(trees: &[TreeByDepth<'_>]) -> ReportTable {
    let names = ["nodes", "leaves", "area", "SAH cost", "empty %"];
    let populations = trees.first().map_or(&[][..], |tree| tree.2);
    let visits = populations.iter().map(|rays| rays.population.name());
    let mut columns = vec![("depth", "")];
    for name in names.into_iter().chain(visits) {
        columns.extend(trees.iter().map(|tree| (name, tree.0)));
    }
    let mut table = ReportTable::new("By depth", &columns);
    let deepest = trees.iter().map(|tree| tree.1.len()).max().unwrap_or(0);
    for line in 0..deepest.min(MAX_LINES) {
        let is_last = line + 1 == MAX_LINES && deepest > MAX_LINES;
        let found: Vec<Option<Depth>> = trees.iter().map(|tree| at(tree.1, line, is_last)).collect();
        let mut cells = vec![if is_last { format!("{line} to {}", deepest - 1) } else { line.to_string() }];
        let mut add = |text: &dyn Fn(&Depth, usize) -> String| {
            let cell = |(index, depth): (usize, &Option<Depth>)| depth.as_ref().map(|depth| text(depth, index));
            cells.extend(found.iter().enumerate().map(|found| cell(found).unwrap_or_default()));
        };
        add(&|depth, _| count(depth.nodes.into()));
        add(&|depth, _| count(depth.leaves.into()));
        add(&|depth, _| number(depth.area));
        add(&|depth, _| number(depth.sah_cost));
        add(&|depth, _| depth.empty_space.map_or_else(|| "–".to_owned(), |empty| number(100.0 * empty)));
        for (place, rays) in populations.iter().enumerate() {
            add(&|depth, tree| {
                let visits = depth.visits.get(rays.population.name()).copied().unwrap_or(0);
                number(visits as f64 / f64::from(trees[tree].2[place].root_hits.max(1)))
            });
        }
        table.rows.push(cells);
    }
    table.notes.push(
        "Area: over the root's, the expected visits by a random line. Empty: the part of interior nodes that their children leave \
         empty, by area."
            .to_owned(),
    );
    if !populations.is_empty() {
        table.notes.push("Rays: visits by a ray that enters the root.".to_owned());
    }
    table
}

/// The nodes at a depth, with those of all depths below where `and_below`.
fn at(depths: &[Depth], line: usize, and_below: bool) -> Option<Depth> {
    let first = depths.get(line)?.clone();
    let below = if and_below { &depths[line + 1..] } else { &[] };
    Some(below.iter().fold(first, Depth::with))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list of `count` levels, each with a leaf and an interior node.
    fn list(count: u32) -> Vec<Depth> {
        let level =
            |depth| Depth { depth, nodes: 2, leaves: 1, area: 0.5, empty_space: Some(0.25), ..Depth::default() };
        (0..count).map(level).collect()
    }

    #[test]
    fn trees_stand_side_by_side_and_what_is_deep_in_one_line() {
        let (a, b) = (list(2), list(100));
        let table = depth_table(&[("A", &a, &[]), ("B", &b, &[])]);
        assert_eq!(table.rows.len(), MAX_LINES);
        assert_eq!(table.columns[1..5].iter().map(|column| column.1.as_str()).collect::<String>(), "ABAB");
        assert_eq!(table.rows[1][..7].join(" "), "1 2 2 1 1 0.500 0.500");
        assert_eq!(table.rows[2][..7].join(" "), "2  2  1  0.500");
        let last: Vec<&str> = table.rows[MAX_LINES - 1].iter().map(String::as_str).collect();
        assert_eq!((last[0], last[2], last[4], last[6]), ("63 to 99", "74", "37", "18.50"));
    }
}
