//! Nothing that a command reads is written over, and no two of its outputs are one file.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");

/// A model with material library and texture, a glTF with a buffer, an STL under another name, rows, and other names for them.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("sub")).unwrap();
    let texture = image::RgbImage::from_pixel(2, 2, image::Rgb([1, 2, 3]));
    texture.save(at("texture.png")).unwrap();
    std::fs::write(at("materials.mtl"), "newmtl m\nmap_Kd texture.png\n").unwrap();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
    std::fs::write(at("model.obj"), format!("mtllib materials.mtl\n{corners}usemtl m\nf 1/1 2/2 3/3\n")).unwrap();
    let floats: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|f| f.to_le_bytes()).collect();
    std::fs::write(at("buffer.svg"), floats).unwrap();
    std::fs::write(
        at("model.gltf"),
        r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36,"uri":"buffer.svg"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]}"#,
    )
    .unwrap();
    let mut stl = vec![b' '; 80];
    stl.extend(1_u32.to_le_bytes());
    stl.extend([0_f32; 3].iter().chain(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).flat_map(|f| f.to_le_bytes()));
    stl.extend([0; 2]);
    std::fs::write(at("stl.csv"), stl).unwrap();
    std::fs::hard_link(at("texture.png"), at("hard.png")).unwrap();
    symlink("texture.png", at("soft.png")).unwrap();
    symlink("..", at("sub/up")).unwrap();
    symlink(at("model.obj"), at("model.png")).unwrap();
    folder
}

/// Every file of the folder, by name, with its contents.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(&path).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let folder = folder();
    let measured = ["bench", "model.obj", "--size", "8x8", "--repeat", "1"];
    let rows = Command::new(PROGRAM).args(measured).arg("--json").current_dir(folder.path()).output().unwrap().stdout;
    std::fs::write(folder.path().join("rows.svg"), rows).unwrap();
    let before = contents(folder.path());
    let render = ["render", "model.obj", "--size", "8x8", "-o"];
    let gltf = ["bench", "model.gltf", "--size", "8x8", "--repeat", "1"];
    let stl = ["bench", "stl.csv", "--size", "8x8", "--repeat", "1"];
    let two = ["sweep", "builtin:teapot:1", "model.obj", "--size", "8x8", "--repeat", "1", "--threshold", "2"];
    let cases: [(&[&str], &[&str]); 18] = [
        (&render, &["texture.png"]),
        (&render, &["hard.png"]),
        (&render, &["soft.png"]),
        (&render, &["sub/up/texture.png"]),
        (&render, &["./sub/../texture.png"]),
        (&render, &["model.png"]),
        (&render, &["out.png", "--depth-image", "sub/up/../nothing/../texture.exr"]),
        (&measured, &["--csv", "materials.mtl"]),
        (&measured, &["--csv", "model.obj"]),
        (&measured, &["--plot", "texture.png"]),
        (&measured, &["--csv", "out.svg", "--plot", "sub/../out.svg"]),
        (&gltf, &["--plot", "buffer.svg"]),
        (&stl, &["--csv", "stl.csv"]),
        (&two, &["--csv", "materials.mtl"]),
        (&["scaling", "model.obj", "--size", "8x8", "--repeat", "1"], &["--csv", "texture.png"]),
        (&["compare", "model.obj", "--size", "8x8", "--repeat", "1"], &["--csv", "texture.png"]),
        (&["diff", "model.obj", "--size", "8x8", "--repeat", "1", "--b", "preset=hq"], &["-o", "texture.png"]),
        (&["plot", "rows.svg", "-o"], &["./rows.svg"]),
    ];
    for (command, target) in cases {
        let output = Command::new(PROGRAM).args(command).args(target).current_dir(folder.path()).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command:?} {target:?}: {error}");
        let names = target.iter().find(|name| name.contains('.')).unwrap();
        // The one that is no fault of this kind: its folder does not exist.
        if !names.starts_with("out.png") {
            assert!(error.contains("name another file to write"), "{command:?} {target:?}: {error}");
        }
        assert!(contents(folder.path()) == before, "{command:?} {target:?}: {error}");
    }
}

/// Redirections name files too.
#[test]
fn the_files_behind_the_standard_streams_are_not_written_over() {
    let folder = folder();
    let shell = |script: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", script]).env("PROGRAM", PROGRAM).current_dir(folder.path());
        command.status().unwrap().code()
    };
    let bench = "$PROGRAM bench model.obj --size 8x8 --repeat 1 --json";
    assert_eq!(shell(&format!("{bench} > rows.svg")), Some(0));
    let rows = std::fs::read(folder.path().join("rows.svg")).unwrap();
    assert_eq!(shell("$PROGRAM plot - -o rows.svg < rows.svg 2> error"), Some(1));
    assert!(std::fs::read(folder.path().join("rows.svg")).unwrap() == rows);
    let error = std::fs::read_to_string(folder.path().join("error")).unwrap();
    assert!(error.contains("the same file as standard input"), "{error}");
    assert_eq!(shell(&format!("{bench} --csv rows.csv > rows.csv")), Some(1));
}
