//! `tree`: writes the tree of a model as a tree file, its nodes as a table, or their boxes as a model.

use std::io::Write;
use std::path::PathBuf;

use super::context::{Context, Failure, Finished, in_pool};
use super::moments::{MomentChoice, check_follow};
use super::picture::check_written;
use super::progress::Progress;
use super::tree_obj;
use super::tree_origin::{TreeOrigin, note_faults};
use crate::accel::followed::FollowSession;
use crate::accel::written::FileTrees;
use crate::accel::{Accel, Follow};
use crate::export::{Protected, cannot_be_written, check_target, write_file, wrong_ending};
use crate::scene::SceneSource;
use crate::text::shown_path;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree_file::{write_level_nodes_csv, write_level_nodes_json, write_nodes_csv, write_nodes_json};

/// Settings of `tree`.
#[derive(Debug, Clone)]
pub struct TreeCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// Write the wide tree that pictures are traced through.
    pub wide: bool,
    /// Write the triangles too, so that the file is a model of its own.
    pub with_triangles: bool,
    /// The moment of a model that moves.
    pub moments: MomentChoice,
    /// How the tree of the moment is made.
    pub follow: Follow,
    /// File to write: a tree file `.bvh`, the nodes as `.csv` or `.json`, or their boxes as `.obj`.
    pub output: PathBuf,
}

/// Form of the output.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Tree,
    Csv,
    Json,
    Obj,
}

impl TreeCommand {
    /// The form that the extension of the output names.
    fn form(&self) -> Result<Form, Failure> {
        let extension = self.output.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let form = match extension.as_deref() {
            Some("bvh") => Form::Tree,
            Some("csv") => Form::Csv,
            Some("json") => Form::Json,
            Some("obj") => Form::Obj,
            _ => {
                let text =
                    "the file must end in .bvh, in .csv or .json for a table of the nodes, or in .obj for their boxes";
                return Err(Failure::Usage(wrong_ending(&self.output, text)));
            }
        };
        if self.with_triangles && form != Form::Tree {
            return Err(Failure::Usage(format!(
                "--with-triangles: {} has nodes alone; write a .bvh, or leave --with-triangles out",
                shown_path(&self.output)
            )));
        }
        Ok(form)
    }
}

/// Builds or reads the tree and writes it.
pub fn run(command: &TreeCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    let form = command.form()?;
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    check_follow(command.follow, &command.build, &command.moments)?;
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()));
    read.add_standard_streams();
    check_target(&command.output, &read)?;
    let scene = command.moments.first(context.load(&command.source)?, &context.token)?;
    // Again, as only now it is known what else was read: buffers, textures, material libraries.
    read.add_read(&scene.files_read);
    check_target(&command.output, &read)?;
    let token = &context.token;
    let progress = Progress::new("Building", token);
    let accel = in_pool(|| {
        let follow = (command.follow, &mut FollowSession::default());
        command.tree.accel(&scene, &command.source, &command.build, follow, token)
    })?;
    let trees = in_pool(|| accel.file_trees(command.wide, token))?;
    if let Some(refusal) = (form == Form::Obj).then(|| tree_obj::refusal(&accel, &trees)).flatten() {
        return Err(refusal);
    }
    progress.set_label("Writing");
    let written = write_file(&command.output, &read, |writer| {
        write(command, form, &accel, &trees, writer, token).map_err(|error| cannot_be_written(&error))
    });
    check_written(written, token)?;
    drop(progress);
    let has_faults = note_faults(&accel);
    Ok(Finished { warned: has_faults || !scene.warnings.is_empty() })
}

fn write(
    command: &TreeCommand,
    form: Form,
    accel: &Accel,
    trees: &FileTrees<'_>,
    writer: &mut dyn Write,
    token: &CancelToken,
) -> std::io::Result<()> {
    match (form, trees.levels()) {
        (Form::Tree, _) => trees.write(command.with_triangles, writer, token),
        (Form::Obj, _) => tree_obj::write_boxes(accel, trees, writer, token),
        (Form::Csv, None) => write_nodes_csv(trees.top(), writer, token),
        (Form::Csv, Some(levels)) => write_level_nodes_csv(&levels, writer, token),
        (Form::Json, None) => write_nodes_json(trees.top(), &trees.header(), writer, token),
        (Form::Json, Some(levels)) => write_level_nodes_json(&levels, &trees.header(), writer, token),
    }
}
