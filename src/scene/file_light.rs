//! Lights that a file has.

use glam::{DMat4, DVec3, Vec3};

use crate::vectors::{direction, length};
use bvhscope_engine::geometry::Aabb;

/// Light of all lights together at the centre of the scene, in the unit of the renderer: about that of its sun. Files measure in
/// lux and candela, and few mean it.
const LIGHT_AT_CENTER: f32 = 1.2;

/// A light of a file: a point, a cone or, without a position, a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct FileLight {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Linear RGB light that arrives at a surface that faces it, at the distance `reach`.
    pub color: Vec3,
    /// Unit direction in which it shines; that of the axis of a cone.
    pub direction: Vec3,
    /// Its position; `None` for light from far away.
    pub position: Option<Vec3>,
    /// Cosines of the angles between the axis and where a cone begins to fade, and where it ends.
    pub cone: Option<[f32; 2]>,
    /// Distance beyond which there is no light; may be infinite.
    pub range: f32,
    /// The distance at which `color` arrives; 0 for light from far away.
    pub reach: f32,
}

impl FileLight {
    /// Unit direction from `point` to the light, its distance, and the light that arrives at a surface there that faces it.
    pub fn at(&self, point: Vec3) -> (Vec3, f32, Vec3) {
        let Some(position) = self.position else { return (-self.direction, f32::INFINITY, self.color) };
        let distance = length(position - point);
        let Some(towards) = direction(position - point) else { return (-self.direction, 0.0, Vec3::ZERO) };
        // KHR_lights_punctual: inverse square law, a window at the range, and a smooth edge of the cone.
        let share = self.reach / distance;
        let window = (1.0 - (distance / self.range).powi(4)).clamp(0.0, 1.0);
        let edge = self.cone.map_or(1.0, |[inner, outer]| {
            ((self.direction.dot(-towards) - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0)
        });
        (towards, distance, self.color * (share * share * window * edge * edge))
    }
}

/// A light in the coordinates of its file, where a node carries it: it shines along -z.
pub(super) struct Lamp {
    pub(super) name: String,
    /// Linear RGB, in lux or candela.
    pub(super) color: DVec3,
    pub(super) world: DMat4,
    /// Light from far away.
    pub(super) is_directional: bool,
    /// Angles in radians between the axis of a cone and where it begins to fade, and where it ends.
    pub(super) cone: Option<[f64; 2]>,
    pub(super) range: Option<f64>,
}

/// The lights for a scene in `bounds` less `offset`; those without a direction, place or light are left out.
pub(super) fn placed(lamps: Vec<Lamp>, bounds: &Aabb, offset: DVec3) -> Vec<FileLight> {
    let reach = (length(bounds.extent()) * 0.5).max(f32::MIN_POSITIVE);
    let light = |lamp: Lamp| {
        let direction = lamp.world.transform_vector3(DVec3::NEG_Z).try_normalize()?.as_vec3();
        let position = (lamp.world.transform_point3(DVec3::ZERO) - offset).as_vec3();
        let square = if lamp.is_directional { 1.0 } else { f64::from(reach) * f64::from(reach) };
        let color = (lamp.color / square).max(DVec3::ZERO);
        let is_usable = position.is_finite() && color.is_finite() && color.max_element() > 0.0;
        is_usable.then(|| {
            let light = FileLight {
                name: lamp.name,
                color: Vec3::ZERO,
                direction,
                position: (!lamp.is_directional).then_some(position),
                cone: lamp.cone.map(|cone| cone.map(|angle| angle.cos() as f32)),
                range: lamp.range.map_or(f32::INFINITY, |range| range as f32),
                reach: if lamp.is_directional { 0.0 } else { reach },
            };
            (light, color)
        })
    };
    let lights: Vec<(FileLight, DVec3)> = lamps.into_iter().filter_map(light).collect();
    // Lights near the centre count as if they stood at a third of the way to the edge.
    let share = |light: &FileLight| match light.position {
        Some(position) => f64::from((reach / length(position - bounds.center())).min(3.0)).powi(2),
        None => 1.0,
    };
    let total: f64 = lights.iter().map(|(light, color)| color.max_element() * share(light)).sum();
    let scale = f64::from(LIGHT_AT_CENTER) / total;
    lights.into_iter().map(|(light, color)| FileLight { color: (color * scale).as_vec3(), ..light }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(at: DVec3) -> Lamp {
        let (name, world) = (String::new(), DMat4::from_translation(at));
        Lamp { name, color: DVec3::splat(800.0), world, is_directional: false, cone: None, range: None }
    }

    #[test]
    fn light_falls_off_by_distance_cone_and_range_at_any_size() {
        for size in [1e-30, 1e-3, 1.0, 1e9, 1e17_f32] {
            let bounds = Aabb { min: Vec3::splat(-size), max: Vec3::splat(size) };
            let at = DVec3::Z * f64::from(size) * 4.0;
            let lights = |lamp: Lamp| placed(vec![lamp], &bounds, DVec3::ZERO);
            let of = |light: &FileLight, point: Vec3| light.at(point * size).2.x;
            let point = &lights(lamp(at))[0];
            assert!((of(point, Vec3::ZERO) - LIGHT_AT_CENTER).abs() < 1e-4, "{size}: {}", of(point, Vec3::ZERO));
            assert!((of(point, Vec3::NEG_Z * 4.0) * 4.0 - LIGHT_AT_CENTER).abs() < 1e-4);
            let (towards, distance, _) = point.at(Vec3::ZERO);
            assert!((towards - Vec3::Z).length() < 1e-6 && (distance / size - 4.0).abs() < 1e-5);
            let spot = &lights(Lamp { cone: Some([0.1, 0.3]), ..lamp(at) })[0];
            assert!(of(spot, Vec3::ZERO) > 1.0 && of(spot, Vec3::X * 2.0) == 0.0);
            assert!((0.01..1.0).contains(&of(spot, Vec3::X * 0.9)), "{}", of(spot, Vec3::X * 0.9));
            let short = &lights(Lamp { range: Some(f64::from(size) * 5.0), ..lamp(at) })[0];
            assert!(of(short, Vec3::Z) > 0.0 && of(short, Vec3::NEG_Z * 2.0) == 0.0);
            let sun = &lights(Lamp { is_directional: true, ..lamp(at) })[0];
            assert_eq!((sun.at(Vec3::ONE * size).0, sun.at(Vec3::ONE * size).1), (Vec3::Z, f32::INFINITY));
        }
        let bounds = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
        for lost in [
            Lamp { color: DVec3::ZERO, ..lamp(DVec3::Z) },
            Lamp { world: DMat4::ZERO, ..lamp(DVec3::Z) },
            lamp(DVec3::splat(f64::INFINITY)),
        ] {
            assert_eq!(placed(vec![lost], &bounds, DVec3::ZERO), []);
        }
    }
}
