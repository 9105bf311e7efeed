//! The application: everything that one UI frame does, in its order.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::options::StartOptions;
use super::storage::{Settings, SettingsAutosave};
use super::{files, storage, system};
use crate::app::shell::derived_worker::DerivedWorker;
use crate::app::shell::file_watch::{FileChange, FileWatch, TreeWatch};
use crate::app::shell::measure_worker::MeasureWorker;
use crate::app::shell::quick_drags::QuickDrags;
use crate::app::shell::reconcile::Reconciler;
use crate::app::shell::requests::{BackgroundTasks, take_dropped_files};
use crate::app::shell::system::{ClipboardProbe, Device};
use crate::app::shell::thumbnails;
use crate::app::shell::thumbnails::ThumbnailWorker;
use crate::app::shell::wake_signal::WakeSignal;
use crate::app::state::{AppState, JobStatus, Preferences, Request, Severity, TreeSide, Wanted};
use crate::app::studies::Studies;
use crate::app::viewport::Viewport;
use crate::app::{commands, panels, studies, theme, views};
use crate::console::note;
use crate::overlay::OverlayPipeline;
use crate::render::Background;
use crate::scene::{LoadOptions, SceneSource};
use crate::text::shown_path;
use crate::view::CameraChoice;

/// Maximum time that [`App::run_until_idle`] waits.
const IDLE_TIMEOUT: Duration = Duration::from_mins(2);
/// Delay after the last input before a tree is measured at rest.
const REST_DELAY: Duration = Duration::from_millis(300);
/// Interval between two calls of [`App::run_until_idle`] to the workers.
const IDLE_POLL: Duration = Duration::from_millis(1);
/// Minimum interval between UI frames without a new result, where software rendering competes with a rebuild for the cores.
const THROTTLED_FRAME_INTERVAL: Duration = Duration::from_millis(100);
/// The same while a picture of a moving camera is traced: frames that show no new one would make the next one later.
const MOTION_FRAME_INTERVAL: Duration = Duration::from_millis(33);

/// A button that is up again after this long was not clicked: longer than a frame takes on a busy machine that draws in software,
/// which sees both only in the next one.
const MAX_CLICK_SECONDS: f64 = 2.5;

/// The program with its window.
pub struct App {
    /// The state that panels show and edit.
    pub state: AppState,
    reconciler: Reconciler,
    measure_worker: MeasureWorker,
    derived_worker: DerivedWorker,
    studies: Studies,
    background_tasks: BackgroundTasks,
    clipboard_probe: Option<ClipboardProbe>,
    thumbnail_worker: Option<ThumbnailWorker>,
    file_watch: FileWatch,
    tree_watch: TreeWatch,
    viewport: Viewport,
    has_pipeline: bool,
    device: Device,
    title: String,
    frame_started: Instant,
    wake_signal: WakeSignal,
    settings_autosave: SettingsAutosave,
    /// UI frames are limited while a tree is rebuilt, because they are rendered in software.
    throttles_frames: bool,
    /// Each UI frame waits until everything wanted is shown: for tests.
    waits_until_idle: bool,
}

impl App {
    /// Creates the application of a real window.
    pub fn new(context: &eframe::CreationContext<'_>, options: StartOptions) -> std::io::Result<Self> {
        system::watch_interrupts(&context.egui_ctx);
        let mut restored = storage::restore(options.settings_file.as_deref());
        let kept = restored.kept(options.source.as_ref().unwrap_or(&SceneSource::default_builtin()));
        if let Some(run) = restored.run.take().filter(|_| options.restore) {
            (restored.wanted, restored.preferences) = (Some(run.wanted), Some(run.preferences));
        }
        let last_source = || restored.wanted.as_ref().filter(|_| options.restore).map(|wanted| wanted.source.clone());
        let source = options.source.or_else(last_source).unwrap_or_else(SceneSource::default_builtin);
        // The saved camera belongs to the saved model.
        let same_model = restored.wanted.as_ref().is_some_and(|wanted| wanted.source == source);
        let mut wanted = restored.wanted.unwrap_or_else(|| Wanted::new(source.clone()));
        wanted.source = source;
        // Trees, moment and policies of the last run belong to its model.
        if !(options.restore && same_model) {
            wanted.tree_files = [options.tree_file, None];
            wanted.ray_file = options.ray_file;
            wanted.stand_still();
        }
        let mut preferences = restored.preferences.unwrap_or_default();
        options.overrides.apply(&mut wanted, &mut preferences);
        let mut state = AppState::new(wanted, preferences);
        state.views = views::states();
        for warning in restored.warning.into_iter().chain(options.notices) {
            note(format_args!("warning: {warning}"));
            state.messages.notify(Severity::Warning, warning);
        }
        state.model.load_options = options.load.clone();
        for folder in options.lessons {
            let (lessons, warnings) = files::read_lessons(&folder);
            state.layout.lessons.extend(lessons);
            for warning in warnings {
                note(format_args!("warning: {warning}"));
                state.messages.notify(Severity::Warning, warning);
            }
        }
        let mut camera = options.camera;
        if let Some(shared) = options.shared {
            camera = camera.or((!shared.has_own_view()).then(|| {
                let Wanted { camera, offset, .. } = shared.wanted;
                CameraChoice::in_file(camera, offset)
            }));
            state.wanted.source = shared.wanted.source.clone();
            commands::show_state(&mut state, shared);
        }
        let mut app = Self::with_state(context, state)?;
        let started = Settings { wanted: app.state.wanted.clone(), preferences: app.state.preferences.clone() };
        app.settings_autosave = SettingsAutosave::new(options.settings_file).without_flags(kept, started);
        app.reconciler.set_load_options(options.load, camera, same_model);
        app.device.inject_faults(options.lose_device, options.refuse_buffer);
        app.throttles_frames = app.state.layout.graphics.is_software;
        // A run that saves no settings leaves nothing in the cache either.
        let cache = if options.settings.none { None } else { thumbnails::cache_folder() };
        let ctx = context.egui_ctx.clone();
        app.thumbnail_worker = Some(ThumbnailWorker::new(cache, move || ctx.request_repaint())?);
        let ctx = context.egui_ctx.clone();
        app.clipboard_probe = Some(ClipboardProbe::start(Arc::new(move || ctx.request_repaint())));
        Ok(app)
    }

    /// Creates an application for tests, without saved settings. With `waits_until_idle` each UI frame waits until everything
    /// wanted is shown, so that each run sees the same.
    pub fn new_for_test(
        context: &eframe::CreationContext<'_>,
        wanted: Wanted,
        load: LoadOptions,
        waits_until_idle: bool,
    ) -> std::io::Result<Self> {
        let mut state = AppState::new(wanted, Preferences::default());
        state.views = views::states();
        state.model.load_options = load.clone();
        let mut app = Self::with_state(context, state)?;
        app.reconciler.set_load_options(load, None, false);
        app.waits_until_idle = waits_until_idle;
        // Tests of these readings switch them on.
        app.state.model.derived.at_rest.is_off = true;
        app.reconciler.set_always_at_rest(waits_until_idle);
        Ok(app)
    }

    fn with_state(context: &eframe::CreationContext<'_>, mut state: AppState) -> std::io::Result<Self> {
        let ctx = context.egui_ctx.clone();
        theme::apply(&ctx, &state.preferences);
        ctx.options_mut(|options| options.input_options.max_click_duration = MAX_CLICK_SECONDS);
        ctx.add_plugin(QuickDrags::default());
        let device = Device::default();
        if let Some(render_state) = &context.wgpu_render_state {
            let info = render_state.adapter.get_info();
            state.layout.graphics.adapter_name = info.name;
            backend_name(info.backend).clone_into(&mut state.layout.graphics.backend);
            state.layout.graphics.is_software = info.device_type == wgpu::DeviceType::Cpu;
            device.watch(&render_state.device, &ctx);
            let pipeline = OverlayPipeline::new(&render_state.device, render_state.target_format);
            render_state.renderer.write().callback_resources.insert(pipeline);
        }
        let wake_signal = WakeSignal::default();
        let wake = {
            let wake_signal = wake_signal.clone();
            move || {
                wake_signal.set();
                ctx.request_repaint();
            }
        };
        let mut studies = Studies::new(wake.clone());
        studies::shared::add(&mut studies)?;
        views::add_studies(&mut studies)?;
        Ok(Self {
            state,
            reconciler: Reconciler::new(wake.clone())?,
            measure_worker: MeasureWorker::new(wake.clone())?,
            derived_worker: DerivedWorker::new(wake.clone())?,
            studies,
            file_watch: FileWatch::new(wake.clone())?,
            tree_watch: TreeWatch::new(wake.clone()),
            background_tasks: BackgroundTasks::new(Arc::new(wake)),
            clipboard_probe: None,
            thumbnail_worker: None,
            viewport: Viewport::default(),
            has_pipeline: context.wgpu_render_state.is_some(),
            device,
            title: String::new(),
            frame_started: Instant::now(),
            wake_signal,
            settings_autosave: SettingsAutosave::default(),
            throttles_frames: false,
            waits_until_idle: false,
        })
    }

    /// Waits until everything wanted is loaded, built and traced to its end, or refused. Returns `false` if that takes longer
    /// than two minutes. For tests and scripts; a window never waits.
    pub fn run_until_idle(&mut self) -> bool {
        let start = Instant::now();
        loop {
            self.reconciler.poll(&mut self.state, Instant::now());
            self.reconciler.reconcile(&mut self.state, Instant::now());
            self.poll_idle_workers();
            if !self.is_busy() {
                return true;
            }
            if start.elapsed() > IDLE_TIMEOUT {
                return false;
            }
            std::thread::sleep(IDLE_POLL);
        }
    }

    /// Whether anything is being loaded, built, traced, derived or measured.
    pub fn is_busy(&self) -> bool {
        self.reconciler.is_busy()
            || self.measure_worker.is_busy()
            || self.derived_worker.is_busy()
            || self.studies.is_busy()
    }

    /// Polls the workers that start once the rails are idle.
    fn poll_idle_workers(&mut self) {
        let idle = !self.reconciler.is_busy();
        // While a model plays, the rails never rest, and the open view follows all the same.
        let studied = idle || self.state.model.playback.playing;
        self.measure_worker.poll(&mut self.state, idle);
        self.derived_worker.request_missing(&self.state, idle);
        self.studies.follow(&mut self.state, studied);
        if let Some(worker) = &mut self.thumbnail_worker {
            worker.poll(&mut self.state, idle);
        }
    }

    /// Any input stops what is measured at rest, until a moment without.
    fn note_input(&mut self, ctx: &egui::Context) {
        let rest = &mut self.state.model.derived.at_rest;
        rest.is_disturbed = ctx.input(|input| !input.events.is_empty() || input.pointer.any_down());
        rest.is_disturbed |= self.state.model.playback.playing;
        if rest.is_disturbed && !rest.is_off {
            ctx.request_repaint_after(REST_DELAY);
        }
    }

    fn report_device_errors(&mut self) {
        while let Some(error) = self.device.take_error() {
            note(format_args!("error: the graphics driver failed: {error}"));
            if !self.state.layout.graphics.failed {
                self.state.layout.graphics.failed = true;
                self.state.messages.notify(
                    Severity::Error,
                    format!("The graphics driver failed, so containers are no longer drawn: {error}. Update the driver or start with fewer containers"),
                );
            }
        }
    }

    /// Reads the model's file again when it was modified; when it was removed, the scene stays.
    fn follow_file_changes(&mut self) {
        if self.file_watch.watch(self.reconciler.file()) {
            self.state.model.file_missing = false;
        }
        for change in self.file_watch.changes() {
            let name = self.reconciler.file().map_or(String::new(), |file| file.path.display().to_string());
            log::info!("{name}: {change:?}");
            self.state.model.file_missing = change == FileChange::Removed;
            let messages = &mut self.state.messages;
            match change {
                FileChange::Modified => {
                    messages.notify(Severity::Info, format!("{name} was saved: it is read again"));
                    self.state.activity.requests.push(Request::Reload);
                }
                FileChange::Removed => {
                    messages.notify(Severity::Warning, format!("{name} is gone; what is shown stays"));
                }
                FileChange::Restored => {}
            }
        }
    }

    /// Reads a tree again whose file has changed; when it was removed, the tree stays.
    fn follow_tree_files(&mut self) {
        let files = TreeSide::ALL.map(|side| {
            let wanted = self.state.wanted.tree_file(side);
            self.reconciler.tree_file(side).filter(|file| wanted == Some(file.path.as_path())).cloned()
        });
        for (side, change) in self.tree_watch.changes(&files) {
            let Some(file) = &files[side as usize] else { continue };
            let name = shown_path(&file.path);
            log::info!("tree {}, {name}: {change:?}", side.name());
            let messages = &mut self.state.messages;
            match change {
                FileChange::Modified => {
                    messages.notify(Severity::Info, format!("{name} was saved: the tree is read again"));
                    self.reconciler.read_tree_again(side);
                }
                FileChange::Removed => {
                    messages.notify(Severity::Warning, format!("{name} is gone; the tree that was read stays"));
                }
                FileChange::Restored => {}
            }
        }
    }

    fn update_title(&mut self, ctx: &egui::Context) {
        let label = self.state.model.presented.as_ref().map(|presented| presented.accel.scene.source.label());
        let title = label.map_or_else(|| "bvhscope".to_owned(), |label| format!("{label} – bvhscope"));
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn autosave_settings(&mut self, ctx: &egui::Context) {
        let AppState { wanted, preferences, .. } = &self.state;
        let read = files_read(&self.state);
        if let Some(delay) = self.settings_autosave.save_if_due(wanted, preferences, read, Instant::now()) {
            ctx.request_repaint_after(delay);
        }
    }

    /// Performs what was requested in this UI frame, requests what is stale, and saves the settings.
    fn perform_requests(&mut self, ctx: &egui::Context) {
        self.background_tasks.perform(ctx, &mut self.reconciler, &mut self.measure_worker, &mut self.state);
        let (dragging, scrolls) = ctx.input(|input| {
            let is_held = !input.keys_down.is_empty() || input.smooth_scroll_delta() != egui::Vec2::ZERO;
            (input.pointer.any_down(), is_held || input.zoom_delta() != 1.0)
        });
        self.state.record_step(dragging, dragging || scrolls);
        self.reconcile(ctx);
        self.autosave_settings(ctx);
    }

    /// Requests what is stale and schedules the next UI frame.
    fn reconcile(&mut self, ctx: &egui::Context) {
        if self.waits_until_idle {
            let frame_id = |state: &AppState| state.model.presented.as_ref().map(|presented| presented.frame_id);
            let before = frame_id(&self.state);
            self.run_until_idle();
            if before != frame_id(&self.state) {
                ctx.request_repaint();
            }
        } else if let Some(delay) = self.reconciler.reconcile(&mut self.state, Instant::now()) {
            ctx.request_repaint_after(delay);
        }
        if self.measure_worker.is_busy() {
            ctx.request_repaint_after(JobStatus::INTERVAL);
        } else if let Some(since) = self.studies.drawn_since() {
            ctx.request_repaint_after(JobStatus::next_update(since, Instant::now()));
        }
    }
}

/// Name of a graphics interface for the user.
const fn backend_name(backend: wgpu::Backend) -> &'static str {
    match backend {
        wgpu::Backend::Vulkan => "Vulkan",
        wgpu::Backend::Metal => "Metal",
        wgpu::Backend::Dx12 => "Direct3D 12",
        wgpu::Backend::Gl => "OpenGL",
        wgpu::Backend::BrowserWebGpu => "WebGPU",
        wgpu::Backend::Noop => "none",
    }
}

/// The files that the model on the screen was read from.
fn files_read(state: &AppState) -> &[PathBuf] {
    state.model.loaded.as_ref().map_or(&[], |scene| &scene.files_read)
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        // Each movement of the pointer requests a UI frame, and rendering one in software takes half as long as a tree.
        let interval = match self.throttles_frames {
            true if self.reconciler.is_rebuilding_in_motion(Instant::now()) => THROTTLED_FRAME_INTERVAL,
            true if self.reconciler.is_following_motion() => MOTION_FRAME_INTERVAL,
            _ => Duration::ZERO,
        };
        self.wake_signal.wait(self.frame_started + interval);
        let started = Instant::now();
        log::trace!("UI frame {:.1} ms after the last", started.duration_since(self.frame_started).as_secs_f64() * 1e3);
        self.frame_started = started;
        if system::was_interrupted() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        if let Some(render_state) = frame.wgpu_render_state()
            && self.state.model.presented.is_some()
        {
            self.device.trigger_faults(&render_state.device);
        }
        if self.device.is_lost() {
            // Nothing can be drawn any more: the settings are saved, and `run` starts the program again.
            self.settings_autosave.finish(&self.state.wanted, &self.state.preferences, files_read(&self.state));
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        self.report_device_errors();
        system::correct_size_on_first_frame(ctx);
        system::fit_screen(ctx);
        if let Some(fault) = self.clipboard_probe.as_ref().and_then(ClipboardProbe::fault) {
            self.state.layout.clipboard_fault = Some(fault);
        }
        self.background_tasks.poll(&mut self.reconciler, &mut self.state);
        self.reconciler.poll(&mut self.state, Instant::now());
        self.follow_file_changes();
        self.follow_tree_files();
        self.note_input(ctx);
        self.poll_idle_workers();
        self.update_title(ctx);
        // At the end of `ui` otherwise, which is not called while the window is hidden or covered.
        if ctx.input(|input| input.viewport().visible()) == Some(false) {
            self.perform_requests(ctx);
        }
    }

    /// The panels' colour, so that they need no fill of their own, which takes long in software.
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let state = &mut self.state;
        state.wanted.render.background = if ui.visuals().dark_mode { Background::Dark } else { Background::Light };
        let before = state.wanted.clone();
        self.viewport.update_hover(&ctx, state);
        panels::around(ui, state, |ui, state| self.viewport.show(ui, self.has_pipeline, state));

        state.wanted.build_what_was_changed(&before);
        take_dropped_files(&ctx, &mut self.reconciler, state);
        self.perform_requests(&ctx);
        log::trace!("UI frame of {:.1} ms", self.frame_started.elapsed().as_secs_f64() * 1e3);
    }

    fn on_exit(&mut self) {
        self.settings_autosave.finish(&self.state.wanted, &self.state.preferences, files_read(&self.state));
    }

    fn persist_egui_memory(&self) -> bool {
        false
    }
}
