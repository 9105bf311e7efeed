//! The tour of the first start: cards that point at the depth bar, the threshold and the shading, and can be skipped.

use egui::{
    self, Align2, Area, CornerRadius, Frame, Id, Key, Label, Margin, Order, Pos2, Rect, RichText, Shape, Stroke,
    StrokeKind, Ui, vec2,
};

use crate::app::state::{AppState, Severity, Side};
use crate::app::theme;
use crate::app::widgets::{Tip as _, hush, note_front, place_of};
use crate::render::{HeatKind, Shading};

/// Largest width of a card in points.
const WIDTH: f32 = 280.0;
/// Distance between a card and what it points at, in points.
const GAP: f32 = 16.0;
/// Width at the lower left of the viewport in points, where the legend is.
const LEGEND_WIDTH: f32 = 232.0;

/// One card.
struct Card {
    title: &'static str,
    text: &'static str,
    /// Name of the place it points at; see [`place_of`].
    place: &'static str,
    /// The place is in the right panel; otherwise it is below the viewport.
    in_right_panel: bool,
}

const CARDS: [Card; 3] = [
    Card {
        title: "Look into the tree",
        text: "Containers lie within containers. Drag along this bar to choose the levels that are drawn over the model; depth 0 holds everything.",
        place: "Depth bar",
        in_right_panel: false,
    },
    Card {
        title: "Change the tree",
        text: "Drag the threshold: the tree is built anew at once, and the numbers at the upper left turn blue where it became better, orange where worse. They may disagree: SAH predicts what rays cost, tests are counted.",
        place: "Threshold",
        in_right_panel: true,
    },
    Card {
        title: "See where rays are expensive",
        text: "Choose a heat map: bright pixels needed many tests. A good tree is dark nearly everywhere. Alt+1 brings the lit picture back.",
        place: "Shading",
        in_right_panel: true,
    },
];

/// Shows the current card within `rect`, the viewport's rectangle; starts the tour at the first start.
pub(crate) fn tour(ui: &Ui, rect: Rect, state: &mut AppState) {
    // An error, for instance that the model cannot be read, comes before what the tour has to say.
    let failed = state.messages.open.iter().any(|message| message.severity == Severity::Error);
    let ready = state.model.presented.is_some() && !state.layout.has_dialog() && !failed;
    if !state.preferences.toured && state.layout.tour.is_none() && ready {
        if state.preferences.greeted {
            state.preferences.toured = true;
        } else {
            state.layout.tour = Some(0);
        }
    }
    let card = state.layout.tour.filter(|_| ready).and_then(|index| Some((index, CARDS.get(index)?)));
    let visible = card.is_some_and(|(_, card)| !card.in_right_panel || state.shows_panel(Side::Right));
    let place = card.and_then(|(_, card)| place_of(ui.ctx(), card.place)).filter(|_| visible);
    hush(ui.ctx(), place);
    let Some((index, card)) = card else { return };
    let (at, pivot) = match place {
        Some(place) if card.in_right_panel => (Pos2::new(rect.right() - GAP, place.center().y), Align2::RIGHT_CENTER),
        // Beside the legend.
        Some(_) => {
            let x = rect.center().x.max(rect.left() + LEGEND_WIDTH + 0.5 * WIDTH + GAP);
            (Pos2::new(x, rect.bottom() - GAP), Align2::CENTER_BOTTOM)
        }
        None => (rect.center(), Align2::CENTER_CENTER),
    };
    let area = Area::new(Id::unique("tour"))
        .order(Order::Foreground)
        .pivot(pivot)
        .fixed_pos(at)
        .constrain_to(rect.shrink(4.0))
        .accessible_name("Tour");
    let shown = area.show(ui.ctx(), |ui| content(ui, state, index, card, rect.width() - 2.0 * GAP));
    note_front(ui.ctx(), shown.response.rect);
    if let Some(place) = place {
        point_at(ui, shown.response.rect, place, card.in_right_panel);
    }
}

/// Title, text and buttons of a card.
fn content(ui: &mut Ui, state: &mut AppState, index: usize, card: &Card, available: f32) {
    let palette = theme::palette(ui);
    let frame = Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(Stroke::new(1.5, palette.accent))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin::symmetric(12, 10));
    frame.show(ui, |ui| {
        ui.set_width(WIDTH.min(available - 24.0).max(120.0));
        ui.horizontal(|ui| {
            ui.label(RichText::new(card.title).strong().color(palette.text));
            ui.label(RichText::new(format!("{} of {}", index + 1, CARDS.len())).small().color(palette.dim));
        });
        ui.add(Label::new(card.text).wrap());
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            let last = index + 1 == CARDS.len();
            let (label, tip) = if last {
                ("Show the heat map", "Choose it and end the tour (Enter)")
            } else {
                ("Next", "Go to the next card (Enter)")
            };
            let text = RichText::new(label).color(ui.visuals().selection.stroke.color);
            let next = ui.add(egui::Button::new(text).fill(ui.visuals().selection.bg_fill)).tip(tip);
            let entered = !ui.ctx().text_edit_focused() && ui.input(|input| input.key_pressed(Key::Enter));
            if next.clicked() || entered {
                state.layout.tour = Some(index + 1);
                if last {
                    state.wanted.render.shading = Shading::Heat(HeatKind::Both);
                    state.preferences.greeted = true;
                    state.end_tour();
                }
            }
            if !last && ui.button("Skip").tip("End the tour (Esc); Help → Tour starts it again").clicked() {
                state.end_tour();
            }
            if last && ui.button("Open a model…").tip("Built-in scenes, recent files and your own (Ctrl+N)").clicked()
            {
                state.preferences.greeted = true;
                state.end_tour();
                state.layout.start_page_open = true;
            }
        });
    });
}

/// A frame around the place, and an arrow from the card to it.
fn point_at(ui: &Ui, card: Rect, place: Rect, to_the_right: bool) {
    let color = theme::palette(ui).accent;
    // Over the panels, below an open list.
    let painter = ui.ctx().layer_painter(egui::LayerId::new(Order::Middle, Id::unique("tour pointer")));
    painter.rect_stroke(place.expand(3.0), CornerRadius::same(5), Stroke::new(1.5, color), StrokeKind::Outside);
    let arrow = if to_the_right {
        let y = place.center().y.clamp(card.top() + 8.0, card.bottom() - 8.0);
        [card.right_top(), card.right_top(), card.right_top()].map(|at| Pos2::new(at.x, y)).to_vec()
    } else {
        vec![Pos2::new(card.center().x, card.bottom()); 3]
    };
    let offsets = if to_the_right {
        [vec2(0.0, -7.0), vec2(10.0, 0.0), vec2(0.0, 7.0)]
    } else {
        [vec2(-7.0, 0.0), vec2(0.0, 10.0), vec2(7.0, 0.0)]
    };
    let points = arrow.into_iter().zip(offsets).map(|(at, offset)| at + offset).collect();
    painter.add(Shape::convex_polygon(points, color, Stroke::NONE));
}
