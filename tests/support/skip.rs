//! Tests that cannot run on a machine are reported, and fail in continuous integration.

use std::env;
use std::fmt::Display;
use std::fs::OpenOptions;
use std::io::Write as _;

/// Something that a test needs and a machine may lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(dead_code, reason = "each test program uses its part")]
pub enum Lack {
    /// The real models, which are not in the repository.
    Models,
    /// The right to become another user.
    Users,
    /// The right to mount a disk.
    Mounts,
    /// A graphics driver, which `make test` installs.
    Graphics,
    /// The system's own record of a process's peak of memory.
    Memory,
    /// Compilers, languages and libraries that other people's builders need.
    Tools,
}

impl Lack {
    /// The name in `BVHSCOPE_MAY_SKIP`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Models => "models",
            Self::Users => "users",
            Self::Mounts => "mounts",
            Self::Graphics => "graphics",
            Self::Memory => "memory",
            Self::Tools => "tools",
        }
    }
}

/// Reports that the current test cannot run here, with the reason: on stderr, where it is shown for tests that pass too, unlike what
/// `println!` and `eprintln!` write, and as a line at the end of the file that `BVHSCOPE_SKIPPED` names, which `make test` prints last.
///
/// In continuous integration (`CI` is set) the test fails instead, unless `BVHSCOPE_MAY_SKIP` lists what is missing.
pub fn skip(lack: Lack, reason: impl Display) {
    let thread = std::thread::current();
    // The test's name is the thread's.
    let line = format!("skipped for want of {}: {}: {reason}\n", lack.name(), thread.name().unwrap_or("test"));
    let variable = |name| env::var(name).ok();
    assert!(
        is_allowed(lack, variable("CI").as_deref(), variable("BVHSCOPE_MAY_SKIP").as_deref()),
        "{line}In continuous integration only what BVHSCOPE_MAY_SKIP lists may be skipped."
    );
    // Nothing is lost where stderr is closed.
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(list) = env::var_os("BVHSCOPE_SKIPPED") {
        // In one piece, because several tests may append at once.
        let file = OpenOptions::new().create(true).append(true).open(&list);
        let written = file.and_then(|mut file| file.write_all(line.as_bytes()));
        written.unwrap_or_else(|error| panic!("{}: {error}", list.display()));
    }
}

/// True if a test may be skipped, by the values of `CI` and `BVHSCOPE_MAY_SKIP`, names separated by spaces.
pub fn is_allowed(lack: Lack, ci: Option<&str>, may_skip: Option<&str>) -> bool {
    let is_ci = ci.is_some_and(|value| !matches!(value, "" | "0" | "false"));
    !is_ci || may_skip.is_some_and(|names| names.split_whitespace().any(|name| name == lack.name()))
}
