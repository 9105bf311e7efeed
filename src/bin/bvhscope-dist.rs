//! Writes the man pages and the shell completions of `bvhscope` into the folder named by its one argument. Part of the
//! feature `dist`; `make install` and `make deb` run it.

use std::error::Error;
use std::path::PathBuf;

use clap_complete::Shell;
use clap_mangen::Man;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: bvhscope-dist FOLDER")?);
    std::fs::create_dir_all(&folder)?;
    let mut command = bvhscope::cli::command();
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        clap_complete::generate_to(shell, &mut command.clone(), "bvhscope", &folder)?;
    }
    // One page for the program and one for each of its commands, as in bvhscope-render.1.
    command = command.disable_help_subcommand(true);
    command.build();
    for page in std::iter::once(&command).chain(command.get_subcommands()) {
        let source = format!("bvhscope {}", env!("CARGO_PKG_VERSION"));
        Man::new(page.clone()).source(source).manual("User Commands").generate_to(&folder)?;
    }
    Ok(())
}
