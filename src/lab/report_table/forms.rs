//! Tables of `copies --open`: a scene of copies flat, in two levels and opened.

use super::aligned::ReportTable;
use super::format::{number, short};
use crate::lab::copy_forms::CostInForm;
use crate::lab::cost_row::{CostRow, by_population};
use crate::text::{count, counted};

/// The tables of the rows of one model, one for the rays of each population.
pub fn form_tables(rows: &[CostRow<CostInForm>]) -> Vec<ReportTable> {
    let scene = rows.first().map_or_else(String::new, |row| {
        format!("{} with {}", short(&row.model), counted(row.triangles as u64, "triangles"))
    });
    by_population(rows).iter().map(|rows| form_costs(&scene, rows)).collect()
}

/// The forms of `scene` with what the rays of one population cost in them.
pub fn form_costs(scene: &str, rows: &[&CostInForm]) -> ReportTable {
    let columns = [
        ("form", ""),
        ("parts", ""),
        ("ready", "ms"),
        ("trees", "MB"),
        ("entered", "a ray"),
        ("nodes", "a ray"),
        ("blocks", "a ray"),
        ("lines of 64", "a ray"),
    ];
    let title = rows.first().map_or_else(String::new, |row| {
        format!("{scene}, {}: {}", row.population.label(), counted(row.cost.rays, "rays"))
    });
    let mut table = ReportTable::new(title, &columns);
    table.notes.extend(fewest(rows));
    for row in rows {
        let (form, cost) = (&row.form, &row.cost);
        table.rows.push(vec![
            form.name(),
            form.parts.map_or_else(String::new, |parts| count(parts as u64)),
            number(form.ready_ms),
            format!("{:.1}", form.traced_bytes as f64 / 1e6),
            cost.entered_per_ray.map_or_else(String::new, number),
            number(cost.nodes_per_ray),
            number(cost.blocks_per_ray),
            number(cost.lines_64_per_ray),
        ]);
    }
    let differing: u64 = rows.iter().map(|row| row.cost.differing_hits).sum();
    let hits = match differing {
        0 => "All forms have the same hits.".to_owned(),
        some => format!("{} hit something else than in the first form.", counted(some, "rays")),
    };
    table.notes.push(format!(
        "Parts: of copies, in the tree above. Ready: one build each. Entered: parts whose mesh's tree a ray is tested with. Nodes have up to eight boxes, blocks up to four triangles or boxes of \
         parts. {hits}"
    ));
    table
}

/// The form of two levels with the fewest nodes and blocks, as the exact counts of these rays have it; `None` where there is one alone.
fn fewest(rows: &[&CostInForm]) -> Option<String> {
    let of_levels = |row: &&CostInForm| Some((row.form.open?, row.cost.visits_per_ray()));
    let mut levels: Vec<_> = rows.iter().filter(|row| row.cost.rays > 0).filter_map(of_levels).collect();
    levels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [first, .., last] = levels[..] else { return None };
    // Of equal ones the least opened, whose trees are the smallest.
    let best = levels.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = |open: f32| if open <= 1.0 { "whole copies".to_owned() } else { format!("opened to {open}") };
    let before = if best.0 > first.0 { format!(" ({}: {})", name(first.0), number(first.1)) } else { String::new() };
    let beyond = if best.0 < last.0 { "opened farther has no fewer" } else { "none was opened farther" };
    let flat = rows.iter().find(|row| row.form.open.is_none());
    let flat = flat.map_or_else(String::new, |row| format!(" Flat: {}.", number(row.cost.visits_per_ray())));
    let (name, visits) = (name(best.0), number(best.1));
    Some(format!(
        "Fewest nodes and blocks of these rays in two levels: {name}, {visits} a ray{before}; {beyond}.{flat}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::copy_forms::{Form, FormCost};
    use crate::lab::population::Population;

    /// A form opened so far, or flat, with so many nodes and blocks a ray.
    fn row(open: Option<f32>, visits: f64) -> CostInForm {
        let form = Form { form: "", open, parts: None, ready_ms: 1.0, traced_bytes: 1 };
        let cost = FormCost {
            rays: 8,
            hits: 4,
            differing_hits: 0,
            entered_per_ray: None,
            nodes_per_ray: visits - 1.0,
            blocks_per_ray: 1.0,
            lines_64_per_ray: 1.0,
        };
        CostInForm { form, population: Population::Primary, cost }
    }

    fn said(rows: &[CostInForm]) -> Option<String> {
        fewest(&rows.iter().collect::<Vec<_>>())
    }

    #[test]
    fn the_form_with_the_fewest_is_named_where_there_are_several() {
        let [whole, two, four] = [(1.0, 20.0), (2.0, 12.0), (4.0, 14.0)].map(|(open, visits)| row(Some(open), visits));
        let start = "Fewest nodes and blocks of these rays in two levels: ";
        let check = |rows: &[CostInForm], expected: &str| {
            assert_eq!(said(rows).as_deref(), Some(&*format!("{start}{expected}")));
        };
        let flat = row(None, 9.0);
        // In any order.
        check(
            &[four, flat, whole, two],
            "opened to 2, 12.00 a ray (whole copies: 20.00); opened farther has no fewer. Flat: 9.000.",
        );
        check(&[whole, two], "opened to 2, 12.00 a ray (whole copies: 20.00); none was opened farther.");
        check(&[whole, row(Some(2.0), 20.0)], "whole copies, 20.00 a ray; opened farther has no fewer.");
        assert_eq!(said(&[flat, whole]), None, "one form of two levels");
        assert_eq!(said(&[]), None);
    }
}
