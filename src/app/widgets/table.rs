//! The table of the views: a click on a header sorts, the best of each column is bold, numbers can be shown relative to a chosen row.

use std::cmp::Ordering;

use egui::{
    self, Align2, Color32, CornerRadius, FontId, Id, Rect, Response, RichText, Role, Sense, Shape, Stroke, TextStyle,
    Ui, WidgetInfo, pos2, vec2,
};

use super::{Tip as _, chip};
use crate::app::theme;
use crate::catalog::numbers::Direction;

/// Height of a row in points.
const ROW_HEIGHT: f32 = 18.0;
/// Gap between two columns in points.
const GAP: f32 = 16.0;
/// Width in points that the mark of the sorted column takes.
const MARK: f32 = 12.0;

/// A table.
pub(crate) struct Table<'a> {
    /// Its title, which also identifies it among tables.
    pub(crate) title: &'a str,
    /// The columns; the texts of the first are at the left.
    pub(crate) columns: Vec<Column<'a>>,
    /// The rows as they come unsorted.
    pub(crate) rows: Vec<TableRow<'a>>,
    /// The effect of a double click on a row; `None` where it has none.
    pub(crate) opens: Option<&'a str>,
}

/// A column.
pub(crate) struct Column<'a> {
    /// Its name.
    pub(crate) name: &'a str,
    /// Its unit; empty for none.
    pub(crate) unit: &'a str,
    /// Where the better numbers are.
    pub(crate) better: Option<Direction>,
    /// Whether its best number differs from the others by more than chance; otherwise none is bold.
    pub(crate) has_best: bool,
}

/// A row.
pub(crate) struct TableRow<'a> {
    /// Its cells; missing ones are empty.
    pub(crate) cells: &'a [String],
    /// It belongs to the row before it, with which it moves, and is no row of its own.
    pub(crate) is_remark: bool,
    /// It is what is on the screen.
    pub(crate) is_shown: bool,
    /// A column whose number is preliminary, and therefore grey.
    pub(crate) preliminary: Option<usize>,
}

/// Acts of the user in a table, by the indices of rows.
#[derive(Default)]
pub(crate) struct TableResponse {
    /// The row that was double clicked.
    pub(crate) opened: Option<usize>,
    /// The row that is to be copied.
    pub(crate) copied: Option<usize>,
}

/// How the user looks at a table.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Look {
    /// The column by which it is sorted, and whether the smallest come first.
    sorted: Option<(usize, bool)>,
    /// The chosen row.
    chosen: Option<usize>,
    /// Numbers are shown as parts of those of the chosen row.
    is_relative: bool,
}

/// The row that is chosen in the table of this title.
pub(crate) fn chosen(ui: &Ui, title: &str) -> Option<usize> {
    ui.data(|data| data.get_temp::<Look>(Id::unique(("table", title))))?.chosen
}

/// Shows a table.
pub(crate) fn show(ui: &mut Ui, table: &Table<'_>) -> TableResponse {
    let id = Id::unique(("table", table.title));
    let mut look: Look = ui.data(|data| data.get_temp(id)).unwrap_or_default();
    look.chosen = look.chosen.filter(|&row| row < table.rows.len());
    let mut response = TableResponse::default();
    ui.horizontal(|ui| head(ui, table, &mut look, &mut response));
    let base = look.chosen.filter(|_| look.is_relative).map(|row| &table.rows[row]);
    let texts: Vec<Vec<String>> = table.rows.iter().map(|row| texts(row, base)).collect();
    let widths = widths(ui, table, &texts);
    let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
    header(ui, table, &widths, &mut look);
    let bests: Vec<Option<f64>> = (0..table.columns.len()).map(|column| best(table, column)).collect();
    for row in order(&table.rows, look.sorted) {
        let is_best = |column: usize| {
            let value = table.rows[row].cells.get(column).and_then(|cell| number(cell));
            bests.get(column).copied().flatten().is_some_and(|best| value == Some(best))
        };
        let line = show_row(ui, table, (row, &texts[row]), &widths, look.chosen == Some(row), &is_best);
        if line.clicked() && !table.rows[row].is_remark {
            look.chosen = if look.chosen == Some(row) && !line.double_clicked() { None } else { Some(row) };
        }
        if line.double_clicked() {
            (response.opened, look.chosen) = (Some(row), Some(row));
        }
        if line.secondary_clicked() {
            response.copied = Some(row);
        }
    }
    ui.spacing_mut().item_spacing.y = spacing;
    ui.data_mut(|data| data.insert_temp(id, look));
    response
}

/// Title, and what can be done with the chosen row.
fn head(ui: &mut Ui, table: &Table<'_>, look: &mut Look, response: &mut TableResponse) {
    ui.label(RichText::new(table.title).strong());
    if table.rows.len() < 2 {
        return;
    }
    let tip = "Show numbers as parts of those of the chosen row. A click on a row chooses it";
    ui.add_enabled_ui(look.chosen.is_some(), |ui| {
        if chip(ui, "% of the row", look.is_relative && look.chosen.is_some(), tip) {
            look.is_relative = !look.is_relative;
        }
        if ui.button("Copy row").tip("Copy the chosen row as tab-separated text").clicked() {
            response.copied = look.chosen;
        }
    });
}

/// Width of each column in points.
fn widths(ui: &Ui, table: &Table<'_>, texts: &[Vec<String>]) -> Vec<f32> {
    let font = TextStyle::Body.resolve(ui.style());
    let width_of = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), Color32::WHITE).size().x;
    let width = |(index, column): (usize, &Column<'_>)| {
        let cells = texts.iter().filter_map(|row| row.get(index)).map(|cell| width_of(cell));
        cells.chain([width_of(column.name) + MARK, width_of(column.unit)]).fold(0.0, f32::max)
    };
    table.columns.iter().enumerate().map(width).collect()
}

/// Names and units of the columns, which sort by a click.
fn header(ui: &mut Ui, table: &Table<'_>, widths: &[f32], look: &mut Look) {
    let has_units = table.columns.iter().any(|column| !column.unit.is_empty());
    let total = widths.iter().map(|width| width + GAP).sum::<f32>();
    let (rect, _) = ui.allocate_exact_size(vec2(total, ROW_HEIGHT), Sense::hover());
    let units = has_units.then(|| ui.allocate_exact_size(vec2(total, ROW_HEIGHT), Sense::hover()).0);
    let (font, dim) = (TextStyle::Body.resolve(ui.style()), theme::palette(ui).dim);
    let mut left = rect.left();
    for (index, (column, &width)) in table.columns.iter().zip(widths).enumerate() {
        let place = Rect::from_min_size(pos2(left, rect.top()), vec2(width, ROW_HEIGHT));
        let align = if index == 0 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
        if let Some(units) = units {
            let at = align.pos_in_rect(&place.translate(vec2(0.0, units.top() - rect.top())));
            ui.painter().text(at, align, column.unit, font.clone(), dim);
        }
        let sorted = look.sorted.filter(|(by, _)| *by == index).map(|(_, ascending)| ascending);
        let cell = HeaderCell {
            label: column.name,
            tip: "A click sorts by it, a second one the other way round",
            sorted,
            align,
        };
        if cell.show(ui, place, ui.scope_id().with(("sort", table.title, index))) {
            // The best come first.
            let first = column.better != Some(Direction::More) && table.rows.iter().any(|row| has_number(row, index));
            look.sorted = Some((index, sorted.map_or(first, |ascending| !ascending)));
        }
        left += width + GAP;
    }
}

/// The name of a column that sorts.
pub(crate) struct HeaderCell<'a> {
    /// Its name.
    pub(crate) label: &'a str,
    /// Its meaning.
    pub(crate) tip: &'a str,
    /// Whether the smallest come first; `None` where the list is not sorted by it.
    pub(crate) sorted: Option<bool>,
    /// Where in its place it is.
    pub(crate) align: Align2,
}

impl HeaderCell<'_> {
    /// Shows it; whether it was clicked.
    pub(crate) fn show(&self, ui: &Ui, place: Rect, id: Id) -> bool {
        let response = ui.interact(place, id, Sense::click());
        let name = format!("Sort by {}", self.label);
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, self.sorted.is_some(), &name));
        let palette = theme::palette(ui);
        let color = match (response.hovered() || response.has_focus(), self.sorted) {
            (true, _) => ui.visuals().strong_text_color(),
            (false, Some(_)) => palette.text,
            (false, None) => palette.dim,
        };
        let font = TextStyle::Body.resolve(ui.style());
        let text = ui.painter().text(self.align.pos_in_rect(&place), self.align, self.label, font, color);
        if let Some(ascending) = self.sorted {
            // Points down where the largest come first.
            let tip = if ascending { -3.0 } else { 3.0 };
            let beside = if self.align == Align2::LEFT_CENTER { text.right() + 8.0 } else { text.left() - 8.0 };
            let corners = [vec2(-3.5, -tip * 0.7), vec2(3.5, -tip * 0.7), vec2(0.0, tip)];
            let points = corners.map(|offset| pos2(beside, place.center().y) + offset).to_vec();
            ui.painter().add(Shape::convex_polygon(points, color, Stroke::NONE));
        }
        response.tip(self.tip.to_owned()).clicked()
    }
}

/// Shows the row of an index with these texts.
fn show_row(
    ui: &mut Ui,
    table: &Table<'_>,
    (index, texts): (usize, &[String]),
    widths: &[f32],
    is_chosen: bool,
    is_best: &dyn Fn(usize) -> bool,
) -> Response {
    let row = &table.rows[index];
    let total = widths.iter().map(|width| width + GAP).sum::<f32>();
    let (rect, response) = ui.allocate_exact_size(vec2(total, ROW_HEIGHT), Sense::CLICK);
    response.widget_info(|| WidgetInfo::selected(Role::ListItem, true, is_chosen, name_of(table, row)));
    let palette = theme::palette(ui);
    let fill = if is_chosen {
        Some(ui.visuals().selection.bg_fill)
    } else {
        response.hovered().then(|| ui.visuals().faint_bg_color)
    };
    if let Some(fill) = fill {
        ui.painter().rect_filled(rect, CornerRadius::same(4), fill);
    }
    let color = match (is_chosen, row.is_remark, row.is_shown) {
        (true, ..) => ui.visuals().selection.stroke.color,
        (_, true, _) => palette.dim,
        (_, _, true) => palette.warm,
        _ => palette.text,
    };
    let font = TextStyle::Body.resolve(ui.style());
    let mut left = rect.left();
    for (column, (text, &width)) in texts.iter().zip(widths).enumerate() {
        let place = Rect::from_min_size(pos2(left, rect.top()), vec2(width, ROW_HEIGHT));
        let align = if column == 0 { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
        let color = if row.preliminary == Some(column) { palette.dim } else { color };
        paint(ui, align.pos_in_rect(&place), align, text, &font, color, is_best(column));
        left += width + GAP;
    }
    let opens =
        table.opens.filter(|_| !row.is_remark).map_or_else(String::new, |opens| format!(", a double click {opens}"));
    response.tip(format!("A click chooses the row{opens}, a right click copies it"))
}

/// Paints a text, bold where it is the `best`: the font has no bold face.
fn paint(ui: &Ui, at: egui::Pos2, align: Align2, text: &str, font: &FontId, color: Color32, best: bool) {
    ui.painter().text(at, align, text, font.clone(), color);
    if best {
        ui.painter().text(at - vec2(0.6, 0.0), align, text, font.clone(), color);
    }
}

/// Accessible name of a row: "teapot.obj, triangles 6320, build box 3.07 ms".
fn name_of(table: &Table<'_>, row: &TableRow<'_>) -> String {
    let cells =
        table.columns.iter().zip(row.cells).enumerate().filter(|(index, (_, cell))| *index == 0 || !cell.is_empty());
    let part = |(index, (column, cell)): (usize, (&Column<'_>, &String))| match index {
        0 => cell.trim().to_owned(),
        _ => format!("{} {cell} {}", column.name, column.unit).trim().to_owned(),
    };
    cells.map(part).collect::<Vec<_>>().join(", ")
}

/// The number that a cell begins with; `None` where it is none.
fn number(cell: &str) -> Option<f64> {
    let plain: String = cell.trim().chars().filter(|character| *character != ',').collect();
    plain.parse().ok().filter(|number: &f64| number.is_finite())
}

fn has_number(row: &TableRow<'_>, column: usize) -> bool {
    row.cells.get(column).is_some_and(|cell| number(cell).is_some())
}

/// The cells of a row, of numbers as parts of those of `base`.
fn texts(row: &TableRow<'_>, base: Option<&TableRow<'_>>) -> Vec<String> {
    let text = |(column, cell): (usize, &String)| {
        let of = base.filter(|_| !row.is_remark).and_then(|base| number(base.cells.get(column)?));
        match (number(cell), of) {
            (Some(number), Some(of)) if of != 0.0 => format!("{:.1} %", number / of * 100.0),
            _ => cell.clone(),
        }
    };
    row.cells.iter().enumerate().map(text).collect()
}

/// The best number of a column; `None` where none is better than the others.
fn best(table: &Table<'_>, column: usize) -> Option<f64> {
    let better = table.columns[column].better.filter(|_| table.columns[column].has_best)?;
    let values: Vec<f64> =
        table.rows.iter().filter(|row| !row.is_remark).filter_map(|row| number(row.cells.get(column)?)).collect();
    let [least, most] = [f64::min, f64::max].map(|pick| values.iter().copied().reduce(pick));
    let best = if better == Direction::Less { least } else { most };
    best.filter(|_| least != most)
}

/// The order of the rows by a column, the smallest first or the largest; rows without a number come last, equal ones as they are.
/// Remarks follow their row.
fn order(rows: &[TableRow<'_>], sorted: Option<(usize, bool)>) -> Vec<usize> {
    let Some((column, ascending)) = sorted else { return (0..rows.len()).collect() };
    let starts: Vec<usize> = (0..rows.len()).filter(|&row| row == 0 || !rows[row].is_remark).collect();
    let ends = starts.iter().skip(1).copied().chain([rows.len()]);
    let mut groups: Vec<std::ops::Range<usize>> =
        starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect();
    let cell = |group: &std::ops::Range<usize>| rows[group.start].cells.get(column).map_or("", String::as_str);
    let turned = |order: Ordering| if ascending { order } else { order.reverse() };
    groups.sort_by(|a, b| match (number(cell(a)), number(cell(b))) {
        (Some(a), Some(b)) => turned(a.total_cmp(&b)),
        (Some(_), None) => Ordering::Less,
        (None, Some(_)) => Ordering::Greater,
        (None, None) => turned(cell(a).cmp(cell(b))),
    });
    groups.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a name and a number; indented ones are remarks.
    fn cells(rows: &[[&str; 2]]) -> Vec<Vec<String>> {
        rows.iter().map(|row| row.map(str::to_owned).to_vec()).collect()
    }

    fn rows(cells: &[Vec<String>]) -> Vec<TableRow<'_>> {
        let row = |cells| TableRow { cells, is_remark: false, is_shown: false, preliminary: None };
        cells.iter().map(|cells| TableRow { is_remark: cells[0].starts_with(' '), ..row(&cells[..]) }).collect()
    }

    #[test]
    fn rows_sort_by_numbers_and_remarks_follow() {
        let cells = cells(&[["b", "1,200"], ["  of b", "1"], ["a", "30"], ["c", "–"], ["d", "4.5"]]);
        let rows = rows(&cells);
        assert_eq!(order(&rows, None), [0, 1, 2, 3, 4]);
        assert_eq!(order(&rows, Some((1, true))), [4, 2, 0, 1, 3]);
        assert_eq!(order(&rows, Some((1, false))), [0, 1, 2, 4, 3], "without a number last");
        assert_eq!(order(&rows, Some((0, true))), [2, 0, 1, 3, 4], "by name");
        assert_eq!(order(&rows, Some((7, true))), [0, 1, 2, 3, 4], "no such column");
    }

    #[test]
    fn the_best_is_that_of_rows_alone_and_parts_are_of_the_chosen_row() {
        let cells = cells(&[["b", "200"], ["  of b", "1"], ["a", "50"], ["c", "–"]]);
        let column = |better| Column { name: "", unit: "", better, has_best: true };
        let better = [None, Some(Direction::Less), Some(Direction::More)];
        let best_of = |better| {
            best(&Table { title: "", columns: vec![column(None), column(better)], rows: rows(&cells), opens: None }, 1)
        };
        assert_eq!(better.map(best_of), [None, Some(50.0), Some(200.0)]);
        let rows = rows(&cells);
        let relative = |row: usize| texts(&rows[row], Some(&rows[0]))[1].clone();
        assert_eq!([0, 1, 2, 3].map(relative), ["100.0 %", "1", "25.0 %", "–"]);
    }
}
