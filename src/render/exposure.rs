//! The exposure meter: how much light arrives at the surfaces in view, from a grid of points that does not depend on the
//! picture's resolution, so that all passes of a view agree and a moving camera changes it smoothly.

use glam::Vec3;
use rayon::prelude::*;

use super::lit::{Bounce, Lit, bounced_light};
use super::request::RenderRequest;
use super::sampling::SampleId;
use super::settings::Exposure;
use super::surface;
use super::trace_context::TraceContext;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::tree::Container;

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

/// What the meter measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Metered {
    /// Exposure in stops.
    pub(super) stops: f32,
    /// Light of the sky that arrives at the surfaces in view as a fraction of an open sky.
    pub(super) openness: Vec3,
}

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
pub(super) fn meter<C: Container>(
    context: &TraceContext<C>,
    lit: &Lit,
    request: &RenderRequest,
    token: &CancelToken,
) -> Result<Metered, Cancelled> {
    // Rows are added in their order, so that the sum is the same on any number of threads.
    let rows: Vec<Sums> = (0..GRID[1])
        .into_par_iter()
        .map(|row| {
            token.check()?;
            Ok((0..GRID[0]).fold(Sums::default(), |sums, column| {
                sums.plus(meter_point(context, lit, request, [column, row]).unwrap_or_default())
            }))
        })
        .collect::<Result<_, Cancelled>>()?;
    let sums = rows.into_iter().fold(Sums::default(), Sums::plus);
    if sums.points == 0.0 {
        return Ok(Metered { stops: 0.0, openness: Vec3::ONE });
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

/// Light at the surface behind one point of the grid; `None` on the background and on surfaces that take no light.
fn meter_point<C: Container>(
    context: &TraceContext<C>,
    lit: &Lit,
    request: &RenderRequest,
    [column, row]: [u32; 2],
) -> Option<Sums> {
    let at = |index: u32, count: u32, size: u32| (index as f32 + 0.5) / count as f32 * size.max(1) as f32;
    let ray = context.camera.ray(at(column, GRID[0], request.width_px), at(row, GRID[1], request.height_px));
    let hit = context.closest(&ray).filter(|hit| !context.scene.material(hit.primitive_index).unlit)?;
    let orientation = context.orientation(&ray, &hit);
    let position = surface::position(context.scene, &hit);
    let open = lit.lights.sky(orientation.smooth);
    let mut shadow_rays = Vec::new();
    let mut ambient = Vec3::ZERO;
    for sample in 0..RAYS {
        let id = SampleId { x: column, y: row, sample };
        ambient += match lit.trace_ambient(context, position, &orientation, id, &mut shadow_rays) {
            None => open,
            Some(Bounce { light, sun }) => {
                let is_lit = shadow_rays.pop().is_some_and(|ray| !context.is_blocked(&ray));
                bounced_light(light + sun.filter(|_| is_lit).unwrap_or_default(), open)
            }
        };
    }
    ambient /= RAYS as f32;
    let (towards_key, key) = lit.lights.key(-ray.direction);
    let facing = orientation.smooth.dot(towards_key).max(0.0);
    let reaches = facing > 0.0
        && (lit.lights.sun().is_none()
            || !context.is_blocked(&context.ray_from(
                orientation.lifted,
                orientation.geometric,
                towards_key,
                f32::INFINITY,
            )));
    let light = if reaches { ambient + key * facing } else { ambient };
    // Luminance of linear sRGB (ITU-R BT.709).
    let luminance = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let color = surface::base_color(context.scene, context.scene.material(hit.primitive_index), &hit);
    let luminance = luminance(light) * (luminance(color) / PALE).sqrt().clamp(MAX_DARKENING, 1.0);
    if !luminance.is_finite() {
        return None;
    }
    Some(Sums { points: 1.0, log_light: luminance.max(DARKEST).log2(), ambient, open })
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
