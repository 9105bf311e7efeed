//! The `bvhscope` program; see [`bvhscope::cli`] for what it does.

use std::process::ExitCode;

use mimalloc::MiMalloc;

// mimalloc: trees in large pages build and trace faster, and a rebuild reuses the memory of the previous tree.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    bvhscope::provenance::set_commit(option_env!("BVHSCOPE_COMMIT"));
    bvhscope::cli::main()
}
