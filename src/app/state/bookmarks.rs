//! Camera bookmarks: named cameras, each of one model, saved with the preferences.

use serde::{Deserialize, Deserializer, Serialize};

use crate::camera::Camera;
use crate::scene::SceneSource;

/// Maximum number of bookmarks of all models; the oldest goes first.
const MAX_BOOKMARKS: usize = 200;

/// A named camera of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bookmark {
    /// The name, unique among the model's.
    pub name: String,
    /// The model that it was made for; files with their absolute path.
    pub source: SceneSource,
    /// The camera.
    pub camera: Camera,
}

/// Adds a bookmark of `camera` for `source` under the first free name "View N". Returns its name.
pub fn add(bookmarks: &mut Vec<Bookmark>, source: &SceneSource, camera: Camera) -> String {
    let source = source.absolute();
    let is_taken = |name: &str| bookmarks.iter().any(|known| known.source == source && known.name == name);
    let name = (1..=bookmarks.len() + 1)
        .map(|number| format!("View {number}"))
        .find(|name| !is_taken(name))
        .unwrap_or_default();
    bookmarks.push(Bookmark { name: name.clone(), source, camera });
    if bookmarks.len() > MAX_BOOKMARKS {
        bookmarks.remove(0);
    }
    name
}

/// The bookmarks of `source` with their indices.
pub fn own<'a>(bookmarks: &'a [Bookmark], source: &SceneSource) -> impl Iterator<Item = (usize, &'a Bookmark)> {
    let source = source.absolute();
    bookmarks.iter().enumerate().filter(move |(_, known)| known.source == source)
}

/// The index of the bookmark of `source` that follows the one with this camera, the first one's where the camera is none of
/// them; `None` where the model has no bookmarks.
pub fn next(bookmarks: &[Bookmark], source: &SceneSource, camera: &Camera) -> Option<usize> {
    let own: Vec<_> = own(bookmarks, source).collect();
    let present = own.iter().position(|(_, known)| known.camera == *camera);
    own.get(present.map_or(0, |place| (place + 1) % own.len())).map(|(index, _)| *index)
}

/// The bookmark of this name: `source`'s own, otherwise another model's.
pub fn find<'a>(bookmarks: &'a [Bookmark], name: &str, source: &SceneSource) -> Option<&'a Bookmark> {
    let source = source.absolute();
    let named = || bookmarks.iter().filter(|known| known.name.eq_ignore_ascii_case(name));
    named().find(|known| known.source == source).or_else(|| named().next())
}

/// Reads the bookmarks that can be used and passes over all others, so that one that is damaged takes no setting with it.
pub(super) fn usable<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Bookmark>, D::Error> {
    let all = Vec::<serde_json::Value>::deserialize(from)?;
    let read = all.into_iter().filter_map(|value| serde_json::from_value::<Bookmark>(value).ok());
    Ok(read.filter(|known| known.camera.is_usable()).take(MAX_BOOKMARKS).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::app::state::{Preferences, Wanted};
    use glam::Vec3;

    fn camera(x: f32) -> Camera {
        Camera { eye: Vec3::new(x, 0.0, 5.0), ..Wanted::new(SceneSource::default_builtin()).camera }
    }

    #[test]
    fn each_model_has_its_own_names_and_order() {
        let (a, b) = (SceneSource::File("/a.obj".into()), SceneSource::File("/b.obj".into()));
        let mut all = Vec::new();
        assert_eq!(next(&all, &a, &camera(0.0)), None);
        let names: Vec<String> =
            [(&a, 1.0), (&b, 2.0), (&a, 3.0)].iter().map(|(source, x)| add(&mut all, source, camera(*x))).collect();
        assert_eq!(names, ["View 1", "View 1", "View 2"]);
        assert_eq!(next(&all, &a, &camera(9.0)), Some(0));
        assert_eq!(next(&all, &a, &camera(1.0)), Some(2));
        assert_eq!(next(&all, &a, &camera(3.0)), Some(0));
        assert_eq!(find(&all, "view 1", &b).unwrap().camera, camera(2.0));
        assert_eq!(find(&all, "View 2", &b).unwrap().source, a, "another model's, where there is no own");
        assert_eq!(find(&all, "View 3", &a), None);
        all.remove(0);
        assert_eq!(add(&mut all, &a, camera(4.0)), "View 1", "a free name");
        for x in 0..300 {
            add(&mut all, &a, camera(x as f32));
        }
        assert_eq!(all.len(), MAX_BOOKMARKS);
    }

    #[test]
    fn a_damaged_bookmark_takes_nothing_with_it() {
        let mut preferences = Preferences { greeted: true, ..Preferences::default() };
        for x in [1.0, 2.0, 3.0] {
            add(&mut preferences.bookmarks, &SceneSource::default_builtin(), camera(x));
        }
        let mut value = serde_json::to_value(&preferences).unwrap();
        value["bookmarks"][0]["camera"] = serde_json::json!({ "eye": "here" });
        // A camera at its own target looks nowhere.
        value["bookmarks"][1]["camera"]["eye"] = value["bookmarks"][1]["camera"]["target"].clone();
        let read: Preferences = serde_json::from_value(value.clone()).unwrap();
        assert_eq!(read.bookmarks, preferences.bookmarks[2..]);
        assert!(read.greeted);
        // Version 0.1 had none.
        value.as_object_mut().unwrap().remove("bookmarks");
        assert!(serde_json::from_value::<Preferences>(value).unwrap().bookmarks.is_empty());
    }
}
