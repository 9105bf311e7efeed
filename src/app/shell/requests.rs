//! Performs the effects that plain values cannot express: opening and reloading models, measuring, saving files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use crate::accel::Accel;
use crate::app::shell::files::FolderListing;
use crate::app::shell::measure_worker::MeasureWorker;
use crate::app::shell::reconcile::Reconciler;
use crate::app::state::paper::{PaperResult, RowFormat};
use crate::app::state::{AppState, Request, SecondTree, Severity, TreeSide, Wanted, preferences};
use crate::app::viewport::screenshot::{self, Screenshot};
use crate::budget::Budget;
use crate::export::{cannot_be_written, first_writable, write_new, write_new_with};
use crate::lab::plot::{PlotFormat, draw};
use crate::ray_file::{self, is_ray_file};
use crate::scene::{FileFormat, FileRow, SceneSource, model_extensions};
use crate::text::file_name;
use bvhscope_engine::cancel::CancelToken;

/// A dialog that ends sooner without a file was never on the screen: nobody closes one this fast.
const MIN_DIALOG_TIME: Duration = Duration::from_millis(700);

/// Purpose of a chosen file.
#[derive(Debug, Clone, Copy)]
enum Chosen {
    Model,
    /// One of a row of numbered files, all of which are frames.
    Sequence,
    Tree(TreeSide),
}

/// How the file dialog ended.
struct Answer {
    /// Its purpose.
    of: Chosen,
    /// The chosen file.
    path: Option<PathBuf>,
    /// Time since the dialog was requested.
    after: Duration,
}

/// The file dialog and files being saved, each on a thread of its own.
pub(crate) struct BackgroundTasks {
    chosen: (Sender<Answer>, Receiver<Answer>),
    dialog_open: bool,
    folders: FolderListing,
    saved: (Sender<screenshot::Outcome>, Receiver<screenshot::Outcome>),
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl BackgroundTasks {
    /// No tasks yet; `wake` is called from their threads when they end.
    pub(crate) fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { chosen: channel(), dialog_open: false, folders: FolderListing::new(), saved: channel(), wake }
    }

    /// Takes the results of tasks that have ended.
    pub(crate) fn poll(&mut self, reconciler: &mut Reconciler, state: &mut AppState) {
        while let Ok(answer) = self.chosen.1.try_recv() {
            self.dialog_open = false;
            match (answer.path, answer.of) {
                (Some(path), Chosen::Model) => open(SceneSource::File(path), false, reconciler, state),
                (Some(path), Chosen::Sequence) => {
                    if let Some(row) = FileRow::pattern_of(&path) {
                        open(SceneSource::File(row), false, reconciler, state);
                    } else {
                        let text = format!(
                            "{} has no number in its name: choose a file of a row, such as walk_0001.obj",
                            file_name(&path)
                        );
                        state.messages.notify(Severity::Warning, text);
                    }
                }
                (Some(path), Chosen::Tree(side)) => open_tree(side, path, state),
                (None, of) if answer.after < MIN_DIALOG_TIME => ask_for_path(of, state),
                (None, _) => {}
            }
        }
        self.folders.poll(state);
        while let Ok(outcome) = self.saved.1.try_recv() {
            match outcome {
                Ok((path, None)) => state.messages.notify(Severity::Info, format!("Saved {}", path.display())),
                Ok((path, Some(complaint))) => {
                    state.messages.notify(Severity::Warning, format!("Saved {}, but {complaint}", path.display()));
                }
                Err(error) => state.messages.notify(Severity::Error, error),
            }
        }
    }

    /// Performs the requests of this UI frame.
    pub(crate) fn perform(
        &mut self,
        ctx: &egui::Context,
        reconciler: &mut Reconciler,
        measure_worker: &mut MeasureWorker,
        state: &mut AppState,
    ) {
        perform_actions(state);
        for request in std::mem::take(&mut state.activity.requests) {
            match request {
                Request::Open(source) => open(source, false, reconciler, state),
                Request::OpenShared { source, copies, tree_files, camera } => {
                    if let Some(camera) = camera {
                        reconciler.set_next_view(camera);
                    }
                    let Wanted { moment, follow, second, .. } = state.wanted;
                    let unfolded = state.wanted.unfolded.clone();
                    let ray_file = state.wanted.ray_file.clone();
                    open(source, false, reconciler, state);
                    reconciler.set_next_form(copies);
                    (state.wanted.tree_files, state.wanted.ray_file) = (tree_files, ray_file);
                    (state.wanted.moment, state.wanted.follow, state.wanted.second) = (moment, follow, second);
                    state.wanted.unfolded = unfolded;
                }
                Request::OpenTree(side, path) => open_tree(side, path, state),
                Request::OpenTreeDialog(side) => self.open_dialog(Chosen::Tree(side), state),
                Request::SaveTree => save_tree(self.saved.0.clone(), Arc::clone(&self.wake), state),
                Request::OpenDialog => self.open_dialog(Chosen::Model, state),
                Request::OpenSequenceDialog => self.open_dialog(Chosen::Sequence, state),
                Request::ListFolder(folder) => self.folders.request(folder, Arc::clone(&self.wake)),
                Request::Reload => reconciler.reload(),
                Request::CancelJobs => reconciler.cancel(state),
                Request::Measure => measure_worker.measure(state),
                Request::CancelMeasuring => measure_worker.cancel(state),
                Request::SaveRows(format) => self.save_rows(format, state),
                Request::SavePlots(stem, figure) => self.save(state, "plot", move |folder| {
                    let bytes =
                        draw(&figure, PlotFormat::Png, &CancelToken::new()).map_err(|error| error.to_string())?;
                    write_new(folder, &stem, "png", &bytes).map_err(|error| error.to_string())
                }),
                Request::Screenshot => self.save_screenshot(ctx, state),
                Request::Perform(_) => {}
                Request::Copy(text) => ctx.copy_text(text),
                Request::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            }
        }
    }

    fn open_dialog(&mut self, of: Chosen, state: &mut AppState) {
        if self.dialog_open {
            return;
        }
        let dialog = rfd::AsyncFileDialog::new();
        let (dialog, recent) = match of {
            Chosen::Model | Chosen::Sequence => {
                let title = if matches!(of, Chosen::Model) { "Open a model" } else { "Open one of the numbered files" };
                let dialog = dialog.set_title(title).add_filter("Models", &model_extensions());
                let dialog = dialog.add_filter("Rays", &ray_file::EXTENSIONS);
                (dialog, &state.preferences.recent)
            }
            Chosen::Tree(_) => {
                let dialog = dialog.set_title("Open a tree of this model").add_filter("Trees", &["bvh"]);
                (dialog, &state.preferences.recent_trees)
            }
        };
        let mut dialog = dialog.add_filter("All files", &["*"]);
        if let Some(folder) = recent.first().and_then(|path| path.parent()) {
            dialog = dialog.set_directory(folder);
        }
        // Some desktops require the dialog to be created on the main thread; only its answer is awaited elsewhere.
        let opened = Instant::now();
        let answer = dialog.pick_file();
        let (chosen, wake) = (self.chosen.0.clone(), Arc::clone(&self.wake));
        let thread = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
            let path = pollster::block_on(answer).map(|file| file.path().to_owned());
            let _ = chosen.send(Answer { of, path, after: opened.elapsed() });
            wake();
        });
        match thread {
            Ok(_) => self.dialog_open = true,
            Err(error) => {
                log::warn!("the file dialog could not be opened: {error}");
                ask_for_path(of, state);
            }
        }
    }

    fn save_screenshot(&self, ctx: &egui::Context, state: &mut AppState) {
        let Some(shot) = Screenshot::capture(state, ctx.pixels_per_point()) else {
            state.messages.notify(Severity::Warning, "There is no picture to save yet");
            return;
        };
        if let Err(error) = screenshot::save_in_background(
            shot,
            state.wanted.save_folders(),
            self.saved.0.clone(),
            Arc::clone(&self.wake),
        ) {
            state.messages.notify(Severity::Error, format!("The screenshot could not be taken: {error}"));
        }
    }

    fn save_rows(&self, format: RowFormat, state: &mut AppState) {
        let Some(result) = state.activity.measured.get(&state.preferences.paper.experiment).cloned() else {
            state.messages.notify(Severity::Warning, "There are no rows to save yet");
            return;
        };
        self.save(state, "table of rows", move |folder| write_rows(folder, &result, format));
    }

    /// Saves something by `write` beside the model, on a thread of its own, because drawing a plot takes longer than a UI frame.
    fn save(
        &self,
        state: &mut AppState,
        what: &'static str,
        write: impl FnOnce(&Path) -> Result<PathBuf, String> + Send + 'static,
    ) {
        let (saved, wake, folders) = (self.saved.0.clone(), Arc::clone(&self.wake), state.wanted.save_folders());
        let thread = std::thread::Builder::new().name("save".to_owned()).spawn(move || {
            let folder = first_writable(&folders);
            let outcome =
                write(&folder).map(|path| (path, None)).map_err(|error| format!("The {what} was not saved: {error}"));
            // Sending fails where the window has been closed.
            let _ = saved.send(outcome);
            wake();
        });
        if let Err(error) = thread {
            state.messages.notify(Severity::Error, format!("The {what} could not be saved: {error}"));
        }
    }
}

/// Writes the rows into a new file in `folder`.
fn write_rows(folder: &Path, result: &PaperResult, format: RowFormat) -> Result<PathBuf, String> {
    let bytes = result.file(format)?;
    write_new(folder, &result.stem(), format.extension(), &bytes).map_err(|error| error.to_string())
}

/// Performs the requested actions. Requests that these make take their place.
fn perform_actions(state: &mut AppState) {
    for request in std::mem::take(&mut state.activity.requests) {
        match request {
            Request::Perform(action) if action.is_enabled(state) => action.perform(state),
            Request::Perform(_) => {}
            other => state.activity.requests.push(other),
        }
    }
}

/// Opens the start page at its path field, with the note that there is no file dialog.
fn ask_for_path(of: Chosen, state: &mut AppState) {
    let field = &mut state.layout.path_field;
    field.asked_for = Some(match of {
        Chosen::Model => "type the path here, or drop the file on the window",
        Chosen::Sequence => "type the path here with # for each digit, as in walk_####.obj",
        Chosen::Tree(_) => "type the path of the tree here, or drop the file on the window",
    });
    field.tree = match of {
        Chosen::Model | Chosen::Sequence => None,
        Chosen::Tree(side) => Some(side),
    };
    // A path typed next would be joined to the one before.
    field.text.clear();
    field.wants_focus = true;
    state.layout.start_page_open = true;
}

/// Opens a model, or reads the wanted one again. A file of rays is one of the present model.
fn open(source: SceneSource, keep_camera: bool, reconciler: &mut Reconciler, state: &mut AppState) {
    state.layout.start_page_open = false;
    if let Some(path) = source.path().filter(|path| is_ray_file(path)) {
        return open_rays(path, state);
    }
    reconciler.open(source, keep_camera, state);
}

/// Opens the first model among files dropped on the window. The camera stays where that is the open model and still in its view.
pub(crate) fn take_dropped_files(ctx: &egui::Context, reconciler: &mut Reconciler, state: &mut AppState) {
    let paths: Vec<PathBuf> =
        ctx.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect());
    let Some(first) = paths.iter().find(|path| is_model(path)).or(paths.first()) else { return };
    if paths.len() > 1 {
        let text = format!("{} files were dropped: {} is opened", paths.len(), first.display());
        state.messages.notify(Severity::Info, text);
    }
    let source = SceneSource::File(first.clone());
    let is_open = state.wanted.source.absolute() == source.absolute();
    open(source, is_open, reconciler, state);
}

fn is_model(path: &Path) -> bool {
    FileFormat::from_extension(path).is_some()
}

/// Wants the rays of a file for the present model; reads them again where they are open.
fn open_rays(path: &Path, state: &mut AppState) {
    if state.model.loaded.is_none() {
        state.messages.notify(Severity::Warning, "Open the model first, then its rays".to_owned());
        return;
    }
    state.wanted.ray_file = Some(std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
    state.model.derived.ray_file.open_again();
}

/// Wants a tree of the present model to be read from `path`; a second tree is added where that one is to be read.
fn open_tree(side: TreeSide, path: PathBuf, state: &mut AppState) {
    let path = std::path::absolute(&path).unwrap_or(path);
    if state.model.loaded.is_none() {
        let text = "Open the model first, then its tree";
        state.messages.notify(Severity::Warning, text);
        return;
    }
    preferences::remember_file(&mut state.preferences.recent_trees, path.clone());
    if side == TreeSide::B && state.wanted.second.is_none() {
        state.wanted.second = Some(SecondTree::new(state.wanted.build));
    }
    state.layout.start_page_open = false;
    state.wanted.set_tree_file(side, Some(path));
}

/// Saves the presented tree beside the model, on a thread of its own.
fn save_tree(saved: Sender<screenshot::Outcome>, wake: Arc<dyn Fn() + Send + Sync>, state: &mut AppState) {
    let side = state.edited_side();
    let Some(shown) = state.shown_tree(side) else {
        state.messages.notify(Severity::Warning, "There is no tree to save yet");
        return;
    };
    let accel = Arc::clone(&shown.accel);
    let side = state.wanted.second.map(|_| format!("-{}", side.name())).unwrap_or_default();
    let tree = format!("{side}-{}", shown.file_name());
    let folders = state.wanted.save_folders();
    let thread = std::thread::Builder::new().name("save tree".to_owned()).spawn(move || {
        let outcome = write_tree_file(&accel, &tree, &first_writable(&folders))
            .map(|path| (path, None))
            .map_err(|error| format!("The tree was not saved: {error}"));
        // Sending fails where the window has been closed.
        let _ = saved.send(outcome);
        wake();
    });
    if let Err(error) = thread {
        state.messages.notify(Severity::Error, format!("The tree could not be saved: {error}"));
    }
}

/// Writes a tree file named after the model and `tree`.
fn write_tree_file(accel: &Accel, tree: &str, folder: &Path) -> Result<PathBuf, String> {
    // Arrays are made whole before they are written.
    Budget::of_process().check("the file", accel.tree.bytes() as u64).map_err(|error| error.to_string())?;
    let label = accel.scene.source.label();
    let name = Path::new(&label).file_stem().map_or_else(|| label.clone(), |stem| stem.to_string_lossy().into());
    let stem = format!("{name}{tree}");
    let token = CancelToken::new();
    let trees = accel.file_trees(false, &token).map_err(|error| error.to_string())?;
    let write =
        |writer: &mut dyn std::io::Write| trees.write(false, writer, &token).map_err(|error| cannot_be_written(&error));
    write_new_with(folder, &stem, "bvh", write).map_err(|error| error.to_string())
}
