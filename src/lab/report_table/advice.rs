//! Tables of `copies --advice`: a scene of copies with a mesh in parts, or with two as one.

use std::cmp::Ordering;

use super::aligned::ReportTable;
use super::format::{number, short};
use crate::lab::copy_advice::{CostOfChange, MeshChange};
use crate::lab::cost_row::{CostRow, by_population};
use crate::text::counted;

/// Part of the nodes and blocks that a change must save to be named: any other tree over the copies has a few more or fewer.
const LEAST_SAVED: f64 = 0.01;

/// The tables of the rows of one model, one for the rays of each population.
pub fn advice_tables(rows: &[CostRow<CostOfChange>]) -> Vec<ReportTable> {
    let model = rows.first().map_or_else(String::new, |row| short(&row.model));
    by_population(rows).iter().map(|rows| advice_costs(&model, rows)).collect()
}

/// The changes of `scene` with what they save the rays of one population.
pub fn advice_costs(scene: &str, rows: &[&CostOfChange]) -> ReportTable {
    let columns =
        [("change", ""), ("entered", "a ray"), ("nodes", "%"), ("blocks", "%"), ("both", "%"), ("bytes", "%")];
    let title = rows.first().map_or_else(String::new, |row| {
        format!("Other meshes for {scene}, {}: {}", row.population.label(), counted(row.cost.rays, "rays"))
    });
    let mut table = ReportTable::new(title, &columns);
    for row in rows.iter().filter(|row| row.change != MeshChange::None) {
        let differences = &row.differences;
        let changes =
            [differences.nodes_change, differences.blocks_change, differences.visits_change, differences.bytes_change];
        let entered = row.cost.entered_per_ray.map_or_else(String::new, number);
        table.rows.push([name(&row.change), entered].into_iter().chain(changes.map(percent)).collect());
    }
    let Some(as_it_is) = rows.iter().find(|row| row.change == MeshChange::None) else { return table };
    table.notes.push(format!(
        "Nodes and blocks of both levels that a ray visits, and bytes of the trees, against those of the scene as it is: {} nodes and {} blocks a ray, {:.1} MB.",
        number(as_it_is.cost.nodes_per_ray),
        number(as_it_is.cost.blocks_per_ray),
        as_it_is.traced_bytes as f64 / 1e6
    ));
    table.notes.extend([splits(rows), merges(rows)].into_iter().flatten());
    table.notes.push(measured(as_it_is));
    table.notes.extend(hits(rows));
    table
}

/// A change in a table.
fn name(change: &MeshChange) -> String {
    match change {
        MeshChange::None => "as it is".to_owned(),
        MeshChange::Split { mesh, parts } => format!("mesh {mesh} in {parts} parts"),
        MeshChange::Merge { mesh, with_mesh } => format!("meshes {mesh} and {with_mesh} as one"),
    }
}

/// A difference in percent with its sign.
fn percent(change: Option<f64>) -> String {
    let text = change.map_or_else(String::new, |change| format!("{:+.1}", change * 100.0));
    // No sign of what is rounded away.
    if text == "-0.0" || text == "+0.0" { "0.0".to_owned() } else { text }
}

/// The part of nodes and blocks that a change saves, where it is enough to be named.
fn saved(row: &CostOfChange) -> Option<f64> {
    row.differences.visits_change.map(|change| -change).filter(|&saved| saved >= LEAST_SAVED)
}

/// A change and what it saves, in a sentence.
fn praise(row: &CostOfChange) -> Option<String> {
    let bytes = percent(row.differences.bytes_change);
    saved(row).map(|saved| format!("{} ({:.1} % fewer, bytes {bytes} %)", name(&row.change), saved * 100.0))
}

/// The number of parts that saves most of each mesh, or that none does.
fn splits(rows: &[&CostOfChange]) -> Option<String> {
    let mut best: Vec<(u32, &CostOfChange)> = Vec::new();
    for row in rows {
        let MeshChange::Split { mesh, .. } = row.change else { continue };
        match best.iter_mut().find(|(other, _)| *other == mesh) {
            // Of equal ones the one of the fewest parts, which comes first.
            Some((_, best)) if saved(row) > saved(best) => *best = row,
            Some(_) => {}
            None => best.push((mesh, row)),
        }
    }
    verdict("Splitting", best.into_iter().map(|(mesh, row)| (format!("mesh {mesh}"), row)))
}

/// The pairs that are better as one, and those that are not.
fn merges(rows: &[&CostOfChange]) -> Option<String> {
    let pair = |row: &&CostOfChange| match row.change {
        MeshChange::Merge { mesh, with_mesh } => Some(format!("meshes {mesh} and {with_mesh}")),
        _ => None,
    };
    verdict("Merging", rows.iter().filter_map(|row| Some((pair(row)?, *row))))
}

/// The `changes` that pay, those that save most first, and the names of the others; `None` where there are none.
fn verdict<'a>(kind: &str, changes: impl Iterator<Item = (String, &'a CostOfChange)>) -> Option<String> {
    let (mut paying, others): (Vec<_>, Vec<_>) = changes.partition(|(_, row)| saved(row).is_some());
    paying.sort_by(|(_, a), (_, b)| saved(b).partial_cmp(&saved(a)).unwrap_or(Ordering::Equal));
    let praised: Vec<String> = paying.iter().filter_map(|(_, row)| praise(row)).collect();
    let others: Vec<String> = others.into_iter().map(|(name, _)| name).collect();
    match (praised.join("; "), others.join(", ")) {
        (praised, others) if praised.is_empty() && others.is_empty() => None,
        (praised, others) if praised.is_empty() => Some(format!("{kind} does not pay for these rays: {others}.")),
        (praised, others) if others.is_empty() => Some(format!("{kind} pays for these rays: {praised}.")),
        (praised, others) => Some(format!("{kind} pays for these rays: {praised}. It does not pay for {others}.")),
    }
}

/// The number of meshes and pairs, and of those that were measured.
fn measured(row: &CostOfChange) -> String {
    let extent = &row.extent;
    let of = |measured: usize, all: usize, plural: &str| {
        let all_of_them = counted(all as u64, plural);
        if measured < all { format!("{measured} of {all_of_them}") } else { all_of_them }
    };
    let meshes = of(extent.measured_meshes, extent.entered_meshes, "meshes that rays are carried into");
    let pairs = match extent.pairs {
        0 => "no two of these stand together in all copies".to_owned(),
        pairs => of(extent.measured_pairs, pairs, "pairs of these whose copies stand together"),
    };
    format!("Measured, those with most tests first: {meshes}; {pairs}.")
}

/// A sentence on the rays that end where they end in the scene as it is; `None` where nothing else was measured.
fn hits(rows: &[&CostOfChange]) -> Option<String> {
    let of =
        |is_merge: bool| {
            let mut found = rows.iter().filter(move |row| matches!(row.change, MeshChange::Merge { .. }) == is_merge);
            let first = found.next()?;
            Some(found.fold(
                **first,
                |most, row| if row.cost.differing_hits > most.cost.differing_hits { **row } else { most },
            ))
        };
    let of_parts = of(false).filter(|_| rows.len() > 1).map(|most| match most.cost.differing_hits {
        0 => "With a mesh in parts all rays end at the same distance.".to_owned(),
        some => format!("With a mesh in parts {} end at another distance.", counted(some, "rays")),
    });
    let of_pairs = of(true).map(|most| {
        let share = 1.0 - most.cost.differing_hits as f64 / most.cost.rays.max(1) as f64;
        let rays = match most.cost.differing_hits {
            0 => "all".to_owned(),
            // Rounded down, so that these are not all.
            _ => format!("at least {} %", (share * 1e4).floor() / 1e2),
        };
        format!("With two as one, whose corners are rounded elsewhere, {rays} do to within 0.01 %.")
    });
    let sentences: Vec<String> = of_parts.into_iter().chain(of_pairs).collect();
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::copy_advice::{Differences, Extent};
    use crate::lab::copy_forms::FormCost;
    use crate::lab::population::Population;

    /// A change with so many nodes and blocks a ray for 40, and another number of bytes.
    fn row(change: MeshChange, visits: f64, bytes_change: f64) -> CostOfChange {
        let cost = FormCost {
            rays: 20_000,
            hits: 4,
            differing_hits: 0,
            entered_per_ray: Some(2.0),
            nodes_per_ray: 0.75 * visits,
            blocks_per_ray: 0.25 * visits,
            lines_64_per_ray: 1.0,
        };
        let share = Some(visits / 40.0 - 1.0);
        let differences = Differences {
            nodes_change: share,
            blocks_change: share,
            visits_change: share,
            bytes_change: Some(bytes_change),
        };
        let extent = Extent { entered_meshes: 9, measured_meshes: 8, pairs: 1, measured_pairs: 1 };
        CostOfChange { population: Population::Primary, change, traced_bytes: 2_500_000, cost, differences, extent }
    }

    fn split(mesh: u32, parts: usize, visits: f64) -> CostOfChange {
        row(MeshChange::Split { mesh, parts }, visits, 0.012)
    }

    fn merge(mesh: u32, with_mesh: u32, visits: f64) -> CostOfChange {
        row(MeshChange::Merge { mesh, with_mesh }, visits, -0.3)
    }

    fn table(rows: &[CostOfChange]) -> ReportTable {
        advice_costs("village", &rows.iter().collect::<Vec<_>>())
    }

    fn notes(rows: &[CostOfChange]) -> String {
        let as_it_is = row(MeshChange::None, 40.0, 0.0);
        table(&[&[as_it_is], rows].concat()).notes.join("\n")
    }

    #[test]
    fn rows_have_the_differences_with_their_signs() {
        let rows = [
            row(MeshChange::None, 40.0, 0.0),
            split(3, 4, 36.0),
            split(3, 8, 40.0001),
            split(4, 2, 39.9999),
            merge(2, 5, 42.0),
        ];
        let expected = [
            ["mesh 3 in 4 parts", "2.000", "-10.0", "-10.0", "-10.0", "+1.2"],
            ["mesh 3 in 8 parts", "2.000", "0.0", "0.0", "0.0", "+1.2"],
            ["mesh 4 in 2 parts", "2.000", "0.0", "0.0", "0.0", "+1.2"],
            ["meshes 2 and 5 as one", "2.000", "+5.0", "+5.0", "+5.0", "-30.0"],
        ];
        assert_eq!(table(&rows).rows, expected);
        let notes = table(&rows).notes.join("\n");
        assert!(notes.contains("as it is: 30.00 nodes and 10.00 blocks a ray, 2.5 MB."), "{notes}");
        let measured = "8 of 9 meshes that rays are carried into; 1 pair of these whose copies stand together.";
        assert!(notes.contains(measured), "{notes}");
    }

    #[test]
    fn the_number_of_parts_that_saves_most_is_named() {
        let check = |rows: &[CostOfChange], expected: &str| {
            let notes = notes(rows);
            assert!(notes.lines().any(|note| note == expected), "{notes}");
        };
        let rows = [split(1, 2, 39.0), split(1, 4, 38.0), split(1, 8, 38.0), split(0, 2, 41.0), split(7, 2, 30.0)];
        check(
            &rows,
            "Splitting pays for these rays: mesh 7 in 2 parts (25.0 % fewer, bytes +1.2 %); mesh 1 in 4 parts (5.0 % fewer, bytes \
             +1.2 %). It does not pay for mesh 0.",
        );
        check(&rows[..2], "Splitting pays for these rays: mesh 1 in 4 parts (5.0 % fewer, bytes +1.2 %).");
        // Less than a hundredth is nothing.
        check(&[split(0, 2, 41.0), split(4, 2, 39.7)], "Splitting does not pay for these rays: mesh 0, mesh 4.");
        check(
            &[merge(0, 1, 36.0), merge(0, 2, 44.0)],
            "Merging pays for these rays: meshes 0 and 1 as one (10.0 % fewer, bytes -30.0 %). It does not pay for meshes 0 and 2.",
        );
        let nothing = notes(&[]);
        assert!(!nothing.contains("pay") && !nothing.contains("distance"), "{nothing}");
    }

    #[test]
    fn the_part_of_rays_that_end_elsewhere_is_said() {
        let mut other = merge(0, 1, 36.0);
        other.cost.differing_hits = 1;
        let (split, merge) = (split(0, 2, 36.0), merge(0, 2, 36.0));
        let of_all = notes(&[split, merge]);
        assert!(of_all.contains("rounded elsewhere, all do to within 0.01 %."), "{of_all}");
        let notes = notes(&[split, merge, other]);
        assert!(notes.contains("With a mesh in parts all rays end at the same distance."), "{notes}");
        // 19,999 of 20,000 are 99.995 %.
        assert!(notes.contains("at least 99.99 % do to within 0.01 %"), "{notes}");
        let mut wrong = split;
        wrong.cost.differing_hits = 3;
        let notes = table(&[row(MeshChange::None, 40.0, 0.0), split, wrong]).notes.join("\n");
        assert!(notes.contains("With a mesh in parts 3 rays end at another distance."), "{notes}");
    }
}
