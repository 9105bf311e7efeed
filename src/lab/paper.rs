//! Published results of the paper (Mahmuda, Yuniarti, Nurul K.), tables 1 and 2. Each pair is box, sphere.

/// The paper's results for one scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperScene {
    /// Name of the scene in the paper.
    pub name: &'static str,
    /// Build time in milliseconds.
    pub build_ms: [f64; 2],
    /// Trace time in milliseconds.
    pub trace_ms: [f64; 2],
    /// Container and primitive tests per ray.
    pub tests_per_ray: [f64; 2],
}

/// The paper's mean ratios of box to sphere: build time, trace time, tests per ray.
pub const MEAN_RATIOS: [f64; 3] = [0.77, 0.14, 0.35];

/// The paper's six scenes, in its order.
pub const SCENES: [PaperScene; 6] = [
    scene("teapot", [92.0, 126.0], [626.0, 3985.0], [19.0, 49.0]),
    scene("sponza", [815.0, 1083.0], [3373.0, 32462.0], [119.0, 430.0]),
    scene("car", [1839.0, 2348.0], [1526.0, 11418.0], [42.0, 114.0]),
    scene("conference", [2904.0, 3634.0], [2915.0, 51966.0], [114.0, 706.0]),
    scene("buddha", [4425.0, 5774.0], [497.0, 2339.0], [15.0, 34.0]),
    scene("dragon", [7807.0, 9824.0], [5042.0, 30999.0], [101.0, 228.0]),
];

const fn scene(name: &'static str, build_ms: [f64; 2], trace_ms: [f64; 2], tests_per_ray: [f64; 2]) -> PaperScene {
    PaperScene { name, build_ms, trace_ms, tests_per_ray }
}

/// The paper's results for a model whose file or folder name contains the name of one of its scenes. The model shows the same
/// object but is not the same file: triangle counts and cameras differ.
pub fn scene_of(model: &str) -> Option<&'static PaperScene> {
    // "builtin:teapot:4" is the teapot too.
    if let Some(rest) = model.strip_prefix("builtin:") {
        return SCENES.iter().find(|scene| rest.split(':').next() == Some(scene.name));
    }
    let mut parts = model.rsplit(['/', '\\']).map(str::to_lowercase);
    let (file, folder) = (parts.next()?, parts.next().unwrap_or_default());
    SCENES.iter().find(|scene| {
        // Only whole words match: "scar.obj" is not the car.
        let words = |text: &str| text.split(|c: char| !c.is_alphanumeric()).any(|word| word == scene.name);
        words(&file) || words(&folder)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_recognised_by_file_or_folder() {
        for (model, name) in [
            ("models/teapot/teapot.obj", "teapot"),
            ("builtin:teapot", "teapot"),
            ("builtin:teapot:4", "teapot"),
            ("sponza-crytek/sponza.obj", "sponza"),
            ("car/pontiac-gto67.glb", "car"),
            ("Buddha.obj", "buddha"),
        ] {
            assert_eq!(scene_of(model).map(|scene| scene.name), Some(name), "{model}");
        }
        assert_eq!(scene_of("bunny/bunny.obj"), None);
        assert_eq!(scene_of("builtin:terrain"), None);
    }

    #[test]
    fn the_papers_means_follow_from_its_rows() {
        let mean = |pairs: fn(&PaperScene) -> [f64; 2]| {
            SCENES.iter().map(|scene| pairs(scene)[0] / pairs(scene)[1]).sum::<f64>() / SCENES.len() as f64
        };
        for (mean, printed) in
            [mean(|s| s.build_ms), mean(|s| s.trace_ms), mean(|s| s.tests_per_ray)].into_iter().zip(MEAN_RATIOS)
        {
            assert!((mean - printed).abs() < 0.01, "{mean} against {printed}");
        }
    }
}
