//! Actions of the menu "Help".

use egui::Key;

use super::parts::{CTRL, NONE, SHIFT, flip};
use crate::app::commands::lesson;
use crate::app::commands::row::{Item, Row, current, item, one};
use crate::app::state::action::Action;
use crate::app::state::{AppState, HelpPage};

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        one(Action::Palette, "Commands…", "Find and run any command by typing", &[(CTRL, Key::P)], |state, _| {
            let palette = &mut state.layout.palette;
            *palette = if palette.is_some() { None } else { Some(String::new()) };
        }),
        one(
            Action::Shortcuts,
            "Keys and mouse",
            "List every key and mouse gesture",
            &[(NONE, Key::F1), (NONE, Key::Questionmark)],
            |state, _| state.layout.toggle_help(HelpPage::Shortcuts),
        ),
        one(
            Action::Glossary,
            "Glossary",
            "Explain the words of the window, each with its source",
            &[(SHIFT, Key::F1)],
            |state, _| state.layout.toggle_help(HelpPage::Glossary),
        ),
        one(Action::Tour, "Tour", "Three cards on depth, threshold and heat map", &[], |state, _| {
            state.layout.close_dialogs();
            state.layout.tour = Some(0);
        }),
        one(
            Action::Messages,
            "Messages",
            "List all messages since the program started",
            &[(NONE, Key::F2)],
            |state, _| flip(&mut state.layout.messages_open),
        ),
    ],
    &[
        current(lessons, lesson::begin).within("Lessons"),
        one(Action::LessonNext, "Next step", "Go on in the lesson", &[(NONE, Key::PageDown)], |state, _| {
            lesson::next(state);
        })
        .when(|state, _| state.layout.lesson.is_some())
        .within("Lessons"),
        one(Action::LessonBack, "Step before", "Go back in the lesson", &[(NONE, Key::PageUp)], |state, _| {
            lesson::back(state);
        })
        .when(|state, _| state.layout.lesson.as_ref().is_some_and(|reading| reading.step > 0))
        .within("Lessons"),
        one(Action::LeaveLesson, "Leave lesson", "End the lesson; your own settings come back", &[], |state, _| {
            lesson::leave(state);
        })
        .when(|state, _| state.layout.lesson.is_some())
        .within("Lessons"),
    ],
    &[one(
        Action::About,
        "About bvhscope",
        "Version, graphics adapter, SIMD level, threads, memory and licences",
        &[],
        |state, _| flip(&mut state.layout.about_open),
    )],
];

fn lessons(state: &AppState) -> Vec<Item> {
    let lessons = state.layout.lessons.iter().enumerate();
    lessons.map(|(i, lesson)| item(Action::Lesson(i), format!("Lesson: {}", lesson.title), &*lesson.about)).collect()
}
