//! The program: see [`bvhscope::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    bvhscope::cli::main()
}
