//! Opening the window, and saying in plain words why there is none.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::{egui, wgpu};

use super::storage::APP_ID;
use super::{App, StartOptions};

/// Why the window could not be opened. The texts say what to do instead.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// Nowhere to open a window.
    #[error(
        "there is no display to open a window on ({0}). Without one, 'bvhscope render MODEL -o out.png' makes the same \
         picture, and all other commands work as well"
    )]
    NoDisplay(String),
    /// No graphics driver that can draw.
    #[error(
        "no graphics driver was found ({0}). Install a Vulkan or OpenGL driver (Debian and Ubuntu: \
         mesa-vulkan-drivers); 'bvhscope render MODEL -o out.png' works without one as long as no overlay is asked for"
    )]
    NoGraphics(String),
    /// A library of the desktop is missing.
    #[error("{0} Install it (Debian and Ubuntu: libxkbcommon-x11-0), or use 'bvhscope render MODEL -o out.png'")]
    NoLibrary(String),
    /// Anything else.
    #[error("the window could not be opened: {0}")]
    Other(String),
}

/// Opens the window and returns when it is closed.
pub fn run(options: StartOptions) -> Result<(), AppError> {
    let native = native_options();
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        eframe::run_native(APP_ID, native, Box::new(move |context| Ok(Box::new(App::new(context, options)?))))
    }));
    match outcome {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(in_plain_words(error)),
        // The keyboard library is opened at run time, and its absence is a panic there.
        Err(payload) => match payload.downcast_ref::<String>() {
            Some(text) if text.contains("could not be loaded") => Err(AppError::NoLibrary(text.clone())),
            _ => resume_unwind(payload),
        },
    }
}

fn in_plain_words(error: eframe::Error) -> AppError {
    let text = error.to_string();
    match error {
        eframe::Error::WinitEventLoop(_) => AppError::NoDisplay(text),
        eframe::Error::Wgpu(_) => AppError::NoGraphics(text),
        _ => AppError::Other(text),
    }
}

fn native_options() -> eframe::NativeOptions {
    let viewport = egui::ViewportBuilder::default()
        .with_title("bvhscope")
        .with_app_id(APP_ID)
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([640.0, 400.0])
        .with_drag_and_drop(true);
    eframe::NativeOptions {
        viewport: match eframe::icon_data::from_png_bytes(include_bytes!("../../assets/icon-256.png")) {
            Ok(icon) => viewport.with_icon(icon),
            Err(_) => viewport,
        },
        wgpu_options: WgpuConfiguration {
            wgpu_setup: WgpuSetup::CreateNew(WgpuSetupCreateNew {
                device_descriptor: std::sync::Arc::new(device_descriptor),
                ..WgpuSetupCreateNew::without_display_handle()
            }),
            ..WgpuConfiguration::default()
        },
        system_font_fallback: false,
        ..eframe::NativeOptions::default()
    }
}

/// As much as the adapter gives: ten million nodes need buffers far beyond the portable defaults.
fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("bvhscope"),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }
}
