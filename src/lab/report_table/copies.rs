//! Tables of `copies`: what the rays of each population cost above the copies, in each mesh, and in the dearest copies.

use super::aligned::ReportTable;
use super::format::{number, short};
use crate::lab::copy_boxes::BoxRatios;
use crate::lab::copy_costs::{CostInPart, PartKind};
use crate::lab::cost_row::{CostRow, by_population};
use crate::text::{count, counted};

/// The tables of the rows of one model.
pub fn copy_tables(rows: &[CostRow<CostInPart>]) -> Vec<ReportTable> {
    let model = rows.first().map_or_else(String::new, |row| short(&row.model));
    by_population(rows).iter().flat_map(|rows| [mesh_costs(&model, rows), dearest_copies(rows)]).collect()
}

/// Number of meshes that the table names.
const MOST_MESHES: usize = 20;
const COSTS: [(&str, &str); 7] = [
    ("entered", "a ray"),
    ("wasted", "%"),
    ("boxes", "a ray"),
    ("triangles", "a ray"),
    ("tests", "%"),
    ("turned box", "× own"),
    ("box above", "× own"),
];

/// The costs of a row, and how loose its boxes are, as [`COSTS`] names them.
fn costs(row: &CostInPart) -> [String; 7] {
    let percent = |part: Option<f64>| part.map_or_else(String::new, |part| format!("{:.1}", part * 100.0));
    let ratio = |of: fn(&BoxRatios) -> f64| {
        row.part.boxes.as_ref().map_or_else(String::new, |boxes| format!("{:.2}", of(boxes)))
    };
    let cost = &row.cost;
    let entered = if row.part.part == PartKind::Above { String::new() } else { number(cost.entered_per_ray) };
    [
        entered,
        percent(cost.wasted_share),
        number(cost.container_tests_per_ray),
        number(cost.primitive_tests_per_ray),
        percent(cost.share_of_tests),
        ratio(|boxes| boxes.mesh_box_ratio),
        ratio(|boxes| boxes.copy_box_ratio),
    ]
}

/// The whole scene `model`, the tree over the copies, and each mesh.
pub fn mesh_costs(model: &str, rows: &[&CostInPart]) -> ReportTable {
    let columns: Vec<(&str, &str)> =
        [("part", ""), ("copies", ""), ("a copy", "triangles")].into_iter().chain(COSTS).collect();
    let title = rows.first().map_or_else(String::new, |row| {
        format!("Copies of {model}, {}: {}", row.population.label(), counted(row.rays, "rays"))
    });
    let mut table = ReportTable::new(title, &columns);
    let (named, others): (Vec<&CostInPart>, Vec<&CostInPart>) = {
        // The dearest come first.
        let mut meshes = 0;
        rows.iter().copied().filter(|row| row.part.part != PartKind::Copy).partition(|row| {
            meshes += usize::from(row.part.part == PartKind::Mesh);
            row.part.part != PartKind::Mesh || meshes <= MOST_MESHES && row.cost.entered_per_ray > 0.0
        })
    };
    for row in named {
        let name = match (row.part.part, row.part.mesh) {
            (PartKind::Above, _) => "tree over the copies".to_owned(),
            (_, Some(mesh)) => format!("mesh {mesh}"),
            (_, None) => "whole scene".to_owned(),
        };
        let copies = if row.part.part == PartKind::Above { String::new() } else { count(row.part.copies) };
        let triangles = row.part.mesh_triangles.map_or_else(String::new, |triangles| count(triangles as u64));
        table.rows.push([name, copies, triangles].into_iter().chain(costs(row)).collect());
    }
    table.notes.push(
        "Entered: copies whose trees a ray is tested with; wasted: entries after which it ends elsewhere or nowhere. Tests: part of the tests of the scene."
            .to_owned(),
    );
    table.notes.extend(boxes_note(rows));
    if !others.is_empty() {
        let share: f64 = others.iter().filter_map(|row| row.cost.share_of_tests).sum();
        let meshes = counted(others.len() as u64, "other meshes");
        table.notes.push(format!("{meshes}: {:.1} % of the tests.", share * 100.0));
    }
    table
}

/// The meaning of the ratios of boxes, and over which copies they are means.
fn boxes_note(rows: &[&CostInPart]) -> Option<String> {
    let all = rows.iter().find(|row| row.part.part == PartKind::All)?;
    let measured = all.part.boxes?.measured_copies;
    let means = if measured < all.part.copies {
        format!("means over {} of {} copies, at equal distances in the list", count(measured), count(all.part.copies))
    } else {
        "means over all copies".to_owned()
    };
    Some(format!(
        "Turned box, box above: surface areas over that of the box of the copy's triangles, of the box around the turned box of the mesh and of the box that the tree over the copies has; {means}."
    ))
}

/// The copies that take most tests.
pub fn dearest_copies(rows: &[&CostInPart]) -> ReportTable {
    let columns: Vec<(&str, &str)> =
        [("copy", ""), ("mesh", ""), ("x", ""), ("y", ""), ("z", "")].into_iter().chain(COSTS).collect();
    let dearest: Vec<&CostInPart> = rows.iter().copied().filter(|row| row.part.part == PartKind::Copy).collect();
    let title = match dearest.len() {
        0 => "No ray is carried into a copy".to_owned(),
        some => format!("The {} with most tests", counted(some as u64, "copies")),
    };
    let mut table = ReportTable::new(title, &columns);
    for row in dearest {
        let whole = |number: Option<u32>| number.map_or_else(String::new, |number| number.to_string());
        let center = row.part.center.unwrap_or_default().map(|coordinate| number(f64::from(coordinate)));
        let named = [whole(row.part.copy), whole(row.part.mesh)].into_iter().chain(center);
        table.rows.push(named.chain(costs(row)).collect());
    }
    table
}
