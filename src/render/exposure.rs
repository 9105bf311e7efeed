//! The exposure meter: how much light arrives at the surfaces in view, from a grid of points that does not depend on the
//! picture's resolution, so that all passes of a view agree and a moving camera changes it smoothly.

use glam::Vec3;

use super::adaptation::Metered;
use super::ambient_occlusion::around;
use super::lights::KeyLight;
use super::lit::{Bounce, Lit, bounced_light};
use super::request::RenderRequest;
use super::sampling::SampleId;
use super::settings::Exposure;
use super::surface::{self, Orientation};
use super::trace_context::TraceContext;
use crate::scene::Scene;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Columns and rows of the grid of metered points.
const GRID: [u32; 2] = [24, 16];
/// Rays into the hemisphere of each point.
const RAYS: u32 = 6;
/// Light that is shown as it is: about the mean of a scan in the sun.
const REFERENCE: f32 = 0.62;
/// Missing stops up to which nothing is corrected, and from which everything is: scans outdoors look the same from all sides.
const TOO_DARK: [f32; 2] = [0.5, 1.8];
/// The same for stops too many, of which the tone mapper copes with some.
const TOO_BRIGHT: [f32; 2] = [1.5, 2.5];
/// Luminance of surfaces from which on their colour does not matter.
const PALE: f32 = 0.3;
/// Least factor by which dark surfaces count as less light: rooms of dark stone are shown a little brighter, and a black model
/// in the sun stays black.
const MAX_DARKENING: f32 = 0.6;
/// Light of the darkest points, so that their logarithm is finite.
const DARKEST: f32 = 1e-4;

/// Sums over metered points.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    points: f32,
    log_light: f32,
    ambient: Vec3,
    open: Vec3,
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            log_light: self.log_light + other.log_light,
            ambient: self.ambient + other.ambient,
            open: self.open + other.open,
        }
    }
}

/// Meters the light at the surfaces in view, as a photographer's meter of incident light does: their colours hardly matter.
pub(super) fn meter(
    context: &TraceContext,
    lit: &Lit,
    request: &RenderRequest,
    token: &CancelToken,
) -> Result<Metered, Cancelled> {
    // Rows are added in their order, so that the sum is the same on any number of threads.
    let rows = par_tasks(0..GRID[1], token, |row, _| Ok(meter_row(context, lit, request, row)))?;
    let sums = rows.into_iter().fold(Sums::default(), Sums::plus);
    if sums.points == 0.0 {
        return Ok(Metered::NOTHING);
    }
    let light = (sums.log_light / sums.points).exp2();
    Ok(Metered { stops: stops(light, request.settings.exposure), openness: sums.ambient / sums.open })
}

/// Exposure in stops for surfaces that receive this much light.
fn stops(light: f32, exposure: Exposure) -> f32 {
    match exposure {
        Exposure::Fixed(stops) => stops,
        Exposure::Auto => {
            let missing = (REFERENCE / light).log2();
            let [from, to] = if missing > 0.0 { TOO_DARK } else { TOO_BRIGHT };
            let fraction = ((missing.abs() - from) / (to - from)).clamp(0.0, 1.0);
            // A smooth step: small differences between views are not followed at all.
            let corrected = missing * fraction * fraction * (3.0 - 2.0 * fraction);
            corrected.clamp(-Exposure::MAX_AUTO, Exposure::MAX_AUTO)
        }
    }
}

/// A point of the grid on a surface that takes light.
struct MeterPoint {
    hit: Hit,
    orientation: Orientation,
    key: KeyLight,
    /// Its light times the cosine between its direction and the normal.
    key_light: Vec3,
}

/// Sums over a row of the grid.
fn meter_row(context: &TraceContext, lit: &Lit, request: &RenderRequest, row: u32) -> Sums {
    let at = |index: u32, count: u32, size: u32| (index as f32 + 0.5) / count as f32 * size.max(1) as f32;
    let y = at(row, GRID[1], request.height_px);
    let rays: Vec<Ray> =
        (0..GRID[0]).map(|column| context.camera.ray(at(column, GRID[0], request.width_px), y)).collect();
    let mut hits = vec![None; rays.len()];
    context.closest_hits(&rays, &mut hits);
    // The rays of a kind of all points are traced together.
    let (mut points, mut bounces) = (Vec::new(), Vec::new());
    for ((ray, hit), column) in rays.into_iter().zip(hits).zip(0..) {
        let Some(hit) = hit.filter(|hit| !context.scene.material(hit.primitive_index).unlit) else { continue };
        let orientation = context.orientation(&ray, &hit);
        let position = surface::position(context.scene, &hit);
        let id = SampleId { x: column, y: row, sample: 0 };
        bounces.extend(around(context, position, &orientation, f32::INFINITY, RAYS, id));
        let key = lit.lights.key(orientation.lifted, orientation.smooth, -ray.direction, None);
        let key_light = key.light * orientation.smooth.dot(key.towards).max(0.0);
        points.push(MeterPoint { hit, orientation, key, key_light });
    }
    let mut bounce_hits = vec![None; bounces.len()];
    context.closest_hits(&bounces, &mut bounce_hits);
    // Those to the key light first, if it can be blocked.
    let suns = if lit.lights.casts_shadows() { &points[..] } else { &[] };
    let to_sun = |MeterPoint { orientation, key, .. }: &MeterPoint| {
        context.ray_to(orientation.lifted, orientation.geometric, key.towards, key.distance)
    };
    let mut shadow_rays: Vec<Ray> = suns.iter().map(to_sun).collect();
    let bounced: Vec<Option<Bounce>> =
        bounces.iter().zip(bounce_hits).map(|(ray, hit)| lit.bounce(context, ray, hit, &mut shadow_rays)).collect();
    let mut blocked = vec![false; shadow_rays.len()];
    context.are_blocked(&shadow_rays, &mut blocked);
    let (key_blocked, bounces_blocked) = blocked.split_at(suns.len());
    let mut bounces_blocked = bounces_blocked.iter();
    let mut sums = Sums::default();
    for ((index, point), bounced) in points.iter().enumerate().zip(bounced.chunks(RAYS as usize)) {
        let open = lit.lights.sky(point.orientation.smooth);
        let arriving = bounced.iter().map(|bounce| match bounce {
            None => open,
            Some(Bounce { light, sun: Some(sun) }) if bounces_blocked.next() == Some(&false) => {
                bounced_light(*light + *sun, open)
            }
            Some(Bounce { light, .. }) => bounced_light(*light, open),
        });
        let ambient = arriving.sum::<Vec3>() / RAYS as f32;
        let is_lit = key_blocked.get(index) != Some(&true);
        sums = sums.plus(point.sums(context.scene, ambient, open, is_lit));
    }
    sums
}

impl MeterPoint {
    /// The sums of this point alone, where the key light arrives if it `is_lit`; zeros where its light is not finite.
    fn sums(&self, scene: &Scene, ambient: Vec3, open: Vec3, is_lit: bool) -> Sums {
        let light = if is_lit { ambient + self.key_light } else { ambient };
        // Luminance of linear sRGB (ITU-R BT.709).
        let luminance = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let color = surface::base_color(scene, scene.material(self.hit.primitive_index), &self.hit);
        let luminance = luminance(light) * (luminance(color) / PALE).sqrt().clamp(MAX_DARKENING, 1.0);
        if !luminance.is_finite() {
            return Sums::default();
        }
        Sums { points: 1.0, log_light: luminance.max(DARKEST).log2(), ambient, open }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_large_differences_are_corrected_and_within_limits() {
        let auto = |light| stops(light, Exposure::Auto);
        for light in [REFERENCE, REFERENCE * 2.0, REFERENCE / 1.4] {
            assert_eq!(auto(light), 0.0, "{light}");
        }
        assert!((auto(REFERENCE / 8.0) - 3.0).abs() < 1e-5, "three stops too dark");
        assert!((auto(REFERENCE * 8.0) + 3.0).abs() < 1e-5, "three stops too bright");
        assert_eq!((auto(1e-9), auto(1e9)), (4.0, -4.0));
        let steps: Vec<f32> = (0..400).map(|step| auto(REFERENCE * (step as f32 * 0.01 - 2.0).exp2())).collect();
        assert!(steps.windows(2).all(|pair| pair[0] >= pair[1] && pair[0] - pair[1] < 0.05), "no jumps");
        assert_eq!(stops(0.01, Exposure::Fixed(-1.5)), -1.5);
    }
}
