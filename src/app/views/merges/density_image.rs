//! The density of merges as a texture, made once for each construction, part of it and theme.

use std::sync::{Arc, Weak};

use egui::{self, Color32, ColorImage, Id, TextureFilter, TextureHandle, TextureOptions, Ui};

use crate::app::state::lab::merges::MergeStudy;
use crate::app::theme;
use crate::lab::merges::Density;

/// Columns and rows of the density of a part.
const SIZE: [usize; 2] = [512, 96];

/// The density of the merges that a plot shows, with its picture.
pub(super) struct DensityImage {
    study: Weak<Density>,
    window: u32,
    color: Color32,
    /// The density.
    pub(super) density: Arc<Density>,
    /// Its picture.
    pub(super) texture: TextureHandle,
}

/// The density of the last `window` merges of `study`, each cell the stronger the more merges are in it.
pub(super) fn density_image(ui: &Ui, study: &MergeStudy, window: u32) -> Arc<DensityImage> {
    let id = Id::unique("density of merges");
    let color = theme::palette(ui).accent;
    let whole = &study.merges.density;
    let known = ui.data(|data| data.get_temp::<Arc<DensityImage>>(id));
    let is_same = |known: &Arc<DensityImage>| {
        std::ptr::eq(known.study.as_ptr(), Arc::as_ptr(whole)) && known.window == window && known.color == color
    };
    if let Some(known) = known.filter(is_same) {
        return known;
    }
    let all = study.merges.log_areas.len();
    let first = all.saturating_sub(window as usize);
    let density =
        if first == 0 { Arc::clone(whole) } else { Arc::new(Density::new(&study.merges.log_areas, first, SIZE)) };
    let largest = (1.0 + density.largest() as f32).ln();
    let pixel = |&count: &u32| {
        // Logarithmic, since most merges are alike and the few large ones matter.
        let strength = (1.0 + count as f32).ln() / largest;
        if count == 0 { Color32::TRANSPARENT } else { color.gamma_multiply(0.3 + 0.7 * strength) }
    };
    let image = ColorImage::new(density.size, density.counts.iter().map(pixel).collect());
    let options = TextureOptions {
        magnification: TextureFilter::Nearest,
        minification: TextureFilter::Linear,
        ..TextureOptions::default()
    };
    let texture = ui.ctx().load_texture("density of merges", image, options);
    let made = Arc::new(DensityImage { study: Arc::downgrade(whole), window, color, density, texture });
    ui.data_mut(|data| data.insert_temp(id, Arc::clone(&made)));
    made
}
