//! Standard streams that are full, closed, slow or without a reader, in every combination: exit codes hold, and what can be
//! written is written.

use std::fs::File;
use std::io::{PipeReader, PipeWriter, Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::fs::OFlags;

use crate::support::process::{Running, Signal, wait_until};

const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");

/// State of a standard stream of the program.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Usable,
    Full,
    Closed,
    /// A pipe that nobody will ever read.
    Unread,
}

const STATES: [State; 4] = [State::Usable, State::Full, State::Closed, State::Unread];

/// A folder with a model that is loaded with one warning.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n").unwrap();
    folder
}

/// The program with these states of stdout and stderr, and stdin closed where stdout is.
fn command(args: &[&str], [out, error]: [State; 2], folder: &Path) -> Command {
    let stream = |state| match state {
        State::Usable | State::Closed => Stdio::null(),
        State::Full => File::options().write(true).open("/dev/full").unwrap().into(),
        State::Unread => std::io::pipe().unwrap().1.into(),
    };
    let closed = |state, how: &'static str| if state == State::Closed { how } else { "" };
    let script = format!("exec \"$@\" {} {}", closed(out, "<&- >&-"), closed(error, "2>&-"));
    let mut command = Command::new("sh");
    command.args(["-c", &script, "sh", PROGRAM]).args(args).current_dir(folder);
    command.stdin(Stdio::null()).stdout(stream(out)).stderr(stream(error));
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    // Complained about on stderr, too.
    command.env("RUST_LOG", "a=b=c/d/e").env("XDG_DATA_HOME", folder);
    command
}

#[test]
fn exit_codes_and_files_do_not_depend_on_the_streams() {
    let folder = folder();
    // Arguments, the exit code, whether something is printed on stdout, the file that is written.
    let cases: [(&[&str], i32, bool, Option<&str>); 10] = [
        (&["render", "a.obj", "--size", "8x8", "-o", "a.png"], 0, false, Some("a.png")),
        (&["render", "a.obj", "--size", "8x8", "-o", "a.png", "--json", "--strict"], 3, true, Some("a.png")),
        (&["info", "a.obj"], 0, true, None),
        (&["info", "a.obj", "--strict", "--json"], 3, true, None),
        (&["bench", "a.obj", "--size", "8x8", "--repeat", "1", "--csv", "a.csv"], 0, true, Some("a.csv")),
        (&["bench", "a.obj", "--size", "8x8", "--repeat", "1", "--json", "--csv", "a.csv"], 0, true, Some("a.csv")),
        (&["info", "missing.obj"], 1, false, None),
        (&["info", "--threshold", "1"], 2, false, None),
        (&["--help"], 0, true, None),
        // Without a display.
        (&["a.obj"], 1, false, None),
    ];
    for (args, code, prints, file) in cases {
        for streams in STATES.into_iter().flat_map(|out| STATES.map(|error| [out, error])) {
            let status = command(args, streams, folder.path()).status().unwrap();
            let expected = if prints && streams[0] == State::Full { 1 } else { code };
            assert_eq!(status.code(), Some(expected), "{args:?} with {streams:?}");
            if let Some(file) = file {
                let bytes = std::fs::read(folder.path().join(file));
                let complete =
                    bytes.is_ok_and(|bytes| bytes.ends_with(if file == "a.png" { b"IEND\xaeB`\x82" } else { b"\n" }));
                assert!(complete, "{args:?} with {streams:?}");
                std::fs::remove_file(folder.path().join(file)).unwrap();
            }
        }
    }
}

/// A pipe that takes nothing more until its reader does. `waits`: whether a write to it waits until then.
fn full_pipe(waits: bool) -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = std::io::pipe().unwrap();
    rustix::fs::fcntl_setfl(&writer, OFlags::NONBLOCK).unwrap();
    for size in [4096, 1] {
        while writer.write(&vec![b'.'; size]).is_ok() {}
    }
    if waits {
        rustix::fs::fcntl_setfl(&writer, OFlags::empty()).unwrap();
    }
    (reader, writer)
}

#[test]
fn a_slow_reader_keeps_no_work_waiting_and_gets_everything() {
    let folder = folder();
    let render: &[&str] = &["render", "a.obj", "--size", "8x8", "-o", "out"];
    let bench: &[&str] = &["bench", "a.obj", "--size", "8x8", "--repeat", "1", "--json", "--csv", "out"];
    for (args, on_error, waits) in [(render, true, true), (render, true, false), (bench, false, true)] {
        let target = folder.path().join("out.png");
        let args: Vec<&str> = args.iter().map(|arg| if *arg == "out" { "out.png" } else { arg }).collect();
        let mut command = Command::new(PROGRAM);
        command.args(&args).current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null());
        let (mut reader, writer) = full_pipe(waits);
        if on_error {
            command.stderr(writer)
        } else {
            command.stdout(writer)
        };
        let mut child = Running::start(&mut command);
        // The pipe must end with the program.
        drop(command);
        wait_until(|| target.exists());
        std::fs::remove_file(&target).unwrap();
        assert!(child.is_running(), "{args:?}: nothing was lost without a word");
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        assert_eq!(child.wait_for_end().code(), Some(0), "{args:?}");
        let lines = text.trim_start_matches('.').lines().count();
        assert!(if on_error { text.contains("a.obj: 1 face") } else { lines == 2 }, "{}", text.trim_matches('.'));
    }
}

/// As a window does, which may log nothing more for hours.
#[test]
fn a_note_reaches_a_slow_reader_although_no_other_follows() {
    // It is killed at the end, perhaps while it looks at its folder.
    let folder = folder();
    let (mut reader, full) = full_pipe(true);
    let (empty, _writer) = std::io::pipe().unwrap();
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder.path()).args(["plot", "-", "-o", "out.svg"]).env("RUST_LOG", "a=b=c/d/e");
    command.stdin(empty).stdout(Stdio::null()).stderr(full);
    let mut child = Running::start(&mut command);
    drop(command);
    child.wait_for_handler(Signal::INT);
    let mut text = Vec::new();
    while !text.ends_with(b"\n") {
        let mut portion = [0; 4096];
        let count = reader.read(&mut portion).unwrap();
        assert!(count > 0, "the program ended: {}", String::from_utf8_lossy(&text));
        text.extend_from_slice(&portion[..count]);
    }
    assert!(String::from_utf8_lossy(&text).contains("RUST_LOG is not used"));
    assert!(child.is_running(), "it still waits for its input");
}

#[test]
fn an_interrupt_ends_waiting_for_a_reader_or_a_writer() {
    let folder = folder();
    let (_reader, full) = full_pipe(true);
    let (empty, _writer) = std::io::pipe().unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    let cases: [(&[&str], Stdio, Stdio, i32); 3] = [
        // The work is done, and only its note has not been read.
        (&["render", "a.obj", "--size", "8x8", "-o", "out.png"], Stdio::null(), full.into(), 0),
        (&["plot", "-", "-o", "out.svg"], empty.into(), Stdio::null(), 130),
        (&["plot", "pipe", "-o", "out.svg"], Stdio::null(), Stdio::null(), 130),
    ];
    for (args, input, error, code) in cases {
        let mut command = Command::new(PROGRAM);
        command.args(args).current_dir(folder.path()).stdin(input).stdout(Stdio::null()).stderr(error);
        let mut child = Running::start(&mut command);
        drop(command);
        child.wait_for_handler(Signal::INT);
        if code == 0 {
            wait_until(|| folder.path().join("out.png").exists());
        }
        child.signal(Signal::INT);
        assert_eq!(child.wait_for_end().code(), Some(code), "{args:?}");
        assert!(!folder.path().join("out.svg").exists());
    }
}

/// Nothing but line breaks and tabs may reach a terminal of what cannot be seen.
#[test]
fn names_cannot_drive_the_terminal() {
    let folder = folder();
    let evil = "x\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}\r";
    let model = format!("{evil}.obj");
    std::fs::copy(folder.path().join("a.obj"), folder.path().join(&model)).unwrap();
    let (missing, builtin, sized) =
        (format!("{evil}.stl"), format!("builtin:{evil}"), format!("builtin:teapot:{evil}"));
    let (flag, picture) = (format!("--{evil}"), format!("{evil}.png"));
    let nowhere = format!("{evil}/out.png");
    let cases: [(&[&str], i32); 14] = [
        (&["info", &model], 0),
        (&["info", &model, "--json"], 0),
        (&["bench", &model, "--size", "8x8", "--repeat", "1"], 0),
        (&["render", &model, "--size", "8x8", "-o", &picture, "--json"], 0),
        (&["info", &missing], 1),
        (&["info", &builtin], 2),
        (&["info", &sized], 2),
        (&["info", &flag], 2),
        (&["info", "--threshold", evil], 2),
        (&["render", "-o", evil], 2),
        (&["render", "-o", &nowhere], 1),
        (&["render", &model, "-o", &picture, "--memory-limit", evil], 2),
        (&["plot", &model, "-o", "a.svg"], 1),
        (&["plot", &missing, "-o", "a.svg"], 1),
    ];
    for (args, code) in cases {
        let output = Command::new(PROGRAM).args(args).current_dir(folder.path()).output().unwrap();
        for text in [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()) {
            let wild = text.find(|c: char| c.is_control() && c != '\n' || c == '\u{202e}');
            assert_eq!(wild, None, "{args:?}: {text:?}");
        }
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Mesa's layer for the choice among graphics cards asks for a Wayland display, whose library complains without the variable.
#[test]
#[cfg(feature = "gui")]
fn a_command_has_the_last_word_where_the_session_has_no_runtime_folder() {
    let folder = folder();
    let mut command = Command::new(PROGRAM);
    command.args(["render", "a.obj", "--overlay", "box", "--size", "48x32", "-o", "a.png"]).current_dir(folder.path());
    let output = command.env_remove("XDG_RUNTIME_DIR").env_remove("NODEVICE_SELECT").output().unwrap();
    if let Err(error) = bvhscope::overlay::Offscreen::new() {
        crate::support::skip(crate::support::Lack::Graphics, error);
        return;
    }
    let written = String::from_utf8(output.stderr).unwrap();
    assert!(!written.contains("XDG_RUNTIME_DIR") && written.contains("wrote a.png"), "{written}");
}
