//! Actions of the menu "Help", and reading lessons: begin, next step, back, and the reader's own settings at the end.

use egui::Key;

use crate::app::commands::clipboard::{shared_state, show_state};
use crate::app::commands::row::{CTRL, Item, NONE, Row, SHIFT, current, flip, item, one};
use crate::app::state::action::Action;
use crate::app::state::lesson::Reading;
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
        current(lessons, begin_lesson).within("Lessons"),
        one(Action::LessonNext, "Next step", "Go on in the lesson", &[(NONE, Key::PageDown)], |state, _| {
            next_step(state);
        })
        .when(|state, _| state.layout.lesson.is_some())
        .within("Lessons"),
        one(Action::LessonBack, "Step before", "Go back in the lesson", &[(NONE, Key::PageUp)], |state, _| {
            step_back(state);
        })
        .when(|state, _| state.layout.lesson.as_ref().is_some_and(|reading| reading.step > 0))
        .within("Lessons"),
        one(Action::LeaveLesson, "Leave lesson", "End the lesson; your own settings come back", &[], |state, _| {
            leave_lesson(state);
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

/// Begins the lesson of this index. What the window shows is put aside, once.
pub(super) fn begin_lesson(state: &mut AppState, index: usize) {
    let Some(lesson) = state.layout.lessons.get(index).cloned() else { return };
    let put_aside = state.layout.lesson.take().map_or_else(|| shared_state(state), |reading| *reading.put_aside);
    state.layout.close_dialogs();
    state.end_tour();
    state.layout.lesson = Some(Reading::new(lesson, put_aside));
    show_step(state);
}

/// Shows the next step, or ends the lesson after its last.
pub(super) fn next_step(state: &mut AppState) {
    let Some(reading) = &mut state.layout.lesson else { return };
    if reading.step + 1 < reading.lesson.steps.len() {
        reading.step += 1;
        show_step(state);
    } else {
        leave_lesson(state);
    }
}

/// Shows the step before.
pub(super) fn step_back(state: &mut AppState) {
    let Some(reading) = state.layout.lesson.as_mut().filter(|reading| reading.step > 0) else { return };
    reading.step -= 1;
    show_step(state);
}

/// Ends the lesson; the reader's own state comes back.
pub(super) fn leave_lesson(state: &mut AppState) {
    if let Some(reading) = state.layout.lesson.take() {
        show_state(state, *reading.put_aside);
    }
}

fn show_step(state: &mut AppState) {
    if let Some(shared) = state.layout.lesson.as_ref().map(|reading| reading.current().state.clone()) {
        show_state(state, shared);
    }
}
