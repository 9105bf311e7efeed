//! Tables of `layouts`: the trees, and what the rays of each population cost in them.

use super::aligned::ReportTable;
use super::format::{number, short};
use crate::catalog::layouts::NamedLayout;
use crate::lab::cost_row::{CostRow, by_population};
use crate::lab::layouts::LaidOut;
use crate::text::{count, counted};

/// The tables of the rows of one model.
pub fn layout_tables(rows: &[CostRow<LaidOut>]) -> Vec<ReportTable> {
    let of_rays = by_population(rows);
    std::iter::once(trees(rows)).chain(of_rays.iter().map(|rows| layout_costs(rows))).collect()
}

/// The trees, a row each.
fn trees(rows: &[CostRow<LaidOut>]) -> ReportTable {
    let columns = [
        ("layout", ""),
        ("nodes", ""),
        ("leaves", ""),
        ("full", "%"),
        ("a leaf", "triangles"),
        ("nodes", "MB"),
        ("tree", "MB"),
        ("SAH cost", ""),
        ("MSAH", "bytes"),
    ];
    let title = rows.first().map_or_else(
        || "Layouts".to_owned(),
        |row| format!("Layouts of {}, {}", short(&row.model), counted(row.triangles as u64, "triangles")),
    );
    let mut table = ReportTable::new(title, &columns);
    let mut known: Vec<NamedLayout> = Vec::new();
    for row in rows.iter().map(|row| &row.own) {
        if known.contains(&row.layout) {
            continue;
        }
        known.push(row.layout);
        let of = &row.numbers;
        let megabytes = |bytes: usize| format!("{:.2}", bytes as f64 / 1e6);
        table.rows.push(vec![
            row.layout.name(),
            count(of.layout_nodes as u64),
            count(of.layout_leaves as u64),
            format!("{:.1}", of.fullness * 100.0),
            format!("{:.2}", of.triangles_per_leaf),
            megabytes(of.node_bytes),
            megabytes(of.node_bytes + of.triangle_bytes),
            number(of.layout_sah_cost),
            number(of.msah_bytes),
        ]);
    }
    table.notes.push(
        "Layout: most children of a node, how they are chosen, planes of boxes, most triangles of a leaf. Engine: the program's own tree. SAH cost and MSAH (bytes that a random line through \
         the root reads) are those of the boxes as they are stored."
            .to_owned(),
    );
    table
}

/// The cost of the rays of one population in each tree.
pub fn layout_costs(rows: &[&LaidOut]) -> ReportTable {
    let columns = [
        ("layout", ""),
        ("front", ""),
        ("nodes", "a ray"),
        ("boxes", "a ray"),
        ("triangles", "a ray"),
        ("tests", "a ray"),
        ("lines of 64", "a ray"),
        ("lines of 128", "a ray"),
        ("bytes", "a ray"),
        ("stack", "at most"),
    ];
    let title = rows.first().map_or_else(String::new, |first| {
        format!("{}: {}", first.population.label(), counted(first.rays.rays, "rays"))
    });
    let mut table = ReportTable::new(title, &columns);
    for row in rows {
        let of = &row.rays;
        table.rows.push(vec![
            row.layout.name(),
            if row.on_front { "*" } else { "" }.to_owned(),
            number(of.nodes_per_ray),
            number(of.container_tests_per_ray),
            number(of.primitive_tests_per_ray),
            number(of.tests_per_ray),
            number(of.lines_64_per_ray),
            number(of.lines_128_per_ray),
            number(of.bytes_per_ray),
            count(of.greatest_stack),
        ]);
    }
    let differing: u64 = rows.iter().map(|row| row.rays.differing_hits).sum();
    table.notes.push(match differing {
        0 => "Front: no other layout reads fewer bytes and takes fewer tests. All hits are those of the program's own tree.".to_owned(),
        some => format!(
            "Front: no other layout reads fewer bytes and takes fewer tests. {} of all layouts hit something else than in the program's own tree.",
            counted(some, "rays")
        ),
    });
    table
}
