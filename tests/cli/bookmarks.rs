//! Cameras that were kept in the window, on the command line.

use std::path::Path;

use assert_cmd::Command;
use bvhscope::app::state::{Preferences, Wanted, preferences};
use bvhscope::camera::Camera;
use bvhscope::scene::SceneSource;
use glam::Vec3;

/// Renders builtin:teapot:2 with `args` into `name` in `folder`, which is the home of the program; stderr and exit code.
fn render(folder: &Path, name: &str, args: &[&str]) -> (String, i32) {
    let output = Command::cargo_bin("bvhscope")
        .unwrap()
        .current_dir(folder)
        .env("XDG_DATA_HOME", folder)
        .args(["render", "builtin:teapot:2", "--size", "48x32", "-o", name])
        .args(args)
        .output()
        .unwrap();
    (String::from_utf8(output.stderr).unwrap(), output.status.code().unwrap())
}

#[test]
fn a_bookmark_is_a_camera_of_render() {
    let home = tempfile::tempdir().unwrap();
    let teapot = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) };
    let (error, code) = render(home.path(), "x.png", &["--bookmark", "View 1"]);
    assert_eq!(
        (error.contains("there is no bookmark 'View 1'") && error.contains("Ctrl+D"), code),
        (true, 1),
        "{error}"
    );

    let wanted = Wanted::new(teapot.clone());
    let camera = Camera { eye: Vec3::new(3.0, 4.0, 5.0), target: Vec3::Y, ..wanted.camera };
    let mut preferences = Preferences::default();
    preferences::add_bookmark(&mut preferences.bookmarks, &teapot, camera);
    let other = Camera { eye: Vec3::new(-6.0, 2.0, 1.0), ..camera };
    preferences::add_bookmark(&mut preferences.bookmarks, &SceneSource::File("/elsewhere/hall.obj".into()), camera);
    preferences::add_bookmark(&mut preferences.bookmarks, &SceneSource::File("/elsewhere/hall.obj".into()), other);
    let folder = home.path().join("bvhscope");
    std::fs::create_dir_all(&folder).unwrap();
    let saved = serde_json::json!({ "wanted": wanted, "preferences": preferences });
    std::fs::write(folder.join("settings.json"), saved.to_string()).unwrap();

    let picture = |name: &str| std::fs::read(home.path().join(name)).unwrap();
    let written = "bvhscope: wrote kept.png: 48×32 pixels\n".to_owned();
    assert_eq!(render(home.path(), "kept.png", &["--bookmark", "view 1"]), (written, 0));
    assert_eq!(render(home.path(), "typed.png", &["--eye", "3,4,5", "--target", "0,1,0"]).1, 0);
    assert_eq!(render(home.path(), "default.png", &[]).1, 0);
    assert_eq!(picture("kept.png"), picture("typed.png"));
    assert_ne!(picture("kept.png"), picture("default.png"));

    let (warning, code) = render(home.path(), "other.png", &["--bookmark", "View 2"]);
    assert_eq!((warning.contains("View 2 was kept for /elsewhere/hall.obj"), code), (true, 0), "{warning}");
    assert_eq!(render(home.path(), "typed.png", &["--eye", "-6,2,1", "--target", "0,1,0"]).1, 0);
    assert_eq!(picture("other.png"), picture("typed.png"));
    let (error, code) = render(home.path(), "x.png", &["--bookmark", "View 3"]);
    assert_eq!((error.contains("kept for this model are View 1"), code), (true, 1), "{error}");
    assert_eq!(render(home.path(), "x.png", &["--bookmark", "View 1", "--eye", "1,2,3"]).1, 2);
}
