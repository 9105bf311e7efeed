//! Shared by the tests of tree files from other programs: tools that a machine may lack, and a tree against a test of every
//! triangle.

use std::path::{Path, PathBuf};
use std::process::Command;

use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::geometry::{PreparedRay, Shear};
use bvhscope_engine::tree::traverse::{NoProbe, Traversal, closest_hit};
use bvhscope_engine::tree_file::{TreeFile, write_corners};
use bvhscope_engine::{CancelToken, Ray, Triangle, with_tree};
use glam::Vec3;

use crate::support::{Lack, skip};

/// A path in the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The triangles of a built-in scene.
pub fn triangles_of(model: &str) -> Vec<Triangle> {
    let source = SceneSource::parse(model.as_ref()).unwrap();
    load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap().triangles
}

/// Writes triangles as `bvhscope info --triangles` does.
pub fn write_triangles(triangles: &[Triangle], path: &Path) {
    let mut bytes = Vec::new();
    write_corners(triangles, &mut bytes, &CancelToken::new()).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// Runs a program to its end and returns what it prints; fails where the program does. `None` where it is not installed, which
/// is recorded as a skip.
pub fn run_tool(command: &mut Command) -> Option<String> {
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            skip(Lack::Tools, format_args!("{}: {error}", command.get_program().display()));
            return None;
        }
    };
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}: {}{}", text(&output.stdout), text(&output.stderr));
    Some(text(&output.stdout))
}

/// Compiles a program of one file, which finds `assets/bvhscope_tree.h`, with warnings as errors; `None` without the compiler.
pub fn compiled(compiler: &str, flags: &[&str], source: &Path, program: &Path, libraries: &[&str]) -> Option<()> {
    let mut command = Command::new(compiler);
    command.args(flags).args(["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror", "-I"]);
    command.arg(repository("assets")).arg(source).args(libraries).arg("-o").arg(program);
    run_tool(&mut command).map(drop)
}

/// Reads a tree file and fails where it has faults, or where any of many rays finds another hit than a test of every triangle.
pub fn checked(path: &Path, triangles: &[Triangle]) -> TreeFile {
    let file = read(path, triangles);
    assert!(file.faults.is_empty(), "{}: {:?}", path.display(), file.faults);
    file
}

/// The same, with faults allowed.
pub fn read(path: &Path, triangles: &[Triangle]) -> TreeFile {
    let token = CancelToken::new();
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file = TreeFile::read(&bytes, Some(triangles), u64::MAX, &token);
    let file = file.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let leaf_triangles = file.tree.leaf_triangles(triangles, &token).unwrap();
    let mut hits = 0;
    for ray in rays(triangles) {
        let expected = scan(triangles, &ray);
        let found = with_tree!(&file.tree, tree => {
            closest_hit(tree, &leaf_triangles[..], &ray, Traversal::Ordered, &mut NoProbe)
        });
        assert_eq!(found.map_or(f32::INFINITY, |hit| hit.t), expected, "{}: {ray:?}", path.display());
        hits += usize::from(expected < f32::INFINITY);
    }
    assert!(hits > RAYS / 10, "{}: only {hits} of {RAYS} rays hit anything", path.display());
    file
}

const RAYS: usize = 400;

/// Rays from all around the triangles to points near them.
pub fn rays(triangles: &[Triangle]) -> impl Iterator<Item = Ray> {
    let corners = || triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
    let low = corners().fold(Vec3::INFINITY, Vec3::min);
    let size = corners().fold(Vec3::NEG_INFINITY, Vec3::max) - low;
    (0..RAYS).map(move |index| {
        // Additive recurrence: irrational steps, the same in every run.
        let share = |step: f64| ((index as f64 + 0.5) * step).fract() as f32;
        let origin = Vec3::new(share(0.754_877), share(0.569_840), share(0.324_717)) * 3.0 - 1.0;
        let target = Vec3::new(share(0.819_172), share(0.671_043), share(0.549_700));
        Ray::new(low + origin * size, ((target - origin) * size).normalize())
    })
}

/// The distance of the nearest hit by a test of every triangle.
fn scan(triangles: &[Triangle], ray: &Ray) -> f32 {
    let (ray, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
    let hits = triangles.iter().filter_map(|triangle| triangle.intersect(&ray, &shear, ray.ray.t_max));
    hits.map(|hit| hit.t).fold(f32::INFINITY, f32::min)
}
