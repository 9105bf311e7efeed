//! The program in an X11 window under Xvfb, driven by xdotool: open, drag, wheel, keys, slider, drop a file, close. A line of
//! the log marks the end of each change, and screenshots are compared for its effect.

use std::path::Path;

use crate::desktop::LAST_SAMPLE;
use crate::screen::{VIEWPORT, Window};
use crate::support::process::wait_until;

/// The viewport's upper left corner there.
const CORNER: [u32; 2] = [248, 29];
/// The right half of the threshold's handle at its default, so that pressing it moves it a little.
const HANDLE_AT_6: [i32; 2] = [1137, 187];
/// Around the handle, which looks different while it is held.
const HANDLE: [usize; 4] = [1124, 177, 1145, 198];
/// To the right of the slider, where it gives its largest value, and far below, so that no tip covers the number.
const BEYOND_THE_SLIDER: [i32; 2] = [1253, 700];
/// The number next to the slider.
const THRESHOLD_NUMBER: [usize; 4] = [1217, 178, 1267, 197];
/// The value of the SAH cost in the headline.
const SAH_COST: [usize; 4] = [133, 66, 220, 90];

#[test]
fn orbiting_zooming_toggling_and_saving_change_the_screen() {
    let mut window = Window::open(&["builtin:teapot:6"]);
    let start = window.at_rest();
    assert!(start.colors(VIEWPORT) > 200, "a shaded picture has many colours, this has {}", start.colors(VIEWPORT));

    // A drag orbits, the wheel zooms.
    window.drag("1", [640, 380], [760, 430]);
    let orbited = window.once(|screen| screen.changed(&start, VIEWPORT) > 0.1);
    window.desktop.xdotool(&["mousemove", "600", "330", "click", "4", "click", "4"]);
    let zoomed = window.once(|screen| screen.changed(&orbited, VIEWPORT) > 0.05);

    // B hides the lines and nothing else, and shows them again.
    window.key("b");
    let bare = window.once(|screen| screen.changed(&zoomed, VIEWPORT) > 0.005);
    let fraction = bare.changed(&zoomed, VIEWPORT);
    assert!(fraction < 0.6, "{fraction} of the viewport changed");
    window.key("b");
    let back = window.once(|screen| screen.changed(&zoomed, VIEWPORT) < 0.02);

    // F12 saves the viewport.
    window.key("F12");
    let saved = window.file("teapot-6-001.png");
    let saved = image::load_from_memory(&saved).unwrap().to_rgb8();
    let [x0, y0, x1, y1] = VIEWPORT;
    let pixel = |x: usize, y: usize| saved.get_pixel(x as u32 - CORNER[0], y as u32 - CORNER[1]).0;
    let differs = |x: usize, y: usize| {
        let [_, r, g, b] = back.pixels[y * back.width + x].to_be_bytes();
        pixel(x, y).iter().zip([r, g, b]).any(|(a, b)| a.abs_diff(b) > 24)
    };
    let different = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))).filter(|&(x, y)| differs(x, y)).count();
    assert!(different * 100 < (x1 - x0) * (y1 - y0), "{different} pixels differ");
}

#[test]
fn the_dragged_threshold_changes_tree_lines_and_numbers_while_it_is_held() {
    let mut window = Window::open(&["builtin:teapot:6"]);
    window.at_rest();
    window.move_to(HANDLE_AT_6);
    let before = window.once(|_| true);
    assert_eq!(before.changed(&window.screenshot(), SAH_COST), 0.0, "nothing moves by itself");

    window.desktop.xdotool(&["mousedown", "1"]);
    // On a loaded machine the moves may arrive within the same frame, and a button is pressed where the pointer is at its end.
    window.once(|screen| screen.changed(&before, HANDLE) > 0.0);
    window.glide(HANDLE_AT_6, BEYOND_THE_SLIDER);
    // Trees of thresholds on the way may be shown as well.
    window.program.wait_for("presented teapot 6 · δ 64");
    window.program.wait_for(&LAST_SAMPLE);
    // One digit may be all that changes.
    let held = window.once(|screen| screen.changed(&before, SAH_COST) > 0.001);
    assert!(held.changed(&before, THRESHOLD_NUMBER) > 0.001, "the number next to the slider");
    assert!(held.changed(&before, VIEWPORT) > 0.002, "the containers are those of another tree");
    assert!(held.changed(&before, VIEWPORT) < 0.6, "the model is the same");
    window.desktop.xdotool(&["mouseup", "1"]);
    let released = window.once(|screen| screen.changed(&held, VIEWPORT) < 0.002);
    assert_eq!(released.changed(&held, THRESHOLD_NUMBER), 0.0, "letting go changes nothing");

    window.key("ctrl+q");
    assert!(window.program.wait().success());
    let saved = std::fs::read_to_string(window.desktop.settings()).unwrap();
    let number = saved.split("threshold").nth(1).unwrap().trim_start_matches(['"', '\\', ':']);
    assert!(number.starts_with("64"), "the threshold is saved for the next run: {number}");
}

#[test]
fn a_dropped_file_is_opened() {
    let mut window = Window::open(&["builtin:cornell"]);
    let before = window.at_rest();
    let model = window.desktop.home().join("two triangles.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n").unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/window/drop_file.py");
    // Debian's own Python has the module Xlib that Debian packages; another one in the PATH may not.
    let status = window
        .desktop
        .command("/usr/bin/python3")
        .arg(script)
        .args([window.id.as_str(), model.to_str().unwrap()])
        .status()
        .unwrap();
    assert!(status.success(), "the drop was not accepted");
    let line = window.program.wait_for("presented two triangles.obj");
    assert!(line.contains("2 triangles"), "{line}");
    window.once(|screen| screen.changed(&before, VIEWPORT) > 0.1);
}

/// Asked for by another program, as pasting does.
#[test]
fn what_is_copied_reaches_other_programs() {
    let mut window = Window::open(&["builtin:teapot:2"]);
    window.at_rest();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/window/paste.py");
    let keys = [
        ("ctrl+i", "SAH cost"),
        ("ctrl+l", "bvhscope --state '1 {"),
        ("ctrl+shift+l", "bvhscope render builtin:teapot:2"),
    ];
    for (key, expected) in keys {
        window.key(key);
        // The window takes the clipboard some time after the key.
        wait_until(|| {
            let pasted = window.desktop.run("/usr/bin/python3", &[script.to_str().unwrap()]);
            String::from_utf8(pasted).unwrap().contains(expected)
        });
    }
    window.key("ctrl+q");
    assert!(window.program.wait().success());
}

#[test]
fn an_unusable_file_keeps_the_window_open_and_is_explained() {
    let home = tempfile::tempdir().unwrap();
    let broken = home.path().join("broken.obj");
    std::fs::write(&broken, "v 0 0 zero\nf 1 1 1\n").unwrap();
    let mut window = Window::open(&[broken.to_str().unwrap()]);
    let line = window.program.wait_for("broken.obj");
    assert!(!line.contains("panicked"), "{line}");
    // Fails where the window does not stay open.
    window.program.wait_until_idle(|_| ());
}

#[test]
fn closing_the_window_ends_the_program() {
    let mut window = Window::open(&["builtin:terrain:300000"]);
    window.key("ctrl+q");
    let status = window.program.wait();
    assert!(status.success(), "it ended with {status}");
}
