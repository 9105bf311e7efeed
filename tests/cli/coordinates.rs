//! Points and planes on the command line and in JSON are those of the file, also where the program subtracts an offset.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

/// Exit code, stdout and stderr of a command in a folder.
fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let program = env!("CARGO_BIN_EXE_bvhscope");
    let output = Command::new(program).args(line.split_whitespace()).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json_of(folder: &Path, line: &str) -> Value {
    let (code, out, error) = run(folder, line);
    assert_eq!(code, 0, "{line}: {error}");
    serde_json::from_str(out.lines().next().unwrap()).unwrap()
}

/// A folder with a triangle and a smaller one half a unit below it, at places from the origin to that of a map.
fn folder() -> (tempfile::TempDir, [(&'static str, [f64; 3]); 4]) {
    let folder = tempfile::tempdir().unwrap();
    let places = [
        ("near", [0.0, 0.0, 0.0]),
        ("at20", [20.0, 0.0, 0.0]),
        ("map", [408_201.58, 4_080_928.25, 117.5]),
        ("behind", [-3e7, 0.125, -2e7]),
    ];
    for (name, [x, y, z]) in places {
        let mut text = String::new();
        for (size, below) in [(1.0, 0.0), (0.5, 0.5)] {
            for [u, v] in [[0.0, 0.0], [size, 0.0], [0.0, size]] {
                text += &format!("v {} {} {}\n", x + u, y + v, z - below);
            }
        }
        std::fs::write(folder.path().join(format!("{name}.obj")), text + "f 1 2 3\nf 4 5 6\n").unwrap();
    }
    (folder, places)
}

#[test]
fn rays_begin_where_the_file_has_them() {
    let (folder, places) = folder();
    for (name, [x, y, z]) in places {
        let origin = [x + 0.25, y + 0.25, z + 5.0];
        let [ox, oy, oz] = origin;
        let line = format!("ray {name}.obj --origin {ox},{oy},{oz} --direction 0,0,-1");
        let ray = json_of(folder.path(), &format!("{line} --json"));
        assert_eq!(ray["hit"], json!({"t": 5.0, "triangle": 0}), "{line}");
        assert_eq!(ray["origin"], json!(origin), "{line}");
        let (_, text, _) = run(folder.path(), &line);
        assert!(text.contains(&format!("from {ox},{oy},{oz} towards 0,0,-1\n")), "{text}");
        // The section plane is in the same coordinates: it leaves the lower triangle alone.
        for plane in [format!("z={}", z - 0.25), format!("0,0,2={}", z - 0.25)] {
            let ray = json_of(folder.path(), &format!("{line} --section {plane} --json"));
            assert_eq!(ray["hit"], json!({"t": 5.5, "triangle": 1}), "{line} --section {plane}");
        }
        let ray = json_of(folder.path(), &format!("{line} --section -z=50% --json"));
        assert_eq!(ray["hit"]["triangle"], 0, "{line}");
    }
}

#[test]
fn cameras_stand_where_the_file_has_them_and_rows_say_so() {
    let (folder, places) = folder();
    let mut pictures = Vec::new();
    for (name, [x, y, z]) in places {
        let (eye, target) = ([x + 0.25, y + 0.25, z + 3.0], [x + 0.25, y + 0.25, z]);
        let text = |[x, y, z]: [f64; 3]| format!("{x},{y},{z}");
        let flags = format!("--eye {} --target {} --size 32x32", text(eye), text(target));
        let row = json_of(folder.path(), &format!("render {name}.obj {flags} -o {name}.png --json"));
        assert_eq!((&row["eye"], &row["target"]), (&json!(eye), &json!(target)), "{name}");
        assert!(row["hits"].as_u64().unwrap() > 50, "{name}: {row}");
        pictures.push(std::fs::read(folder.path().join(format!("{name}.png"))).unwrap());
        // The line of a measurement makes its row again.
        let bench = format!("bench {name}.obj --rays primary --repeat 1 --json {flags}");
        let row = json_of(folder.path(), &bench);
        let line = row["command_line"].as_str().unwrap().strip_prefix("bvhscope ").unwrap();
        assert!(line.contains(&format!("--eye '{}' --target '{}'", text(eye), text(target))), "{line}");
        let again = json_of(folder.path(), &format!("{} --json", line.replace('\'', "")));
        for field in ["eye", "target", "container_tests_per_ray", "populations"] {
            assert_eq!(again[field], row[field], "{line}: {field}");
        }
    }
    assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]), "the same picture from everywhere");
}
