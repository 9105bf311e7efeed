//! The file of a lesson: lines of `name: value`, continued by indented lines. `title` and `about` come first; each `state` begins a
//! step.

use super::step::{Check, LessonStep, Numbers};
use crate::app::state::state_line::SharedState;

/// A lesson.
#[derive(Debug, Clone, PartialEq)]
pub struct Lesson {
    /// Its name in the menu.
    pub title: String,
    /// Subject of the lesson, in a sentence.
    pub about: String,
    /// Its steps; at least one.
    pub steps: Vec<LessonStep>,
}

impl Lesson {
    /// Reads a lesson; `Err` names the line and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lesson = Self { title: String::new(), about: String::new(), steps: Vec::new() };
        for (line, name, value) in fields(text)? {
            lesson.add(&name, value).map_err(|reason| format!("line {line}: {reason}"))?;
        }
        if lesson.title.is_empty() || lesson.steps.is_empty() {
            return Err("a lesson needs a title and at least one state".to_owned());
        }
        match lesson.steps.iter().position(|step| step.caption.is_empty()) {
            Some(step) => Err(format!("step {} has no caption", step + 1)),
            None => Ok(lesson),
        }
    }

    fn add(&mut self, name: &str, value: String) -> Result<(), String> {
        match (name, self.steps.last_mut()) {
            ("title", None) => self.title = value,
            ("about", None) => self.about = value,
            ("state", _) => {
                let state = SharedState::parse(&value)?;
                self.steps.push(LessonStep {
                    state,
                    caption: String::new(),
                    question: String::new(),
                    checks: Vec::new(),
                });
            }
            ("caption", Some(step)) => {
                unknown_number(&value).map_or(Ok(()), |name| Err(format!("there is no number {{{name}}}")))?;
                step.caption = value;
            }
            ("question", Some(step)) => step.question = value,
            ("check", Some(step)) => step.checks.push(Check::parse(&value)?),
            _ => return Err(format!("'{name}' is not expected here")),
        }
        Ok(())
    }
}

/// The fields of a file with the line that each begins at, from 1.
fn fields(text: &str) -> Result<Vec<(usize, String, String)>, String> {
    let mut fields: Vec<(usize, String, String)> = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        if content.trim().is_empty() || content.starts_with('#') {
            continue;
        }
        if content.starts_with([' ', '\t']) {
            let Some((_, _, value)) = fields.last_mut() else {
                return Err(format!("line {line}: an indented line continues nothing"));
            };
            value.push(' ');
            value.push_str(content.trim());
        } else if let Some((name, value)) = content.split_once(':') {
            fields.push((line, name.trim().to_owned(), value.trim().to_owned()));
        } else {
            return Err(format!("line {line}: 'name: value' is expected"));
        }
    }
    Ok(fields)
}

/// Text and the names in braces, in turn.
fn parts(text: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    text.split('{').enumerate().map(|(index, part)| match (index, part.split_once('}')) {
        (1.., Some((name, rest))) => (rest, Some(name)),
        _ => (part, None),
    })
}

/// The number's name in braces, and whether it is that of the step before.
fn number(name: &str) -> (&str, bool) {
    name.strip_prefix("before.").map_or((name, false), |name| (name, true))
}

/// The first name in braces that is no number.
fn unknown_number(text: &str) -> Option<&str> {
    parts(text).filter_map(|(_, name)| name).find(|name| !Numbers::is_name(number(name).0))
}

/// `text` with its numbers; an ellipsis for each that is not known.
pub(super) fn fill(text: &str, now: Option<&Numbers>, before: Option<&Numbers>) -> String {
    let value = |name: &str| {
        let (name, is_before) = number(name);
        let numbers = if is_before { before } else { now };
        numbers.and_then(|numbers| numbers.text(name)).unwrap_or("…").to_owned()
    };
    parts(text).map(|(rest, name)| name.map_or_else(String::new, value) + rest).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::lesson::LESSONS;

    #[test]
    fn built_in_lessons_can_be_read() {
        for text in LESSONS {
            let lesson = Lesson::parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert!(lesson.steps.len() >= 3, "{}", lesson.title);
            for step in &lesson.steps {
                let sentences = step.caption.matches(['.', '?', '!']).count();
                assert!(step.caption.len() < 420 && sentences >= 1, "{}: {}", lesson.title, step.caption);
                assert!(step.state.wanted.source.path().is_none(), "lessons need no files");
            }
            assert!(lesson.steps.last().unwrap().question.is_empty(), "{}: an open question at the end", lesson.title);
        }
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        let broken = |text: &str| Lesson::parse(text).unwrap_err();
        for (text, line, reason) in [
            ("title: a\n  \nnonsense", "line 3", "name: value"),
            ("  x", "line 1", "continues nothing"),
            ("title: a\ncaption: b", "line 2", "not expected"),
            ("title: a\nstate: 7 {}", "line 2", "version 7"),
            ("title: a\nstate: 1 {}\ncaption: {speed} is high", "line 3", "no number {speed}"),
            ("title: a\nstate: 1 {}\ncheck: tests", "line 3", "compares"),
            ("title: a\nstate: 1 {}\ncheck: tests < luck", "line 3", "'luck'"),
        ] {
            let error = broken(text);
            assert!(error.starts_with(line) && error.contains(reason), "{text}: {error}");
        }
        assert!(broken("title: a").contains("at least one state"));
        assert!(broken("title: a\nstate: 1 {}").contains("step 1 has no caption"));
    }

    #[test]
    fn numbers_are_put_into_captions() {
        assert_eq!(fill("a {tests} b {before.sah}c", None, None), "a … b …c");
        assert_eq!(fill("no number", None, None), "no number");
    }
}
