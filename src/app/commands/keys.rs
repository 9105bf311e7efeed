//! All keys and mouse gestures, for the help dialog and `docs/keys.md`.

use super::entries::entries;
use super::row::Category;

/// Mouse gestures, each with its effect.
const GESTURES: [(&str, &str); 11] = [
    ("Left drag", "Orbit around the target"),
    ("Wheel", "Zoom to the point under the pointer"),
    ("Right drag, middle drag, Shift+left drag", "Pan"),
    ("Click", "Select the triangle, its leaf and the path to the root"),
    ("Double click", "Focus on the point; on the background reset the view"),
    ("W A S D, Q E", "Fly, in fly mode; Shift is faster"),
    ("Drop a file", "Open it; the camera stays if the model is still in view"),
    ("Drag on the depth bar", "Choose depths; Shift moves the range, double click shows all"),
    ("Double click on a slider", "Back to its default"),
    ("Click on a number", "Copy it"),
    ("Right click on a number", "Copy it with its name, or explain it"),
];

/// Keys or gestures under a heading, each with its effect.
pub type KeyList = (&'static str, Vec<(String, &'static str)>);

/// Mouse gestures, then the keys of each menu in its order.
pub fn keys() -> Vec<KeyList> {
    let mouse = GESTURES.map(|(gesture, effect)| (gesture.to_owned(), effect)).into();
    let menus = Category::ALL.into_iter().map(|category| {
        let with_keys = entries().iter().filter(|entry| entry.category == category && !entry.shortcuts.is_empty());
        (category.label(), with_keys.map(|entry| (entry.keys(), entry.label.as_str())).collect())
    });
    std::iter::once(("Mouse", mouse)).chain(menus).collect()
}
