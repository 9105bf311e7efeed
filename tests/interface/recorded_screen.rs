//! The app in a harness of egui_kittest. Its own way, the feature `eframe`, switches on the support for screen readers of eframe, whose
//! 59 packages nothing else here needs.

use std::cell::Cell;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

use bvhscope::app::App;
use bvhscope::app::state::Wanted;
use bvhscope::scene::{LoadOptions, SceneSource};
use eframe::App as _;
use egui::{LayerId, Ui, UiBuilder, Vec2};
use egui_kittest::Harness;
use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state, default_wgpu_setup};

/// Pixels per point where a test is about none of them: tests of the interface spend most of their time in tracing pictures.
pub const COARSE: f32 = 0.5;

pub type Window = Harness<'static, Screen>;

/// The app, which the harness knows only as a state that a function draws.
pub struct Screen {
    app: Option<App>,
    frame: eframe::Frame,
}

impl Deref for Screen {
    type Target = App;

    fn deref(&self) -> &App {
        self.app.as_ref().unwrap()
    }
}

impl DerefMut for Screen {
    fn deref_mut(&mut self) -> &mut App {
        self.app.as_mut().unwrap()
    }
}

/// The app on any model with one sample per pixel, of a size in points, with pixels per point, before its first frame is fresh. With
/// `waits` each frame waits until everything is.
pub fn open(source: SceneSource, size: Vec2, scale: f32, waits: bool) -> Window {
    open_with(source, LoadOptions::default(), size, scale, waits)
}

/// The same of a model that is loaded with `load`.
pub fn open_with(source: SceneSource, load: LoadOptions, size: Vec2, scale: f32, waits: bool) -> Window {
    let mut wanted = Wanted::new(source);
    wanted.render.samples = 1;
    let render_state = create_render_state(default_wgpu_setup(), egui_wgpu::RendererOptions::PREDICTABLE);
    let mut frame = eframe::Frame::_new_kittest();
    frame.wgpu_render_state = Some(render_state.clone());
    // The app asks for the context, which the harness makes.
    let made = Rc::new(Cell::new(None));
    let setup = {
        let (made, render_state) = (Rc::clone(&made), render_state.clone());
        move |ctx: &egui::Context| {
            let mut creation = eframe::CreationContext::_new_kittest(ctx.clone());
            creation.wgpu_render_state = Some(render_state);
            made.set(Some(App::new_for_test(&creation, wanted, load, waits).unwrap()));
        }
    };
    let draw = move |ui: &mut Ui, screen: &mut Screen| {
        let Screen { app, frame } = screen;
        let app = app.get_or_insert_with(|| made.take().unwrap());
        // Without the margin of what the harness hands over.
        let whole = UiBuilder::new().layer_id(LayerId::background()).max_rect(ui.ctx().content_rect());
        let mut root = Ui::new(ui.ctx().clone(), egui::Id::unique("screen"), whole);
        app.logic(&root, frame);
        app.ui(&mut root, frame);
    };
    Harness::builder()
        .with_size(size)
        .with_pixels_per_point(scale)
        .with_max_steps(40)
        .renderer(WgpuTestRenderer::from_render_state(render_state))
        .with_context_setup(setup)
        .build_ui_state(draw, Screen { app: None, frame })
}
