//! The program as a child process with little memory, on files and options that break programs: it ends with exit code 0, 1
//! or 2, names what is wrong, and never panics.

use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::support::process::{SharedProgram, output};
use crate::support::{Lack, skip};

/// Limit of the program's address space in kilobytes: code, stacks of threads and all allocations.
const ADDRESS_SPACE_KB: u32 = 1_500_000;

const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");

/// Runs `command` in a shell after `limits`, which are `ulimit` options.
fn run_limited(limits: &str, command: &[&str], cwd: &Path) -> Output {
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("{limits} exec \"$@\"")).arg("sh").args(command).current_dir(cwd).stdin(Stdio::null());
    output(shell)
}

/// Runs the program after `limits`.
fn run_with(limits: &str, args: &[&str]) -> Output {
    run_limited(limits, &[&[PROGRAM], args].concat(), Path::new("."))
}

/// Exit code and stderr of the program with little memory.
fn run(args: &[&str]) -> (i32, String) {
    finish(args, &run_with(&format!("ulimit -v {ADDRESS_SPACE_KB}; ulimit -c 0;"), args))
}

fn finish(args: &[&str], output: &Output) -> (i32, String) {
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.signal(), None, "{args:?} was ended by a signal: {error}");
    assert!(!error.contains("panicked") && !error.contains("RUST_BACKTRACE"), "{args:?}: {error}");
    (output.status.code().unwrap(), error)
}

/// Loads and builds `path`; the error must contain the file's name and `part`.
fn refused(path: &Path, part: &str) {
    let (code, error) = run(&["info", path.to_str().unwrap()]);
    let name = path.file_name().unwrap().to_str().unwrap();
    assert_eq!(code, 1, "{name}: {error}");
    assert!(error.contains(name) && error.contains(part), "{name}: '{part}' is missing in: {error}");
}

/// Loads and builds `path`, which must succeed. Returns stderr.
fn accepted(path: &Path) -> String {
    let (code, error) = run(&["info", path.to_str().unwrap()]);
    assert_eq!(code, 0, "{}: {error}", path.display());
    error
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }

    /// A sparse file that begins with `start` and has a length of `length` bytes.
    fn sparse(&self, name: &str, start: &[u8], length: u64) -> PathBuf {
        let path = self.write(name, start);
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(length).unwrap();
        path
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn irregular_files_are_refused_without_waiting() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.obj");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    refused(&pipe, "pipe, socket or device");
    refused(Path::new("/dev/zero"), "pipe, socket or device");
    let _socket = std::os::unix::net::UnixListener::bind(folder.path("socket.obj")).unwrap();
    refused(&folder.path("socket.obj"), "pipe, socket or device");
    std::os::unix::fs::symlink(folder.path("loop.obj"), folder.path("loop.obj")).unwrap();
    refused(&folder.path("loop.obj"), "cannot be opened");
    folder.write("model.ply", "");
    refused(&folder.path(""), "is a folder; name a model in it: model.ply");
}

#[test]
fn unreadable_files_are_named() {
    let folder = Folder::new();
    let model = folder.write("secret.obj", TRIANGLE);
    std::fs::set_permissions(&model, std::os::unix::fs::PermissionsExt::from_mode(0o000)).unwrap();
    if std::fs::read(&model).is_err() {
        refused(&model, "may not be read by this user");
        return;
    }
    // The administrator may read everything: become another user.
    let program = SharedProgram::new();
    let path = program.path();
    let other = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", path.to_str().unwrap()];
    let run_as_other = |args: &[&str]| run_limited("", &[&other[..], args].concat(), Path::new("/"));
    std::fs::set_permissions(folder.0.path(), std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    if !run_as_other(&["--version"]).status.success() {
        return skip(Lack::Users, "no other user can run the program here");
    }
    let args = ["info", model.to_str().unwrap()];
    let (code, error) = finish(&args, &run_as_other(&args));
    assert!(code == 1 && error.contains("secret.obj: may not be read by this user"), "{error}");
    // That user may not write here either.
    let picture = folder.path("out.png");
    let args = ["render", "builtin:teapot:2", "-o", picture.to_str().unwrap()];
    let (code, error) = finish(&args, &run_as_other(&args));
    assert!(code == 1 && error.contains("takes no files"), "{error}");
    assert!(!picture.exists());
}

#[test]
fn names_of_every_kind_are_opened() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = Folder::new();
    let long = format!("{}.obj", "n".repeat(250));
    for name in [&b"with space.obj"[..], b"new\nline.obj", b"latin-\xE9.obj", b"-dash.obj", long.as_bytes()] {
        let name = std::ffi::OsStr::from_bytes(name);
        std::fs::write(folder.0.path().join(name), TRIANGLE).unwrap();
        let mut command = Command::new(PROGRAM);
        command.args(["info", "--json", "--"]).arg(name).current_dir(folder.0.path());
        let output = output(command);
        assert!(output.status.success(), "{name:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
    refused(&folder.path(&"n".repeat(300)), "cannot be opened");
}

#[test]
fn false_lengths_and_counts_take_no_memory() {
    let folder = Folder::new();
    for name in ["big.obj", "big.ply", "big.stl", "big.glb"] {
        refused(&folder.sparse(name, b"v 0 0 0\n", 5 << 30), "would need about 5.4 GB of memory");
    }
    let mut stl = vec![b' '; 80];
    stl.extend(u32::MAX.to_le_bytes());
    stl.extend([0; 50]);
    let warning = accepted(&folder.write("count.stl", &stl));
    assert!(warning.contains("4294967294 triangles of 4294967295 declared missing"), "{warning}");
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uint int vertex_indices\nend_header\n";
    let mut ply = format!("{header}{face}").into_bytes();
    ply.extend([0; 36]);
    ply.extend(u32::MAX.to_le_bytes());
    refused(&folder.write("list.ply", &ply), "a list of 4294967295 entries does not fit");
    let mut ply = format!("{header}{}", face.replace("uint int", "char int")).into_bytes();
    ply.extend([0; 36]);
    ply.push(0xFF);
    refused(&folder.write("negative.ply", &ply), "a list of -1 entries");
    refused(
        &folder.write("empty-elements.ply", "ply\nformat ascii 1.0\nelement a 4000000000\nend_header\n"),
        "are declared",
    );
    refused(&folder.write("long-line.obj", vec![b'v'; 64 << 20]), "longer than 1048576 bytes");
    let lines = format!("ply\nformat ascii 1.0\n{}end_header\n", "comment\n".repeat(70_000));
    refused(&folder.write("lines.ply", lines), "the header is longer than 65536 lines");
    let word = format!("{}{}", header.replace("binary_little_endian", "ascii"), face) + &"1".repeat(5_000);
    refused(&folder.write("word.ply", word), "a number is longer than 4096 bytes");
    let glb = b"glTF\x02\0\0\0\xff\xff\xff\xff\xff\xff\xff\x7fJSON{}";
    refused(&folder.write("header.glb", glb), "declares 4294967295 bytes");
    let zeros = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"componentType":5126,"count":300000000,"type":"VEC3"}]}"#;
    refused(&folder.write("zeros.gltf", zeros), "--memory-limit");
    let groups = format!("{TRIANGLE}{}", "g a\no b\nf 1 2 3\n".repeat(100_000));
    let groups = folder.write("groups.obj", groups);
    let args = ["info", groups.to_str().unwrap(), "--json"];
    let output = run_with(&format!("ulimit -v {ADDRESS_SPACE_KB}; ulimit -c 0;"), &args);
    assert_eq!(finish(&args, &output).0, 0);
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(facts["triangles"], 100_001, "of each group its triangle: {facts}");
}

#[test]
fn images_that_unpack_to_gigabytes_are_skipped() {
    let folder = Folder::new();
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(11_000, 11_000).write_to(&mut png, image::ImageFormat::Png).unwrap();
    folder.write("bomb.png", png.get_ref());
    let materials: String = (0..8).map(|k| format!("newmtl m{k}\nmap_Kd bomb.png\n")).collect();
    folder.write("bomb.mtl", materials);
    let warning = accepted(&folder.write("bomb.obj", format!("mtllib bomb.mtl\nusemtl m3\n{TRIANGLE}")));
    assert!(warning.contains("image left out: 'bomb.png'"), "{warning}");
}

/// Each missing image gives a warning of its own, and equal warnings are merged.
#[test]
fn thousands_of_missing_images_are_summarised() {
    let folder = Folder::new();
    let materials: String = (0..20_000).map(|k| format!("newmtl m{k}\nmap_Kd missing{k}.png\n")).collect();
    folder.write("a.mtl", materials);
    let warning = accepted(&folder.write("a.obj", format!("mtllib a.mtl\nusemtl m3\n{TRIANGLE}")));
    assert!(warning.contains("20000 images left out: 'missing0.png' …"), "{warning}");
    assert!(warning.lines().count() < 5, "{} lines", warning.lines().count());
}

#[test]
fn the_memory_limit_is_kept() {
    for (args, part) in [
        (&["info", "builtin:terrain:10000000", "--memory-limit", "100MB"][..], "the triangles would need about"),
        (&["info", "builtin:terrain:1000000", "--memory-limit", "300MB"], "the tree would need about"),
        (
            &["render", "-o", "a.png", "--size", "16384x16384", "--memory-limit", "1GB"],
            "a picture of 16384x16384 pixels",
        ),
    ] {
        let (code, error) = run(args);
        assert!(code == 1 && error.contains(part) && error.contains("--memory-limit"), "{args:?}: {error}");
    }
    // Without the option, the system's own limit applies.
    let (code, error) = run(&["info", "builtin:terrain:4000000"]);
    assert!(code == 1 && error.contains("would need about"), "{error}");
    for value in ["0", "4", "101%", "0%", "lots", "-1GB", "NaN%", "1e30GB"] {
        let (code, error) = run(&["info", &format!("--memory-limit={value}")]);
        assert!(code == 2 && error.contains("--memory-limit"), "{value}: {error}");
    }
    assert_eq!(run(&["info", "builtin:teapot:2", "--memory-limit", "50%"]).0, 0);
}

#[test]
fn memory_for_a_file_is_checked_before_it_is_read() {
    let folder = Folder::new();
    // Files of some megabytes that need a dozen times as much memory, with a limit in between.
    let count = 400_000;
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let obj = folder.write("a.obj", format!("{vertices}{}", "f 1 2 3\n".repeat(2 * count)));
    let header = |vertices: usize, faces: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let points = folder.write("points.ply", header(3 * count, 0) + &"0 0 0\n".repeat(3 * count));
    let faces = folder.write("faces.ply", header(1, 2 * count) + "0 0 0\n" + &"3 0 0 0\n".repeat(2 * count));
    let fan =
        folder.write("fan.ply", header(1, 1).replace("uchar", "int") + "0 0 0\n2000000" + &" 0".repeat(2_000_000));
    let facet = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n";
    let stl = folder.write("a.stl", format!("solid\n{}", facet.repeat(count)));
    let json = folder
        .write("a.gltf", format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(count)));
    let bomb = folder.write("bomb.obj.gz", crate::packed::packed(&vec![b' '; 200 << 20]));
    let text = "A".repeat(64 << 20);
    let uri = folder.write(
        "uri.gltf",
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"byteLength\":9,\"uri\":\"data:;base64,{text}\"}}]}}"
        ),
    );
    for (path, limit, part) in [
        (obj, "60MB", "would need about"),
        (points, "60MB", "the vertices would need"),
        (faces, "60MB", "the faces would need"),
        (fan, "60MB", "the faces would need"),
        (stl, "60MB", "the triangles would need"),
        (bomb, "100MB", "the unpacked file would need"),
        (json, "200MB", "the JSON would need"),
        (uri, "130MB", "the JSON would need"),
    ] {
        let (code, error) = run(&["info", path.to_str().unwrap(), "--memory-limit", limit]);
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(code == 1 && error.contains(name) && error.contains(part), "{name}: {error}");
    }
}

#[test]
fn small_stacks_and_address_spaces_are_enough() {
    let stacks = "ulimit -s 512; export RUST_MIN_STACK=200000;";
    let cases = [(stacks, "builtin:slivers:20000"), (stacks, "builtin:teapot:8")];
    // Address spaces most of which the allocator reserves at once.
    let spaces = ["ulimit -v 250000;", "ulimit -v 400000;"].map(|limits| (limits, "builtin:terrain:60000"));
    for (limits, model) in cases.into_iter().chain(spaces) {
        let args = ["info", model, "--threads", "2"];
        let (code, error) = finish(&args, &run_with(limits, &args));
        assert_eq!(code, 0, "{limits} {model}: {error}");
    }
}

/// The program under a limit on the processes and threads of a user. The limit does not apply to the administrator.
#[test]
fn few_threads_or_none_are_enough() {
    // A user without other processes, which would count too.
    let user = (61_000 + std::process::id() % 4_000).to_string();
    let other = ["setpriv", "--reuid", &user, "--regid", &user, "--clear-groups", "bash", "-c"];
    let program = SharedProgram::new();
    let path = program.path();
    let limited = |most: usize, args: &[&str]| {
        let script = format!("ulimit -u {most} && exec \"$@\"");
        let wrapper = [&script, "bash", path.to_str().unwrap()];
        run_limited("", &[&other[..], &wrapper, args].concat(), Path::new("/"))
    };
    if !limited(64, &["--version"]).status.success() {
        return skip(Lack::Users, "no other user can run the program here");
    }
    let mut alone = 0;
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(8);
    for most in 1..=12 {
        let args = ["info", "builtin:teapot:4", "--threads", "8", "--json"];
        let (code, error) = finish(&args, &limited(most, &args));
        assert_eq!(code, 0, "{most}: {error}");
        // The main thread, the one that waits for Ctrl-C, and the workers.
        if most < threads + 2 {
            let refusal = format!("{threads} threads cannot be started");
            assert!(error.contains(&refusal) && error.contains("working with"), "{most}: {error}");
        }
        alone += usize::from(error.contains("working without"));
        // Measurements use the requested number of threads or fail.
        let args = ["bench", "builtin:teapot:2", "--size", "16x16", "--repeat", "1", "--threads", "8"];
        let (code, error) = finish(&args, &limited(most, &args));
        assert!(code == 0 || code == 1 && error.contains("threads cannot be started"), "{most}: {error}");
    }
    assert!(alone > 0, "the limit was never reached");
}

#[test]
fn targets_that_cannot_be_written_are_found_before_the_work() {
    let folder = Folder::new();
    let kept = folder.write("kept.png", "old");
    let model = folder.write("model.obj", TRIANGLE);
    for (target, part) in [
        (folder.path(""), "is a folder"),
        (PathBuf::from("/dev/full"), "not a regular file"),
        (folder.path("missing/out.png"), "does not exist"),
    ] {
        let (code, error) = run(&["bench", "builtin:terrain:9000000", "--csv", target.to_str().unwrap()]);
        assert!(code == 1 && error.contains(part), "{}: {error}", target.display());
    }
    // Like a full disk: files may not grow beyond a few blocks. The signal that reports it would end the process.
    let target = kept.to_str().unwrap();
    let args = ["render", "builtin:teapot:4", "--size", "400x400", "-o", target];
    let limits = "ulimit -f 8;";
    let (code, error) = finish(&args, &run_with(limits, &args));
    assert!(code == 1 && error.contains("kept.png: cannot be written"), "{error}");
    assert_eq!(std::fs::read(&kept).unwrap(), b"old");
    let (code, error) = run(&["render", model.to_str().unwrap(), "-o", model.to_str().unwrap()]);
    assert!(code == 2 && error.contains("must end in .png, .svg or .exr"), "{error}");
    let mut names: Vec<_> =
        std::fs::read_dir(folder.0.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["kept.png", "model.obj"], "nothing is left behind");
}

/// A separate disk that is nearly full. Only the administrator may mount one.
#[test]
fn a_full_disk_leaves_the_old_file() {
    let folder = Folder::new();
    let disk = folder.path("disk");
    std::fs::create_dir(&disk).unwrap();
    let mount = ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", disk.to_str().unwrap()];
    // In a mount namespace of its own the disk is unmounted when the shell ends.
    let script = "\"$@\" && cd \"$DISK\" && printf old > kept.png && $PROGRAM render builtin:teapot:4 --size 400x400 -o kept.png; \
        echo code $?; cat kept.png; echo; ls -A";
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", script, "sh"]).args(mount).env("DISK", &disk).env("PROGRAM", PROGRAM);
    let output = output(command);
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if error.contains("unshare") || error.contains("mount:") {
        return skip(Lack::Mounts, format_args!("no disk can be mounted here: {}", error.trim()));
    }
    assert_eq!(out, "code 1\nold\nkept.png\n", "{error}");
    assert!(error.contains("kept.png: cannot be written"), "{error}");
}

/// The rows may be the result of hours of measuring.
#[test]
fn measured_rows_survive_failed_output() {
    let folder = Folder::new();
    let csv = folder.path("rows.csv");
    let sweep = "$PROGRAM sweep builtin:teapot:2 --size 16x16 --repeat 1 --csv \"$CSV\"";
    let shell = |script: &str| {
        let script = script.replace("SWEEP", sweep);
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).env("PROGRAM", PROGRAM).env("CSV", &csv);
        output(command)
    };
    for (script, least) in [("SWEEP > /dev/full", 32), ("SWEEP | true", 32), ("SWEEP --json > /dev/full", 2)] {
        shell(script);
        let text = std::fs::read_to_string(&csv).unwrap();
        assert!(text.lines().count() >= least, "{script}: {text}");
        std::fs::remove_file(&csv).unwrap();
    }
    // Files may not grow beyond one block.
    let output = shell("ulimit -f 1; SWEEP | cat");
    let (table, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(error.contains("rows.csv: cannot be written") && !csv.exists(), "{error}");
    assert!(table.lines().count() > 31, "{table}");
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut command = Command::new("sh");
    command.args(["-c", "$PROGRAM sweep builtin:teapot:2 --size 16x16 --repeat 1 --json | head -n 1"]);
    command.env("PROGRAM", PROGRAM);
    let output = output(command);
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 1);
}

#[cfg(feature = "gui")]
#[test]
fn a_missing_display_or_driver_is_explained() {
    let home = Folder::new();
    let without = |args: &[&str], remove: &[&str], set: &[(&str, &str)]| {
        let mut command = Command::new(PROGRAM);
        command.args(args).stdin(Stdio::null()).env("XDG_DATA_HOME", home.path(""));
        remove.iter().for_each(|name| {
            command.env_remove(name);
        });
        set.iter().for_each(|(name, value)| {
            command.env(name, value);
        });
        finish(args, &output(command))
    };
    let displays = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];
    let (code, error) = without(&["builtin:teapot"], &displays, &[]);
    assert!(code == 1 && error.contains("no display") && error.contains("bvhscope render"), "{error}");
    assert!(error.contains("DISPLAY is set)") && !error.contains(".rs:"), "{error}");
    let (code, error) = without(&["builtin:teapot"], &displays[1..], &[("DISPLAY", ":9999")]);
    assert!(code == 1 && error.contains("no display") && error.contains("bvhscope render"), "{error}");
    let folder = Folder::new();
    let picture = folder.path("a.png");
    let drivers = [
        ("VK_DRIVER_FILES", "/dev/null"),
        ("VK_ICD_FILENAMES", "/dev/null"),
        ("LIBGL_DRIVERS_PATH", "/nonexistent"),
        ("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null"),
    ];
    let target = picture.to_str().unwrap();
    let args = ["render", "builtin:teapot:2", "--size", "40x30", "-o", target, "--overlay", "box"];
    let (code, error) = without(&args, &displays, &drivers);
    assert!(
        code == 1 && error.contains("without --overlay, or as an .svg, the picture needs no graphics driver"),
        "{error}"
    );
    assert!(!picture.exists());
    assert_eq!(without(&args[..6], &displays, &drivers).0, 0, "the picture itself needs no driver");
    assert!(picture.exists());
}
