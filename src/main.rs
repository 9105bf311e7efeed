//! The `bvhscope` program; see [`bvhscope::cli`] for what it does.

use std::process::ExitCode;

use mimalloc::MiMalloc;

// mimalloc: trees in large pages build and trace faster, and a rebuild reuses the memory of the previous tree.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Without the folder of its sockets no Wayland display can be reached. Mesa's layer for the choice among graphics cards tries to,
/// whenever Vulkan is opened, and libwayland-client then writes "error: XDG_RUNTIME_DIR is invalid" behind what a command writes.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "the environment is the only switch that this layer has")]
fn keep_wayland_quiet() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none_or(|folder| folder.is_empty()) {
        // SAFETY: this is the first thing that the program does, so no other thread reads the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    keep_wayland_quiet();
    bvhscope::provenance::set_commit(option_env!("BVHSCOPE_COMMIT"));
    bvhscope::cli::main()
}
