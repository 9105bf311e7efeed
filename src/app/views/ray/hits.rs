//! All hits of the ray as a list, as if no surface ended it, and what they say of the model.

use egui::{RichText, ScrollArea, Ui};

use crate::app::state::{AppState, Presented};
use crate::app::views::parts::{self, Cell};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::RayRecord;
use crate::render::Crossings;
use bvhscope_engine::query::closed::Edges;

/// Widths of the columns of distance and thickness in points.
const COLUMNS: [f32; 2] = [46.0, 40.0];

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented, record: &RayRecord) {
    let Crossings { hits, has_more } = &record.crossings;
    let palette = theme::palette(ui);
    let more = if *has_more { " and more" } else { "" };
    let title = format!("All hits: {}{more}", format::count(hits.len() as u64));
    let tip = "Every triangle on the ray, as if none ended it: which side it meets, the distance, and after every second surface how \
               thick the model is there. Both triangles of an edge are one surface. A click selects the leaf that holds the triangle";
    ui.horizontal(|ui| ui.label(RichText::new(title).color(palette.dim)).tip(tip));
    ScrollArea::vertical().id_salt("ray hits").auto_shrink(false).show_rows(
        ui,
        parts::ROW_HEIGHT,
        hits.len(),
        |ui, range| {
            for hit in hits.get(range).unwrap_or_default() {
                let Some(&leaf) = shown.accel.path_to(hit.triangle).last() else { continue };
                let name = format!("{} {}", hit.surfaces, if hit.is_front { "front" } else { "back" });
                let distance = format::significant(hit.t.into());
                let thickness =
                    hit.thickness.map_or_else(String::new, |thickness| format::significant(thickness.into()));
                let cells = [Cell { text: &distance, width: COLUMNS[0] }, Cell { text: &thickness, width: COLUMNS[1] }];
                let row = parts::node_row(ui, state, leaf, (&name, 6.0), &cells);
                row.tip(format!("Triangle {}", format::count(hit.triangle.into())));
            }
        },
    );
}

/// The surfaces along the ray in a sentence: "passes through 4 surfaces, 0.53 thick in all, and begins outside".
pub(super) fn passage(crossings: &Crossings, edges: Option<&Edges>) -> String {
    let surfaces = crossings.surfaces();
    let counted = format::counted(surfaces.into(), "surface");
    match (surfaces, edges) {
        (0, _) => "passes through no surface".to_owned(),
        _ if crossings.has_more => format!("passes through more than {counted}"),
        (_, Some(edges)) if !edges.is_closed() => format!("passes through {counted} of an open model"),
        _ if surfaces.is_multiple_of(2) => {
            let thickness = format::significant(crossings.thickness().into());
            format!("passes through {counted}, {thickness} thick in all, and begins outside")
        }
        (_, Some(_)) => format!("passes through {counted}, and begins inside"),
        (_, None) => format!("passes through {counted}: it begins inside, or the model is open"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Crossing;

    #[test]
    fn parity_says_where_a_ray_begins_unless_the_model_is_open() {
        let through = |surfaces: u32| {
            let hit = |surfaces: u32| Crossing {
                t: surfaces as f32,
                triangle: 0,
                is_front: surfaces % 2 == 1,
                surfaces,
                thickness: surfaces.is_multiple_of(2).then_some(1.0),
            };
            Crossings { hits: (1..=surfaces).map(hit).collect(), has_more: false }
        };
        let [closed, open] = [0, 3].map(|open| Edges { count: 9, open, ..Edges::default() });
        assert!(passage(&through(4), Some(&closed)).ends_with("4 surfaces, 2.00 thick in all, and begins outside"));
        assert!(passage(&through(3), Some(&closed)).ends_with("3 surfaces, and begins inside"));
        assert!(passage(&through(3), None).ends_with("begins inside, or the model is open"));
        assert!(passage(&through(4), Some(&open)).ends_with("4 surfaces of an open model"));
        assert!(passage(&through(0), Some(&open)).ends_with("no surface"));
    }
}
