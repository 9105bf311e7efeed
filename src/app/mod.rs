//! The window: the only place that owns threads and egui.
//!
//! Panels edit the plain values of [`state`]; [`reconcile`] compares them once a UI frame with what is shown and asks the
//! workers for what is stale. Nothing here blocks the UI thread.

pub mod state;

pub mod format;
pub mod theme;

pub mod viewport;

pub mod commands;

pub mod panels;

pub mod work;

mod launch;

use std::sync::Arc;
use std::time::{Duration, Instant};

use eframe::{egui, wgpu};

use crate::overlay::OverlayPipeline;
use crate::scene::SceneSource;
use launch::device::Device;
use launch::storage::SettingsAutosave;
use state::{AppState, Request, Severity, Wanted};
use viewport::Viewport;
use work::derived_worker::DerivedWorker;
use work::file_watch::{FileWatch, News};
use work::measure_worker::MeasureWorker;
use work::reconcile::Rails;
use work::requests::BackgroundTasks;
use work::wake_signal::WakeSignal;

pub use launch::interrupt::{interrupt, was_interrupted};
pub use launch::options::{CliOverrides, StartOptions};
pub use launch::run::{AppError, run};
pub use launch::settings::{SettingsUse, ended_as_wanted};

/// The smallest window in points.
const MIN_SIZE: [f32; 2] = [640.0, 400.0];
/// The window of a first start in points.
const START_SIZE: [f32; 2] = [1280.0, 800.0];

/// Longest time that [`App::run_until_idle`] waits.
const IDLE_TIMEOUT: Duration = Duration::from_mins(2);
/// While the tree is rebuilt under a hand and the graphics are drawn by the cores that build, UI frames without a new tree
/// are so far apart at least.
const FRAME_WITHOUT_NEWS: Duration = Duration::from_millis(100);
/// How often the progress of a measurement is looked at.
const PROGRESS: Duration = Duration::from_millis(100);

/// The program with its window.
pub struct App {
    /// What the window knows.
    pub state: AppState,
    rails: Rails,
    measure_worker: MeasureWorker,
    derived_worker: DerivedWorker,
    background_tasks: BackgroundTasks,
    file_watch: FileWatch,
    viewport: Viewport,
    has_pipeline: bool,
    device: Device,
    title: String,
    frame_started: Instant,
    wake_signal: WakeSignal,
    settings_autosave: SettingsAutosave,
    /// The graphics are drawn in software.
    spares_frames: bool,
    /// Each UI frame waits until everything is fresh: for tests.
    waits: bool,
}

impl App {
    /// The app of a real window.
    pub fn new(context: &eframe::CreationContext<'_>, options: StartOptions) -> std::io::Result<Self> {
        launch::interrupt::watch(&context.egui_ctx);
        let restored = launch::storage::restore(options.settings_file.as_deref());
        let last = || restored.wanted.as_ref().filter(|_| options.restore).map(|wanted| wanted.source.clone());
        let source = options.source.or_else(last).unwrap_or_else(SceneSource::default_builtin);
        // The last camera belongs to the last model.
        let same_model = restored.wanted.as_ref().is_some_and(|wanted| wanted.source == source);
        let mut wanted = restored.wanted.unwrap_or_else(|| Wanted::new(source.clone()));
        wanted.source = source;
        let mut preferences = restored.preferences.unwrap_or_default();
        options.asked.apply(&mut wanted, &mut preferences);
        let mut state = AppState::new(wanted, preferences);
        if let Some(complaint) = restored.complaint {
            eprintln!("warning: {complaint}");
            state.messages.notify(Severity::Warning, complaint);
        }
        for notice in options.notices {
            eprintln!("warning: {notice}");
            state.messages.notify(Severity::Warning, notice);
        }
        state.model.allow_outside = options.load.allow_outside;
        let mut app = Self::with_state(context, state)?;
        app.settings_autosave = SettingsAutosave::new(options.settings_file);
        app.rails.load_options = options.load;
        app.rails.keep_camera = same_model;
        app.rails.camera_choice = options.camera;
        app.device.lose_on_purpose = options.lose_device;
        app.device.refuse_on_purpose = options.refuse_buffer;
        app.spares_frames = app.state.graphics.is_software;
        Ok(app)
    }

    /// An app for tests: no settings of earlier runs, and with `waits` each UI frame waits until everything is fresh, so
    /// that each run sees the same.
    pub fn new_for_test(context: &eframe::CreationContext<'_>, wanted: Wanted, waits: bool) -> std::io::Result<Self> {
        let mut app = Self::with_state(context, AppState::new(wanted, state::Preferences::default()))?;
        app.waits = waits;
        app.rails.at_rest = waits;
        Ok(app)
    }

    fn with_state(context: &eframe::CreationContext<'_>, mut state: AppState) -> std::io::Result<Self> {
        let ctx = context.egui_ctx.clone();
        theme::apply(&ctx, &state.preferences);
        let device = Device::default();
        if let Some(render_state) = &context.wgpu_render_state {
            let info = render_state.adapter.get_info();
            state.graphics.adapter_name = info.name;
            state.graphics.is_software = info.device_type == wgpu::DeviceType::Cpu;
            device.watch(&render_state.device, &ctx);
            let pipeline = OverlayPipeline::new(&render_state.device, render_state.target_format);
            render_state.renderer.write().callback_resources.insert(pipeline);
        }
        let wake_signal = WakeSignal::default();
        let rung = wake_signal.clone();
        let wake = move || {
            rung.ring();
            ctx.request_repaint();
        };
        Ok(Self {
            state,
            rails: Rails::new(wake.clone())?,
            measure_worker: MeasureWorker::new(wake.clone())?,
            derived_worker: DerivedWorker::new(wake.clone())?,
            file_watch: FileWatch::new(wake.clone())?,
            background_tasks: BackgroundTasks::new(Arc::new(wake)),
            viewport: Viewport::default(),
            has_pipeline: context.wgpu_render_state.is_some(),
            device,
            title: String::new(),
            frame_started: Instant::now(),
            wake_signal,
            settings_autosave: SettingsAutosave::default(),
            spares_frames: false,
            waits: false,
        })
    }

    /// Waits until everything is fresh: whatever is wanted is loaded, built and traced to its end, or was refused. Returns
    /// whether that came about in time. For tests and scripts; a window never waits.
    pub fn run_until_idle(&mut self) -> bool {
        let start = Instant::now();
        loop {
            self.rails.poll(&mut self.state, Instant::now());
            self.rails.reconcile(&mut self.state, Instant::now());
            self.measure_worker.poll(&mut self.state, !self.rails.is_busy());
            self.derived_worker.follow(&self.state, !self.rails.is_busy());
            if !self.is_busy() {
                return true;
            }
            if start.elapsed() > IDLE_TIMEOUT {
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Whether a model, a tree or a picture is on its way, or something is measured.
    pub fn is_busy(&self) -> bool {
        self.rails.is_busy() || self.measure_worker.is_busy() || self.derived_worker.is_busy()
    }

    fn tell_device_error(&mut self) {
        while let Some(error) = self.device.take_error() {
            eprintln!("error: the graphics driver failed: {error}");
            if !self.state.graphics.failed {
                self.state.graphics.failed = true;
                self.state.messages.notify(
                    Severity::Error,
                    format!("The graphics driver failed, so containers are no longer drawn: {error}. Update the driver or start with fewer containers"),
                );
            }
        }
    }

    /// A file that was saved is read again; of one that is gone the scene stays.
    fn look_after_file(&mut self) {
        if self.file_watch.follow(self.rails.read_file.as_ref()) {
            self.state.model.file_missing = false;
        }
        for news in self.file_watch.news() {
            let name = self.rails.read_file.as_ref().map_or(String::new(), |(path, _)| path.display().to_string());
            log::info!("{name}: {news:?}");
            self.state.model.file_missing = news == News::Gone;
            match news {
                News::Saved => {
                    self.state.messages.notify(Severity::Info, format!("{name} was saved: it is read again"));
                    self.state.requests.push(Request::Reload);
                }
                News::Gone => {
                    self.state.messages.notify(Severity::Warning, format!("{name} is gone; what is shown stays"));
                }
                News::Back => {}
            }
        }
    }

    fn update_title(&mut self, ctx: &egui::Context) {
        let shown = self.state.model.presented.as_ref().map(|presented| presented.accel.scene.source.label());
        let title = shown.map_or_else(|| "bvhscope".to_owned(), |label| format!("{label} – bvhscope"));
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn keep_settings(&mut self, ctx: &egui::Context) {
        if let Some(after) = self.settings_autosave.follow(&self.state.wanted, &self.state.preferences, Instant::now())
        {
            ctx.request_repaint_after(after);
        }
    }

    /// Asks for what is stale and makes sure that somebody looks again.
    fn reconcile(&mut self, ctx: &egui::Context) {
        if self.waits {
            let before = self.state.model.presented.as_ref().map(|presented| presented.frame_id);
            self.run_until_idle();
            if before != self.state.model.presented.as_ref().map(|presented| presented.frame_id) {
                ctx.request_repaint();
            }
        } else if let Some(after) = self.rails.reconcile(&mut self.state, Instant::now()) {
            ctx.request_repaint_after(after);
        }
        if self.measure_worker.is_busy() {
            ctx.request_repaint_after(PROGRESS);
        }
    }
}

/// A window of the last run may be restored too small to be used, where nobody enforces its smallest size; one that is larger
/// than the driver's textures cannot be drawn.
fn keep_usable_size(ctx: &egui::Context) {
    if ctx.cumulative_frame_nr() != 1 {
        return;
    }
    let largest = ctx.input(|input| input.max_texture_side) as f32 / ctx.pixels_per_point();
    ctx.send_viewport_cmd(egui::ViewportCommand::MaxInnerSize(egui::Vec2::splat(largest)));
    let size = ctx.input(|input| input.viewport().inner_rect.map(|rect| rect.size()));
    let too_small = size.is_some_and(|size| size.x < MIN_SIZE[0] * 0.5 || size.y < MIN_SIZE[1] * 0.5);
    if too_small {
        ctx.send_viewport_cmd(egui::ViewportCommand::InnerSize(egui::Vec2::from(START_SIZE)));
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        // Each movement of the pointer asks for a frame, and software draws one in the time of half a tree.
        let worthwhile = self.frame_started + FRAME_WITHOUT_NEWS;
        let spared = self.spares_frames && self.rails.rebuilds_under_a_hand(Instant::now());
        self.wake_signal.wait(if spared { worthwhile } else { self.frame_started });
        self.frame_started = Instant::now();
        if was_interrupted() {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        if let Some(render_state) = frame.wgpu_render_state()
            && self.state.model.presented.is_some()
        {
            self.device.lose_if_wanted(&render_state.device);
            self.device.refuse_if_wanted(&render_state.device);
        }
        if self.device.is_lost() {
            // Nothing can be drawn any more: everything is kept, and `run` starts anew.
            self.settings_autosave.finish(&self.state.wanted, &self.state.preferences);
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        self.tell_device_error();
        keep_usable_size(ctx);
        self.background_tasks.poll(&mut self.rails, &mut self.state);
        self.rails.poll(&mut self.state, Instant::now());
        self.look_after_file();
        self.measure_worker.poll(&mut self.state, !self.rails.is_busy());
        self.derived_worker.follow(&self.state, !self.rails.is_busy());
        self.update_title(ctx);
        // Nobody draws a window that is hidden, whatever was changed just before.
        self.keep_settings(ctx);
    }

    /// The panels' colour, so that they need not fill themselves: drawn in software, that is a large part of a frame.
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let state = &mut self.state;
        panels::around(ui, state, |ui, state| self.viewport.show(ui, self.has_pipeline, state));

        work::requests::take_dropped_files(&ctx, &mut self.rails, state);
        self.background_tasks.carry_out(&ctx, &mut self.rails, &mut self.measure_worker, state);
        let dragging = ctx.input(|input| input.pointer.any_down());
        state.undo.observe(&state.wanted, dragging);
        self.reconcile(&ctx);
        self.keep_settings(&ctx);
        log::trace!("UI frame of {:.1} ms", self.frame_started.elapsed().as_secs_f64() * 1e3);
    }

    fn on_exit(&mut self) {
        self.settings_autosave.finish(&self.state.wanted, &self.state.preferences);
    }

    fn persist_egui_memory(&self) -> bool {
        false
    }
}
