//! The program: see [`bvhscope::cli`].

use std::process::ExitCode;

use mimalloc::MiMalloc;

// Trees in large pages are built and traced faster, and the next tree gets the memory of the one before.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    bvhscope::cli::main()
}
