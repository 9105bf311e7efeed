//! `rays`: writes the rays of a population as a file, prints what a file of rays holds, and checks what is found along them.

mod command;
mod export;
mod summary;
mod verify;

use super::context::{Context, Failure, Finished};
use crate::export::{Protected, check_target};

pub use command::{ChosenRays, RaysCommand, Sample};

/// Writes or summarizes the rays.
pub fn run(command: &RaysCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()));
    if let ChosenRays::File(path) | ChosenRays::Checked(path, _) = &command.rays {
        read.add_read([path]);
    }
    read.add_standard_streams();
    if let Some(path) = &command.output {
        check_target(path, &read)?;
    }
    let scene = context.load(&command.source)?;
    if let Some(path) = &command.output {
        // Again, as only now it is known what else was read: buffers, textures, material libraries.
        read.add_read(&scene.files_read);
        check_target(path, &read)?;
    }
    let finished = match &command.rays {
        ChosenRays::Population(population, count) => {
            export::run(command, (*population, *count), (&scene, &read), context)
        }
        ChosenRays::File(path) => summary::run(command, path, (&scene, &read), context),
        ChosenRays::Checked(path, sample) => verify::run(command, (path, *sample), (&scene, &read), context),
    }?;
    Ok(Finished { warned: finished.warned || !scene.warnings.is_empty() })
}
