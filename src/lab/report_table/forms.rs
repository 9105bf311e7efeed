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
    by_population(rows).iter().map(|rows| forms(&scene, rows)).collect()
}

fn forms(scene: &str, rows: &[&CostInForm]) -> ReportTable {
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
