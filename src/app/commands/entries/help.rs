//! Entries of the menu "Help".

use egui::Key;

use super::list::{CTRL, List, NONE, SHIFT};
use crate::app::commands::action::Action;
use crate::app::commands::entry::Category;

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = (Category::Help, 0);
    list.add(place, Action::Palette, "Commands…", "Find and run any command by typing", &[(CTRL, Key::P)]);
    list.add(
        place,
        Action::Shortcuts,
        "Keys and mouse",
        "List every key and mouse gesture",
        &[(NONE, Key::F1), (NONE, Key::Questionmark)],
    );
    list.add(
        place,
        Action::Glossary,
        "Glossary",
        "Explain the words of the window, each with its source",
        &[(SHIFT, Key::F1)],
    );
    list.add(place, Action::Tour, "Tour", "Three cards on depth, threshold and heat map", &[]);
    list.add(place, Action::LessonNext, "Next step", "Go on in the lesson", &[(NONE, Key::PageDown)]);
    list.add(place, Action::LessonBack, "Step before", "Go back in the lesson", &[(NONE, Key::PageUp)]);
    list.add(place, Action::LeaveLesson, "Leave lesson", "End the lesson; your own settings come back", &[]);
    list.add(place, Action::Messages, "Messages", "List all messages since the program started", &[(NONE, Key::F2)]);
    let place = (Category::Help, 1);
    list.add(
        place,
        Action::About,
        "About bvhscope",
        "Version, graphics adapter, SIMD level, threads, memory and licences",
        &[],
    );
}
