//! Cameras of the measuring commands: the default one, several in a run, and those from which few rays enter the model.

use assert_cmd::Command;
use serde_json::Value;

/// Rows and stderr of `bench` of a model.
fn bench(model: &str, flags: &[&str]) -> (Vec<Value>, String) {
    let common = ["--container", "box", "--size", "48x48", "--repeat", "1", "--json"];
    let output =
        Command::cargo_bin("bvhscope").unwrap().arg("bench").arg(model).args(common).args(flags).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success(), "{error}");
    (out.lines().map(|line| serde_json::from_str(line).unwrap()).collect(), error)
}

/// A hall with the fronts of its walls inward, and its path.
fn hall(folder: &std::path::Path) -> String {
    let mut text = String::new();
    for [x, y, z] in [[0, 0, 0], [9, 0, 0], [9, 3, 0], [0, 3, 0], [0, 0, 4], [9, 0, 4], [9, 3, 4], [0, 3, 4]] {
        text += &format!("v {x} {y} {z}\n");
    }
    text += "f 1 2 3 4\nf 5 8 7 6\nf 1 4 8 5\nf 2 6 7 3\nf 1 5 6 2\nf 4 3 7 8\n";
    let path = folder.join("hall.obj");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn a_room_is_measured_from_inside_and_an_object_from_outside_unless_cameras_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let hall = hall(folder.path());
    let cameras = |model: &str, flags: &[&str]| -> Vec<String> {
        bench(model, flags).0.iter().map(|row| row["camera"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(cameras(&hall, &[]), ["inside"]);
    assert_eq!(cameras("builtin:teapot", &[]), ["outside"]);
    assert_eq!(cameras(&hall, &["--camera", "default,outside", "--camera", "front"]), ["inside", "outside", "front"]);
    assert_eq!(cameras("builtin:teapot", &["--camera", "default,outside"]), ["outside"], "one place");
    assert_eq!(cameras(&hall, &["--eye", "1,1,1"]), ["given"]);
    let (rows, _) = bench(&hall, &["--camera", "default,outside"]);
    let [inside, outside] = [&rows[0], &rows[1]].map(|row| row["hits"].as_u64().unwrap());
    assert!(inside == 48 * 48 && outside < inside, "{inside} {outside}");
}

#[test]
fn a_camera_that_few_rays_of_a_kind_reach_the_model_from_is_said() {
    let far = ["--eye", "300,0,0", "--rays", "primary,ao"];
    let (rows, error) = bench("builtin:teapot", &far);
    let [entering, rays] = ["entering_rays", "rays"].map(|name| rows[0][name].as_u64().unwrap());
    assert!(entering * 10 < rays, "{entering} of {rays}");
    let notes: Vec<&str> = error.lines().filter(|line| line.contains("enter the model's box")).collect();
    assert!(notes[0].contains(&format!("{entering} of 2,304 primary rays (")), "{error}");
    let (_, error) = bench("builtin:teapot", &["--rays", "primary,ao"]);
    assert!(!error.contains("enter the model's box"), "{error}");
}
