//! The program under Xvfb when something fails: damaged settings, a crash at the start, a lost device, a window closed during
//! a job.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::desktop::{Desktop, LAST_SAMPLE, PROGRAM};
use crate::support::process::{PATIENCE, SharedProgram, Signal, allow_everyone};
use crate::support::{Lack, skip};

#[test]
fn damaged_settings_are_kept_aside_and_the_window_opens() {
    let desktop = Desktop::new();
    let size = |size: &str| {
        format!(
            "{{\"window\":\"(inner_position_pixels:None,outer_position_pixels:None,fullscreen:false,maximized:false,inner_size_points:Some((x:{size},y:{size})))\"}}"
        )
    };
    let zoom = "{\"egui_memory_v2\":\"(options:(zoom_factor:NaN))\",\"unknown\":\"1\"}";
    for (text, window) in [
        ("garbage", "garbage"),
        ("", ""),
        ("{\"wanted\":7", &size("1.0")),
        ("{}", &size("NaN")),
        ("{\"wanted\":{},\"preferences\":{}}", zoom),
    ] {
        desktop.write_settings(text);
        std::fs::write(desktop.window_place(), window).unwrap();
        let mut program = desktop.start(&["builtin:teapot:2"]);
        program.wait_for("could not be read");
        program.wait_for("presented teapot");
        let backup = desktop.settings().with_extension("json.bad");
        assert_eq!(std::fs::read_to_string(backup).unwrap(), text);
        program.signal(Signal::INT);
        assert_eq!(program.wait().code(), Some(130), "an interrupted window says so");
    }
}

#[test]
fn a_start_that_died_makes_the_next_one_safe() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:cornell"]);
    // As soon as the trial period begins: on a slow machine it might be over before anything is shown.
    let starting = desktop.home().join("bvhscope/starting");
    while !starting.exists() {
        assert!(program.is_running());
        std::thread::sleep(Duration::from_millis(2));
    }
    program.signal(Signal::KILL);
    program.wait();
    assert!(starting.exists());
    let mut program = desktop.start(&["builtin:cornell"]);
    program.wait_for("this one is safe");
    program.wait_for("presented teapot");
    program.signal(Signal::INT);
    program.wait();
    let mut program = desktop.start(&["builtin:cornell"]);
    program.wait_for("presented cornell");
}

#[test]
fn a_lost_device_opens_the_window_again_with_what_was_shown() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:cornell", "--threshold", "9", "--lose-device"]);
    // Model, threshold, triangles and nodes; then the time that it took.
    let tree = |line: String| line.split_once("presented ").unwrap().1.rsplit_once(" · ").unwrap().0.to_owned();
    let before = tree(program.wait_for("presented cornell"));
    assert!(before.starts_with("cornell · δ 9 · "), "{before}");
    program.wait_for("the window is opened again");
    assert_eq!(tree(program.wait_for("presented ")), before);
    program.wait_for(&LAST_SAMPLE);
    assert!(program.is_running());
}

#[test]
fn a_driver_error_removes_only_the_overlay() {
    let desktop = Desktop::new();
    std::fs::write(desktop.home().join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut program = desktop.start(&["one.obj", "--refuse-buffer"]);
    program.wait_for("presented one.obj");
    program.wait_for("error: the graphics driver failed");
    // The program goes on: another model is loaded, built and traced.
    std::fs::write(desktop.home().join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n").unwrap();
    assert!(program.wait_for("presented one.obj").contains("2 triangles"));
    program.wait_for(&LAST_SAMPLE);
    assert!(program.is_running());
    program.signal(Signal::INT);
    assert_eq!(program.wait().code(), Some(130));
}

/// The window is closed at several moments of loading, building and tracing. The time until the program ends is counted as its
/// processor time and the time that it sleeps, neither of which grows with the load of the machine.
#[test]
fn a_window_closed_during_a_job_ends_long_before_it() {
    let desktop = Desktop::new();
    let arguments = ["builtin:terrain:1500000", "--no-config"];
    let mut program = desktop.start(&arguments);
    program.wait_for("presented terrain");
    let work = program.spent();
    drop(program);
    for part in [0.2, 0.4, 0.6, 0.8, 0.95] {
        let mut program = desktop.start(&arguments);
        let id = desktop.find_window(&mut program);
        // Moments of the work rather than of time: a run may need a little less of it than the first.
        while program.spent() < work.mul_f64(part) && !program.has_logged("presented terrain") {
            std::thread::sleep(Duration::from_millis(2));
        }
        desktop.xdotool(&["windowfocus", "--sync", &id]);
        let (closed, before) = (Instant::now(), program.spent());
        desktop.xdotool(&["key", "ctrl+q"]);
        let (spent, slept) = program.spent_and_slept_at_its_end();
        let spent = spent - before;
        assert!(program.wait().success());
        let took = closed.elapsed();
        println!("closed after {part} of {work:.1?}: {took:.1?} to the end, {spent:.1?} of work, {slept:.1?} of sleep");
        assert!(slept.as_secs_f64() < 1.0, "closed after {part} of {work:.1?}, it slept {slept:.1?} before it ended");
        let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
        let alone = spent.div_f64(cores.min(2.0));
        assert!(alone.as_secs_f64() < 1.0, "closed after {part} of {work:.1?}, it worked {spent:.1?} to end");
    }
    assert_eq!(std::fs::read_dir(desktop.home()).unwrap().count(), 0, "nothing is left");
}

#[test]
fn a_window_closed_while_it_writes_leaves_whole_files() {
    let desktop = Desktop::new();
    // At once, as soon as the first byte may be written, and once the picture is whole.
    for moment in ["at once", "with a file", "with a picture"] {
        let mut program = desktop.start(&["builtin:teapot:2", "--no-config"]);
        let id = desktop.find_window(&mut program);
        program.wait_for(&LAST_SAMPLE);
        desktop.xdotool(&["windowfocus", "--sync", &id]);
        desktop.xdotool(&["key", "F12"]);
        let names = || std::fs::read_dir(desktop.home()).unwrap().map(|entry| entry.unwrap().file_name());
        let has_come = || match moment {
            "at once" => true,
            "with a file" => names().next().is_some(),
            _ => names().any(|name| name.to_string_lossy().ends_with(".png")),
        };
        let give_up = Instant::now() + PATIENCE;
        while !has_come() {
            assert!(program.is_running() && Instant::now() < give_up, "nothing is written");
            std::thread::sleep(Duration::from_millis(1));
        }
        desktop.xdotool(&["key", "ctrl+q"]);
        let status = program.wait();
        assert!(status.success(), "closed {moment}: {status}");
        for entry in std::fs::read_dir(desktop.home()).unwrap() {
            let path = entry.unwrap().path();
            assert!(image::open(&path).is_ok(), "{} is incomplete", path.display());
            std::fs::remove_file(path).unwrap();
        }
    }
}

#[test]
fn unreadable_and_unwritable_settings_are_ignored() {
    let desktop = Desktop::new();
    let folder = desktop.settings().parent().unwrap().to_owned();
    // First a folder in the place of the file, then a file in the place of its folder.
    std::fs::create_dir_all(desktop.settings()).unwrap();
    for blocked in [true, false] {
        let mut program = desktop.start(&["builtin:teapot:2"]);
        program.wait_for("presented teapot");
        program.signal(Signal::INT);
        assert_eq!(program.wait().code(), Some(130));
        if blocked {
            std::fs::remove_dir_all(&folder).unwrap();
            std::fs::write(&folder, "in the way").unwrap();
        }
    }
    assert_eq!(std::fs::read_to_string(&folder).unwrap(), "in the way");
}

/// Pipes without a writer would be waited for, and devices read for ever.
#[test]
fn what_is_no_file_is_kept_aside_and_the_window_opens() {
    let desktop = Desktop::new();
    let folder = desktop.settings().parent().unwrap().to_owned();
    std::fs::create_dir_all(&folder).unwrap();
    for how in ["mkfifo", "mkdir", "ln -s /dev/zero"] {
        for place in [desktop.settings(), desktop.window_place(), folder.join("starting")] {
            let mut command = how.split(' ');
            let made = Command::new(command.next().unwrap()).args(command).arg(&place).status();
            assert!(made.unwrap().success());
        }
        let mut program = desktop.start(&["builtin:teapot:2"]);
        program.wait_for("could not be read");
        program.wait_for("window.ron is not a file");
        program.wait_for("presented teapot");
        program.signal(Signal::INT);
        assert_eq!(program.wait().code(), Some(130));
        assert!(desktop.settings().is_file(), "{how}: the settings were saved");
        for name in ["settings.json.bad", "window.ron.bad"] {
            assert!(std::fs::metadata(folder.join(name)).is_ok_and(|kept| !kept.is_file()), "{how}: {name}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
        std::fs::create_dir_all(&folder).unwrap();
    }
}

/// The administrator may write despite permissions, but not to a disk that is mounted read-only.
#[test]
fn settings_on_a_read_only_disk_are_ignored() {
    let desktop = Desktop::new();
    let folder = desktop.settings().parent().unwrap().to_owned();
    desktop.write_settings("{\"unknown\":\"1\"}");
    let mount = "mount --bind \"$0\" \"$0\" && mount -o remount,bind,ro \"$0\" && exec \"$@\"";
    let read_only = ["unshare", "--mount", "sh", "-c", mount, folder.to_str().unwrap(), PROGRAM];
    if !desktop.command_as(&read_only[..6], &["true"]).status().is_ok_and(|status| status.success()) {
        return skip(Lack::Mounts, "nothing can be mounted here");
    }
    let mut program = desktop.start_as(&read_only, &["builtin:teapot:2"]);
    program.wait_for("presented teapot");
    program.signal(Signal::INT);
    assert_eq!(program.wait().code(), Some(130));
    assert_eq!(std::fs::read_to_string(desktop.settings()).unwrap(), "{\"unknown\":\"1\"}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing else was written");
}

/// One pixel is the smallest window; an unmapped one is minimised.
#[test]
fn a_window_of_one_pixel_and_one_off_the_screen_come_back() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:teapot:2", "--no-config"]);
    let id = desktop.find_window(&mut program);
    program.wait_for(&LAST_SAMPLE);
    for (k, away) in [&["windowsize", &id, "1", "1"][..], &["windowsize", &id, "9", "700"], &["windowunmap", &id]]
        .into_iter()
        .enumerate()
    {
        desktop.xdotool(away);
        program.wait_until_idle(|_| ());
        desktop.xdotool(&["windowmap", &id]);
        // A different size each time, so that a new picture is traced.
        desktop.xdotool(&["windowsize", &id, &(900 + 10 * k).to_string(), "650"]);
        program.wait_for(&LAST_SAMPLE);
    }
    let lines = program.unread_lines();
    assert!(!lines.iter().any(|line| line.contains("error")), "{lines:?}");
    desktop.xdotool(&["windowfocus", "--sync", &id, "key", "ctrl+q"]);
    assert!(program.wait().success());
}

/// There is no window manager to limit the window to the driver's largest texture. It cannot be drawn then, and not even the
/// picture alone fits into a texture.
#[test]
fn a_window_larger_than_the_driver_draws_comes_back() {
    let desktop = Desktop::with_screen("17400x600x24");
    let mut program = desktop.start(&["builtin:teapot:2", "--no-config"]);
    let id = desktop.find_window(&mut program);
    program.wait_for(&LAST_SAMPLE);
    desktop.xdotool(&["windowsize", &id, "17000", "500"]);
    let what = program.wait_for_either(&["error: the graphics driver failed", &LAST_SAMPLE]);
    assert!(what.is_some(), "the program ended");
    let mut complaints = 1;
    program.wait_until_idle(|program| {
        complaints += program.unread_lines().iter().filter(|line| line.contains("graphics driver failed")).count();
        assert!(complaints <= 10, "reported {complaints} times");
    });
    desktop.xdotool(&["windowsize", &id, "900", "550"]);
    program.wait_for(&LAST_SAMPLE);
    assert!(program.is_running());
    desktop.xdotool(&["windowfocus", "--sync", &id, "key", "ctrl+q"]);
    assert!(program.wait().success());
}

/// Under a limit on threads. Graphics drivers start threads themselves and may fail without them.
#[test]
fn a_window_without_threads_works_or_says_why_not() {
    let desktop = Desktop::new();
    let user = (65_100 + std::process::id() % 400).to_string();
    allow_everyone(desktop.home(), 0o777);
    let shared = SharedProgram::new();
    let path = shared.path();
    let mut worked = 0;
    for most in [3, 6, 9, 12, 16, 24, 400] {
        let limit = format!("ulimit -u {most} && exec \"$@\"");
        let limited = ["setpriv", "--reuid", &user, "--regid", &user, "--clear-groups", "bash", "-c", &limit, "bash"];
        let allowed = |mut command: Command| command.status().is_ok_and(|status| status.success());
        if most == 3 && !allowed(desktop.command_as(&limited, &["true"])) {
            return skip(Lack::Users, "no other user can run programs here");
        }
        let limited = [&limited[..], &[path.to_str().unwrap()]].concat();
        let mut program = desktop.start_as(&limited, &["builtin:cornell", "--no-config"]);
        let lines = program.wait_for_either(&["presented cornell", "error: ", "bvhscope: "]);
        println!("{most} threads: {lines:?}");
        if lines.as_ref().is_some_and(|line| line.contains("presented")) {
            worked += 1;
            program.signal(Signal::INT);
            assert_eq!(program.wait().code(), Some(130), "{most}");
        }
    }
    assert!(worked > 0, "with 400 threads it must work");
}

#[test]
fn two_instances_and_a_newer_version_leave_usable_settings() {
    let desktop = Desktop::new();
    let mut programs = [(); 2].map(|()| {
        let mut program = desktop.start(&["builtin:teapot:2"]);
        program.wait_for("presented teapot");
        program
    });
    // Both write as they end.
    programs.iter().for_each(|program| program.signal(Signal::INT));
    for program in &mut programs {
        assert_eq!(program.wait().code(), Some(130));
    }
    // As a later version with more settings would write them.
    let saved = std::fs::read_to_string(desktop.settings()).unwrap();
    let newer = saved.replacen("\"preferences\":{", "\"preferences\":{\"newer\":[1],", 1);
    assert_ne!(newer, saved, "{saved}");
    desktop.write_settings(&newer);
    let mut program = desktop.start(&["builtin:teapot:2"]);
    program.wait_for("presented teapot");
    program.signal(Signal::INT);
    program.wait();
    assert!(!desktop.settings().with_extension("json.bad").exists(), "nothing was damaged");
}

/// As when the program crashes or the machine loses power.
#[test]
fn changed_settings_survive_a_kill() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:teapot:2"]);
    let id = desktop.find_window(&mut program);
    program.wait_for(&LAST_SAMPLE);
    let is_saved = |what: &str| std::fs::read_to_string(desktop.settings()).is_ok_and(|text| text.contains(what));
    let wait_for = |what: &str| {
        let give_up = Instant::now() + PATIENCE;
        while !is_saved(what) {
            assert!(Instant::now() < give_up, "{what} was never written");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    wait_for("\"show_containers\":true");
    desktop.xdotool(&["windowfocus", "--sync", &id, "key", "b"]);
    wait_for("\"show_containers\":false");
    program.signal(Signal::KILL);
    program.wait();
    let files = std::fs::read_dir(desktop.settings().parent().unwrap()).unwrap();
    let names: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert!(!names.iter().any(|name| name.ends_with(".part")), "{names:?}");
    // A program that ends within its trial period makes the next start a safe one.
    let _ = std::fs::remove_file(desktop.home().join("bvhscope/starting"));
    let mut program = desktop.start(&["builtin:teapot:2"]);
    program.wait_for("presented teapot");
    program.signal(Signal::INT);
    program.wait();
    assert!(is_saved("\"show_containers\":false"));
}

#[test]
fn a_run_without_settings_writes_none() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:teapot:2", "--no-config"]);
    program.wait_for("presented teapot");
    program.signal(Signal::TERM);
    assert_eq!(program.wait().code(), Some(130));
    assert!(!desktop.settings().exists() && !Path::new(&desktop.home().join("bvhscope")).exists());
}

#[test]
fn a_saved_file_is_read_again_once_and_a_deleted_one_leaves_the_scene() {
    let desktop = Desktop::new();
    let model = desktop.home().join("two.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut program = desktop.start(&["two.obj"]);
    assert!(program.wait_for("presented two.obj").contains("1 triangles"));
    // As editors save: into another file, which then replaces the first.
    let fresh = desktop.home().join("fresh.tmp");
    std::fs::write(&fresh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 3 2 4\n").unwrap();
    std::fs::rename(&fresh, &model).unwrap();
    assert!(program.wait_for("presented two.obj").contains("2 triangles"));
    std::fs::remove_file(&model).unwrap();
    program.wait_for("two.obj: Removed");
    // The scene stayed, and the file was read once: the next picture is of what is written now.
    std::fs::write(&fresh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 3 2 4\nf 1 2 4\n").unwrap();
    std::fs::rename(&fresh, &model).unwrap();
    let line = program.wait_for("presented two.obj");
    assert!(line.contains("3 triangles"), "read again without a change: {line}");
}

/// A window that another one covers is not drawn, but what it was doing goes on.
#[test]
fn a_covered_window_reads_a_saved_file_again() {
    let desktop = Desktop::new();
    let model = desktop.home().join("one.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut covered = desktop.start(&["one.obj", "--no-config"]);
    covered.wait_for("presented one.obj");
    let mut above = desktop.start(&["builtin:teapot:2", "--no-config"]);
    above.wait_for(&LAST_SAMPLE);
    let fresh = desktop.home().join("fresh.tmp");
    std::fs::write(&fresh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n").unwrap();
    std::fs::rename(&fresh, &model).unwrap();
    assert!(covered.wait_for("presented one.obj").contains("2 triangles"));
}

#[test]
fn an_idle_window_uses_no_processor_time() {
    let desktop = Desktop::new();
    let mut program = desktop.start(&["builtin:teapot:2"]);
    program.wait_for(&LAST_SAMPLE);
    program.wait_until_idle(|_| ());
    // Processor time, which other work on the machine does not lengthen.
    let before = program.spent();
    let period = Duration::from_secs(8);
    std::thread::sleep(period);
    let fraction = (program.spent() - before).div_duration_f64(period);
    // Watching the file and the driver's own threads take well below 1 %; drawing takes several.
    assert!(fraction < 0.05, "{fraction} of a processor at rest");
}
