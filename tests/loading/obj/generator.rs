//! Valid OBJ files of every form that the OBJ reader and the crate tobj understand alike, made from random numbers. Shared by
//! the differential test and fuzzing.

#![allow(dead_code, reason = "a fuzz target uses a part")]

use std::fmt::Write as _;

/// Number of materials in [`LIBRARY`].
pub const MATERIALS: usize = 3;

/// The library that each file names as `a.mtl`: material `m0` is red 0, `m1` red 0.25, `m2` red 0.5.
pub const LIBRARY: &str = "newmtl m0\nKd 0 1 1\nnewmtl m1\nKd 0.25 1 1\nnewmtl m2\nKd 0.5 1 1\n";

/// Whether every position has a colour, and which attributes faces may have.
struct Form {
    colored: bool,
    texcoords: usize,
    normals: usize,
}

/// A valid file with at least one triangle. `below(n)` gives a number below `n`.
pub fn valid_obj(below: &mut dyn FnMut(usize) -> usize) -> String {
    let form = Form { colored: below(3) == 0, texcoords: below(2) * 6, normals: below(2) * 4 };
    let mut text = String::from("# made\nmtllib a.mtl\n");
    let mut counts = [0; 3];
    for _ in 0..1 + below(3) {
        if below(2) == 0 {
            writeln!(text, "{} part {}", ["o", "g"][below(2)], below(9)).unwrap();
        }
        write_vertices(&mut text, &form, &mut counts, below);
        for _ in 0..1 + below(6) {
            match below(6) {
                0 => writeln!(text, "usemtl m{}", below(MATERIALS)).unwrap(),
                1 => writeln!(text, "s {}", ["off", "1"][below(2)]).unwrap(),
                2 => text.push_str("\n  # a comment\n"),
                _ => {}
            }
            write_face(&mut text, &form, &mut counts, below);
        }
    }
    text
}

fn number(below: &mut dyn FnMut(usize) -> usize) -> String {
    let value = below(2001) as f32 / 8.0 - 125.0;
    match below(4) {
        0 => format!("{value:e}"),
        1 => format!("{value:.3}"),
        _ => format!("{value}"),
    }
}

fn write_vertices(text: &mut String, form: &Form, counts: &mut [usize; 3], below: &mut dyn FnMut(usize) -> usize) {
    for _ in 0..3 + below(5) {
        let separator = [" ", "  ", "\t"][below(3)];
        let [x, y, z] = [number(below), number(below), number(below)];
        write!(text, "v {x}{separator}{y} {z}").unwrap();
        if form.colored {
            write!(text, " {} {} {}", below(9) as f32 / 8.0, below(9) as f32 / 8.0, below(9) as f32 / 8.0).unwrap();
        }
        text.push_str(["\n", "\r\n", " \n"][below(3)]);
        counts[0] += 1;
    }
    for _ in 0..form.texcoords {
        writeln!(text, "vt {} {}", number(below), number(below)).unwrap();
        counts[1] += 1;
    }
    for _ in 0..form.normals {
        writeln!(text, "vn {} {} 1", number(below), number(below)).unwrap();
        counts[2] += 1;
    }
}

fn write_face(text: &mut String, form: &Form, counts: &mut [usize; 3], below: &mut dyn FnMut(usize) -> usize) {
    let with = [true, form.texcoords > 0, form.normals > 0];
    let corners = [3, 3, 4, 5, 9][below(5)];
    if corners > 3 {
        // A convex polygon of its own vertices, which are the last: a fan from any corner.
        for k in 0..corners {
            let (sin, cos) = (k as f32 / corners as f32 * std::f32::consts::TAU).sin_cos();
            let color = if form.colored { " 1 0.5 0.25" } else { "" };
            writeln!(text, "v {cos} {sin} {}{color}", cos + sin).unwrap();
        }
        counts[0] += corners;
    }
    text.push('f');
    for corner in 0..corners {
        for (kind, count) in counts.iter().copied().enumerate() {
            if kind > 0 && (with[kind] || with[2] && kind == 1) {
                text.push('/');
            }
            if with[kind] {
                // From the start or from the end.
                let index = if kind == 0 && corners > 3 { count - corners + corner } else { below(count) };
                let index = if below(3) == 0 { index as i64 - count as i64 } else { index as i64 + 1 };
                let space = if kind == 0 { " " } else { "" };
                write!(text, "{space}{index}").unwrap();
            }
        }
    }
    text.push('\n');
}
