//! Writes the man pages and the shell completions of `bvhscope` into the folder named by its one argument. Part of the
//! feature `dist`; `make install` and `make deb` run it.

use std::error::Error;
use std::path::PathBuf;

use clap_complete::Shell;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: bvhscope-dist FOLDER")?);
    let mut command = bvhscope::cli::command();
    std::fs::create_dir_all(&folder)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        clap_complete::generate_to(shell, &mut command, "bvhscope", &folder)?;
    }
    // One page for the program and one for each of its commands, as in bvhscope-render.1.
    clap_mangen::generate_to(command, &folder)?;
    Ok(())
}
