//! Drags that are faster than the window is drawn: press, movement and release that arrive together are spread over several UI
//! frames, because the toolkit finds a pressed widget at the pointer's place at the end of a frame, and drops the movement of the
//! frame in which the button is released.

use egui::{Event, Pos2, RawInput, Ui};

/// Events of later UI frames, and the state of the pointer after those of earlier ones.
#[derive(Default)]
pub(crate) struct QuickDrags {
    later: Vec<Event>,
    pressed_at: Option<Pos2>,
}

impl QuickDrags {
    /// Number of `events` of the next UI frame. Movement up to `click_distance` points still is a click, and is not spread.
    fn of_next_frame(&mut self, events: &[Event], click_distance: f32) -> usize {
        let (mut after_press, mut has_moved) = (None, false);
        for (index, event) in events.iter().enumerate() {
            match *event {
                Event::PointerButton { pos, pressed: true, .. } => {
                    (self.pressed_at, after_press) = (Some(pos), Some(index + 1));
                }
                Event::PointerMoved(to) if self.pressed_at.is_some_and(|from| from.distance(to) > click_distance) => {
                    if let Some(end) = after_press {
                        return end;
                    }
                    has_moved = true;
                }
                Event::PointerButton { pressed: false, .. } if has_moved => return index,
                Event::PointerButton { pressed: false, .. } => (self.pressed_at, after_press) = (None, None),
                _ => {}
            }
        }
        events.len()
    }
}

impl egui::Plugin for QuickDrags {
    fn debug_name(&self) -> &'static str {
        "quick drags"
    }

    fn input_hook(&mut self, ctx: &egui::Context, input: &mut RawInput) {
        let click_distance = ctx.options(|options| options.input_options.max_click_dist);
        let mut events = std::mem::take(&mut self.later);
        events.append(&mut input.events);
        let count = self.of_next_frame(&events, click_distance);
        self.later = events.split_off(count);
        input.events = events;
    }

    fn on_end_pass(&mut self, ui: &mut Ui) {
        if !self.later.is_empty() {
            ui.ctx().request_repaint();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, PointerButton, pos2};

    fn button(x: f32, pressed: bool) -> Event {
        Event::PointerButton { pos: pos2(x, 0.0), button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
    }

    fn moved(x: f32) -> Event {
        Event::PointerMoved(pos2(x, 0.0))
    }

    /// Numbers of events in each UI frame.
    fn frames(mut events: Vec<Event>) -> Vec<usize> {
        let mut drags = QuickDrags::default();
        let mut counts = Vec::new();
        while !events.is_empty() {
            let count = drags.of_next_frame(&events, 6.0);
            events.drain(..count);
            counts.push(count);
        }
        counts
    }

    #[test]
    fn a_drag_takes_a_frame_for_press_movement_and_release_each() {
        let drag = [moved(0.0), button(0.0, true), moved(4.0), moved(160.0), button(160.0, false)];
        assert_eq!(frames(drag.to_vec()), [2, 2, 1]);
        assert_eq!(frames([drag.clone(), drag].concat()), [2, 2, 3, 2, 1], "two drags");
    }

    #[test]
    fn a_click_takes_one_frame_even_where_the_hand_trembles() {
        let click = [moved(0.0), button(0.0, true), moved(3.0), button(3.0, false)];
        assert_eq!(frames(click.to_vec()), [4]);
        assert_eq!(frames([click.clone(), click].concat()), [8], "a double click");
        assert_eq!(frames(vec![moved(0.0), moved(300.0), button(300.0, true), button(300.0, false)]), [4]);
    }

    #[test]
    fn the_end_of_a_longer_drag_is_not_lost() {
        let mut drags = QuickDrags::default();
        assert_eq!(drags.of_next_frame(&[button(0.0, true)], 6.0), 1);
        assert_eq!(
            drags.of_next_frame(&[moved(90.0), button(90.0, false)], 6.0),
            1,
            "the release is of the next frame"
        );
    }
}
