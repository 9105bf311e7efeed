//! Carrying out what plain values cannot: dialogs, screenshots, reloading, leaving.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui;

use crate::app::state::paper::{PaperResult, RowFormat};
use crate::app::state::{AppState, Request, Severity};
use crate::app::viewport::screenshot;
use crate::app::viewport::screenshot::Screenshot;
use crate::app::work::measure_worker::MeasureWorker;
use crate::app::work::reconcile::Rails;
use crate::export::write_new;
use crate::scene::{FileFormat, SceneSource, model_extensions};

/// Errands that run on their own threads.
pub struct BackgroundTasks {
    chosen: (Sender<Option<PathBuf>>, Receiver<Option<PathBuf>>),
    dialog_open: bool,
    shots: (Sender<screenshot::Outcome>, Receiver<screenshot::Outcome>),
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl BackgroundTasks {
    /// Nothing on its way; `wake` is called when an errand is done.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { chosen: channel(), dialog_open: false, shots: channel(), wake }
    }

    /// Takes what has come back.
    pub fn poll(&mut self, rails: &mut Rails, state: &mut AppState) {
        while let Ok(path) = self.chosen.1.try_recv() {
            self.dialog_open = false;
            if let Some(path) = path {
                open(SceneSource::File(path), rails, state);
            }
        }
        while let Ok(outcome) = self.shots.1.try_recv() {
            match outcome {
                Ok((path, None)) => state.messages.notify(Severity::Info, format!("Saved {}", path.display())),
                Ok((path, Some(why))) => {
                    state.messages.notify(Severity::Warning, format!("Saved {}, but {why}", path.display()))
                }
                Err(why) => state.messages.notify(Severity::Error, why),
            }
        }
    }

    /// Carries out what the panels asked for in this UI frame.
    pub fn carry_out(
        &mut self,
        ctx: &egui::Context,
        rails: &mut Rails,
        measure_worker: &mut MeasureWorker,
        state: &mut AppState,
    ) {
        for request in std::mem::take(&mut state.requests) {
            match request {
                Request::Open(source) => open(source, rails, state),
                Request::OpenDialog => self.open_dialog(state),
                Request::Reload => {
                    rails.keep_camera = true;
                    rails.reload();
                }
                Request::CancelJobs => rails.cancel(state),
                Request::Measure => measure_worker.measure(state),
                Request::CancelMeasuring => measure_worker.cancel(state),
                Request::SaveRows(format) => self.save_rows(format, state),
                Request::Screenshot => self.shoot(ctx, state),
                Request::Copy(text) => ctx.copy_text(text),
                Request::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            }
        }
    }

    fn open_dialog(&mut self, state: &mut AppState) {
        if self.dialog_open {
            return;
        }
        let mut dialog = rfd::AsyncFileDialog::new()
            .set_title("Open a model")
            .add_filter("Models", &model_extensions())
            .add_filter("All files", &["*"]);
        if let Some(folder) = state.preferences.recent.first().and_then(|path| path.parent()) {
            dialog = dialog.set_directory(folder);
        }
        // Made here because some desktops want that on the main thread; awaited elsewhere because it takes its time.
        let answer = dialog.pick_file();
        let (chosen, wake) = (self.chosen.0.clone(), Arc::clone(&self.wake));
        let thread = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
            let path = pollster::block_on(answer).map(|file| file.path().to_owned());
            let _ = chosen.send(path);
            wake();
        });
        match thread {
            Ok(_) => self.dialog_open = true,
            Err(error) => state.messages.notify(
                Severity::Error,
                format!("The file dialog could not be opened: {error}. Drop the file on the window instead"),
            ),
        }
    }

    fn shoot(&self, ctx: &egui::Context, state: &mut AppState) {
        let Some(shot) = Screenshot::capture(state, ctx.pixels_per_point()) else {
            state.messages.notify(Severity::Warning, "There is no picture to save yet");
            return;
        };
        if let Err(error) = screenshot::save_in_background(shot, self.shots.0.clone(), Arc::clone(&self.wake)) {
            state.messages.notify(Severity::Error, format!("The screenshot could not be taken: {error}"));
        }
    }

    /// Drawing a plot takes a moment, so it is done on a thread of its own.
    fn save_rows(&self, format: RowFormat, state: &mut AppState) {
        let Some(result) = state.activity.measured.clone() else {
            state.messages.notify(Severity::Warning, "There are no rows to save yet");
            return;
        };
        let (saved, wake) = (self.shots.0.clone(), Arc::clone(&self.wake));
        let thread = std::thread::Builder::new().name("save rows".to_owned()).spawn(move || {
            let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
            let outcome = save_rows_into(&folder, &result, format);
            // The window may be gone by now: then nobody wants to know.
            let _ =
                saved.send(outcome.map(|path| (path, None)).map_err(|why| format!("The rows were not saved: {why}")));
            wake();
        });
        if let Err(error) = thread {
            state.messages.notify(Severity::Error, format!("The rows could not be saved: {error}"));
        }
    }
}

/// Writes the rows into a new file of the current folder.
fn save_rows_into(folder: &Path, result: &PaperResult, format: RowFormat) -> Result<PathBuf, String> {
    let bytes = result.file(format)?;
    write_new(folder, &result.stem(), format.extension(), &bytes).map_err(|error| error.to_string())
}

/// Opens a model; the same one again is read again.
pub fn open(source: SceneSource, rails: &mut Rails, state: &mut AppState) {
    state.layout.start_page_open = false;
    rails.keep_camera = false;
    if state.wanted.source == source {
        rails.reload();
    }
    rails.allow_again();
    state.wanted.source = source;
}

/// Opens the first of the files that were dropped on the window. The camera stays if it still sees the model.
pub fn take_dropped_files(ctx: &egui::Context, rails: &mut Rails, state: &mut AppState) {
    let paths: Vec<PathBuf> =
        ctx.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect());
    let Some(first) = paths.iter().find(|path| is_model(path)).or(paths.first()) else { return };
    if paths.len() > 1 {
        let text = format!("{} files were dropped: {} is opened", paths.len(), first.display());
        state.messages.notify(Severity::Info, text);
    }
    open(SceneSource::File(first.clone()), rails, state);
    rails.keep_camera = true;
}

fn is_model(path: &Path) -> bool {
    FileFormat::from_extension(path).is_some()
}
