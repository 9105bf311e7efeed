//! The graphics driver's complaints, and its end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use eframe::{egui, wgpu};

/// The device of this process was lost while the window was open.
static LOST: AtomicBool = AtomicBool::new(false);

/// The driver said so, which it also does when the window is closed.
static TOLD: AtomicBool = AtomicBool::new(false);

/// Whether the window ended because the device was lost. A panic is put down to it where the driver told of a loss.
pub(crate) fn was_lost(panicked: bool) -> bool {
    LOST.load(Ordering::Relaxed) || panicked && TOLD.load(Ordering::Relaxed)
}

/// So many kinds of complaints are told.
const MOST_COMPLAINTS: usize = 10;

/// What the driver complained of, and how much of it was told.
#[derive(Default)]
struct Complaints {
    texts: Vec<String>,
    reported: usize,
}

/// What is known of the device.
#[derive(Default)]
pub(crate) struct Device {
    complaints: Arc<Mutex<Complaints>>,
    lost: Arc<AtomicBool>,
    /// For tests.
    pub lose_on_purpose: bool,
    /// For tests.
    pub refuse_on_purpose: bool,
}

impl Device {
    /// Listens to `device`; wakes the window when there is something to say.
    pub fn watch(&self, device: &wgpu::Device, ctx: &egui::Context) {
        let (place, wake) = (Arc::clone(&self.complaints), ctx.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let text = error.to_string();
            let mut complaints = place.lock().unwrap_or_else(PoisonError::into_inner);
            // Complaints that come with each frame must not ask for another frame.
            if !complaints.texts.contains(&text) && complaints.texts.len() < MOST_COMPLAINTS {
                complaints.texts.push(text);
                wake.request_repaint();
            }
        }));
        let (lost, wake) = (Arc::clone(&self.lost), ctx.clone());
        device.set_device_lost_callback(move |_, _| {
            lost.store(true, Ordering::Relaxed);
            TOLD.store(true, Ordering::Relaxed);
            wake.request_repaint();
        });
    }

    /// The next complaint that was not told yet.
    pub fn take_error(&self) -> Option<String> {
        let mut complaints = self.complaints.lock().unwrap_or_else(PoisonError::into_inner);
        let text = complaints.texts.get(complaints.reported)?.clone();
        complaints.reported += 1;
        Some(text)
    }

    /// Whether nothing can be drawn any more. Remembered for [`was_lost`].
    pub fn is_lost(&self) -> bool {
        let lost = self.lost.load(Ordering::Relaxed);
        if lost {
            LOST.store(true, Ordering::Relaxed);
        }
        lost
    }

    /// Asks for more than the driver can give, once, where a test asked for it.
    pub fn refuse_if_wanted(&mut self, device: &wgpu::Device) {
        if std::mem::take(&mut self.refuse_on_purpose) {
            drop(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("more than there is"),
                size: device.limits().max_buffer_size.saturating_add(4),
                usage: wgpu::BufferUsages::VERTEX,
                mapped_at_creation: false,
            }));
        }
    }

    /// Does what a driver that crashes does, once, where a test asked for it.
    pub fn lose_if_wanted(&mut self, device: &wgpu::Device) {
        if std::mem::take(&mut self.lose_on_purpose) {
            device.destroy();
            // The callback is called when the device is next asked for news, which fails now.
            let _ = device.poll(wgpu::PollType::Poll);
        }
    }
}
