//! The WGSL source of each drawable. Ids shared by Rust and WGSL are defined by the Rust types and prepended here as WGSL
//! constants.

use std::fmt::Write;

use crate::overlay::level;
use crate::overlay::node::Role;
use crate::overlay::ramp::RAMP_STOPS;

const COMMON: &str = include_str!("../../shaders/common.wgsl");
const PICTURE: &str = include_str!("../../shaders/picture.wgsl");
const LINE: &str = include_str!("../../shaders/line.wgsl");
const BOX: &str = include_str!("../../shaders/box.wgsl");
const SPHERE: &str = include_str!("../../shaders/sphere.wgsl");
const CIRCLE: &str = include_str!("../../shaders/circle.wgsl");
const FACE: &str = include_str!("../../shaders/face.wgsl");
const BOX_FACE: &str = include_str!("../../shaders/box_face.wgsl");
const SPHERE_FACE: &str = include_str!("../../shaders/sphere_face.wgsl");
const DOP: &str = include_str!("../../shaders/dop.wgsl");
const DOP_LINE: &str = include_str!("../../shaders/dop_line.wgsl");
const DOP_FACE: &str = include_str!("../../shaders/dop_face.wgsl");
const ORIENTED: &str = include_str!("../../shaders/oriented.wgsl");
const ORIENTED_FACE: &str = include_str!("../../shaders/oriented_face.wgsl");
const POLYGON_FACE: &str = include_str!("../../shaders/polygon_face.wgsl");
const DOT: &str = include_str!("../../shaders/dot.wgsl");

/// The complete WGSL of picture, boxes, spheres, polytopes, oriented boxes, dots, the faces of all four, and pieces of any faces.
pub fn sources() -> [String; 11] {
    let constants = constants();
    let files = [
        &[PICTURE][..],
        &[LINE, BOX],
        &[LINE, CIRCLE, SPHERE],
        &[LINE, DOP, DOP_LINE],
        &[LINE, ORIENTED],
        &[LINE, DOT],
        &[LINE, FACE, BOX_FACE],
        &[LINE, CIRCLE, FACE, SPHERE_FACE],
        &[LINE, DOP, FACE, DOP_FACE],
        &[LINE, FACE, ORIENTED_FACE],
        &[LINE, FACE, POLYGON_FACE],
    ];
    files.map(|files| format!("{constants}{COMMON}{}", files.concat()))
}

/// WGSL constants of roles, levels and the ramp.
fn constants() -> String {
    let mut text = format!("const RAMP_STOPS: u32 = {RAMP_STOPS}u;\n");
    let mut define = |name: &str, kind: &str, value: &str| {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "const {name}: {kind} = {value};");
    };
    for (name, value) in [
        ("WIDEST_LEVEL", level::WIDEST),
        ("NARROWEST_LEVEL", level::NARROWEST),
        ("LIGHTEST_LEVEL", level::LIGHTEST),
        ("DARKEST_LEVEL", level::DARKEST),
        ("HIDDEN_SILHOUETTE", level::HIDDEN_SILHOUETTE),
    ] {
        define(name, "f32", &format!("{value:?}"));
    }
    define("ROLE_SHIFT", "u32", &format!("{}u", Role::SHIFT));
    define("ROLE_MASK", "u32", &format!("{}u", Role::MASK));
    for role in Role::ALL {
        let name = role.shader_name();
        define(&format!("ROLE_{name}"), "u32", &format!("{}u", role as u32));
        define(&format!("{name}_WIDTH"), "f32", &format!("{:?}", role.width()));
        if let Some(color) = role.color() {
            let [r, g, b] = color.map(|channel| f32::from(channel) / 255.0);
            define(&format!("{name}_COLOR"), "vec3f", &format!("vec3f({r:.3}, {g:.3}, {b:.3})"));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_the_colors_of_the_legend() {
        for role in Role::ALL.into_iter().filter(|role| role.color().is_some()) {
            let name = role.shader_name();
            let case = format!("case ROLE_{name}: {{ return vec4f({name}_COLOR, ");
            assert!(LINE.contains(&case), "'{case}' is not in the shader");
        }
        assert!(constants().contains("const SELECTED_COLOR: vec3f = vec3f(1.000, 0.706, 0.329);"));
    }
}
