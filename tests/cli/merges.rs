//! Films of a construction: `merges` writes GIFs and folders of pictures.

use std::path::Path;

use assert_cmd::Command;
use bvhscope::overlay::Offscreen;

use crate::support::{Lack, skip};

/// Exit code and stderr of `bvhscope merges` with `args` in `folder`.
fn merges(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = Command::cargo_bin("bvhscope").unwrap().current_dir(folder).arg("merges").args(args).output().unwrap();
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

/// True if this machine can draw clusters.
fn draws() -> bool {
    Offscreen::new().map_err(|error| skip(Lack::Graphics, error)).is_ok()
}

/// Pixels of all frames, RGBA, and their delays in hundredths of a second.
fn frames(path: &Path) -> (u16, u16, Vec<(Vec<u8>, u16)>) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(std::fs::File::open(path).unwrap()).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        frames.push((frame.buffer.to_vec(), frame.delay));
    }
    (decoder.width(), decoder.height(), frames)
}

#[test]
fn a_film_shows_the_whole_construction() {
    if !draws() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let common = ["builtin:teapot:2", "--size", "96x64", "--frames", "9", "--samples", "1"];
    let (code, error) = merges(folder.path(), &[&common[..], &["-o", "film.gif", "--rate", "10"]].concat());
    assert_eq!(code, 0, "{error}");
    let (width, height, all) = frames(&folder.path().join("film.gif"));
    assert_eq!((width, height, all.len()), (96, 64, 9));
    assert!(all.iter().take(8).all(|(_, delay)| *delay == 10) && all[8].1 > 100, "the end is shown longest");
    for pair in all.windows(2) {
        assert_ne!(pair[0].0, pair[1].0, "clusters are merged from frame to frame");
    }

    let (code, error) = merges(folder.path(), &[&common[..], &["-o", "frames", "--order", "distance"]].concat());
    assert_eq!(code, 0, "{error}");
    for number in 1..=9 {
        let picture = image::open(folder.path().join(format!("frames/frame-{number:04}.png"))).unwrap();
        assert_eq!((picture.width(), picture.height()), (96, 64));
    }
    assert_eq!(std::fs::read_dir(folder.path().join("frames")).unwrap().count(), 9);
}

#[test]
fn it_says_what_it_cannot_show() {
    let folder = tempfile::tempdir().unwrap();
    let (code, error) = merges(folder.path(), &["builtin:teapot:2", "-o", "film.mp4"]);
    assert!(code == 2 && error.contains("film.mp4") && error.contains(".gif"), "{error}");
    std::fs::write(folder.path().join("file"), "mine").unwrap();
    let (code, error) = merges(folder.path(), &["builtin:teapot:2", "-o", "file"]);
    assert!(code == 1 && error.contains("a folder for the pictures is expected"), "{error}");
    assert_eq!(std::fs::read(folder.path().join("file")).unwrap(), b"mine");
    if draws() {
        let small = ["--size", "16x16", "--frames", "2", "--samples", "1"];
        let args = [&["builtin:teapot:2", "-o", "s.gif", "--preset", "swift"][..], &small].concat();
        let (code, error) = merges(folder.path(), &args);
        assert!(code == 0 && error.contains("merges blocks of triangles"), "{error}");
        let args = [&["builtin:teapot:2", "-o", "l.gif", "--builder", "lbvh"][..], &small].concat();
        let (code, error) = merges(folder.path(), &args);
        assert!(code == 0 && !error.contains("in order of their area"), "splits are known: {error}");
        let args = [&["builtin:teapot:2", "-o", "b.gif", "--preset", "best"][..], &small].concat();
        let (code, error) = merges(folder.path(), &args);
        assert!(code == 0 && error.contains("before its passes"), "{error}");
    }
}
