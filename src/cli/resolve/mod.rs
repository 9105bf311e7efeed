//! Converts parsed flags into the settings that the rest of the program uses.

mod measure;
mod parts;

use std::path::PathBuf;

use parts::{follow, moment, overlay, picture};

#[cfg(feature = "gui")]
use super::args::ViewerArgs;
use super::args::{BuildArgs, CopiesArgs, InfoArgs, LayoutsArgs, MergesArgs, RayArgs, RaysArgs, RenderArgs, TreeArgs};
#[cfg(feature = "gui")]
use crate::app::{Overrides, SettingsUse, StartOptions};
use crate::catalog::settings::Given;
#[cfg(feature = "gui")]
use crate::console::note;
use crate::headless::Output;
use crate::headless::copies::{CopiesCommand, MeasuredCopies};
use crate::headless::info::InfoCommand;
use crate::headless::layouts::LayoutsCommand;
use crate::headless::ray::{ChosenStart, RayCommand};
use crate::headless::rays::{ChosenRays, RaysCommand, Sample};
use crate::headless::tree::TreeCommand;
use crate::headless::{Failure, MergesCommand, MomentChoice, RenderCommand, TreeOrigin};
use crate::lab::layouts::LayoutPlan;
use crate::lab::ray::RayMethod;
use crate::overlay::{OverlaySettings, Selection};
use crate::render::RenderSettings;
use crate::scene::SceneSource;
#[cfg(feature = "gui")]
use crate::text::quoted;
#[cfg(feature = "gui")]
use crate::view::CameraChoice;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::ContainerKind;

pub use measure::{animate, diff, measure, setups, sweep};
pub use parts::{camera, invalid_passes, invalid_passes_of_file, load, threads};

#[cfg(feature = "gui")]
pub fn viewer(args: ViewerArgs) -> StartOptions {
    let camera = camera(&args.camera);
    StartOptions {
        source: args.model,
        tree_file: args.tree.tree.map(|path| std::path::absolute(&path).unwrap_or(path)),
        ray_file: args.rays.map(|path| std::path::absolute(&path).unwrap_or(path)),
        shared: args.state.map(|state| *state),
        overrides: Overrides {
            build: args.build.settings.0,
            threads: args.build.threads,
            render: args.picture.0,
            overlay: args.overlay.0,
        },
        camera: (camera != CameraChoice::default()).then_some(camera),
        load: load(&args.load),
        lessons: args.lessons,
        settings: SettingsUse { none: args.no_config, reset: args.reset_settings },
        restore: args.restore,
        lose_device: args.lose_device,
        refuse_buffer: args.refuse_buffer,
        ..StartOptions::default()
    }
}

/// Fails where the named bookmark does not exist.
#[cfg_attr(not(feature = "gui"), expect(clippy::unnecessary_wraps, reason = "bookmarks are kept by the window"))]
pub fn render(args: RenderArgs) -> Result<RenderCommand, Failure> {
    let source = args.model.unwrap_or_else(SceneSource::default_builtin);
    let camera = camera(&args.camera);
    #[cfg(feature = "gui")]
    let camera = match &args.bookmark {
        Some(name) => bookmark(name, &source)?,
        None => camera,
    };
    Ok(RenderCommand {
        source,
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        camera,
        settings: picture(&args.picture, &args.around),
        overlay: overlay(&args.overlay),
        section: args.section,
        hide_triangles: !args.nodes.keep_triangles,
        selection: Selection {
            selected: args.nodes.select,
            hidden: args.nodes.hide.into_iter().collect(),
            isolated: args.nodes.isolate,
            ..Selection::default()
        },
        geometry: !args.nodes.no_geometry,
        size: args.size,
        output: args.output,
        depth_image: args.depth_image,
        legend: args.around.legend,
        json: args.json,
        moments: match args.motion.frames {
            frames @ Some(_) => MomentChoice { times: frames, clip: args.motion.moment.clip },
            None => moment(args.motion.moment),
        },
        follow: follow(&args.follow),
        layout: args.layout,
    })
}

/// The camera of a bookmark; reports where it was kept for another model.
#[cfg(feature = "gui")]
fn bookmark(name: &str, source: &SceneSource) -> Result<CameraChoice, Failure> {
    let found = crate::app::saved_bookmark(name, source).map_err(|known| {
        let known = match &known[..] {
            [] => "none is kept for this model: Ctrl+D in its window keeps one".to_owned(),
            names => format!("kept for this model are {}", names.join(", ")),
        };
        Failure::Failed(format!("there is no bookmark {}; {known}", quoted(name)))
    })?;
    if found.source != source.absolute() {
        note(format_args!("bvhscope: warning: {} was kept for {}", found.name, found.source));
    }
    Ok(CameraChoice::of_scene(found.camera))
}

pub fn merges(args: MergesArgs) -> MergesCommand {
    MergesCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        build: args.build.settings.0.settings(),
        camera: camera(&args.camera),
        settings: picture(&args.picture, &args.around),
        overlay: OverlaySettings { budget: Some(args.at_most), ..OverlaySettings::default() },
        order: args.order,
        frames: args.frames,
        rate: args.rate,
        legend: args.around.legend,
        size: args.size,
        output: args.output,
    }
}

pub fn info(args: InfoArgs) -> InfoCommand {
    InfoCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        triangles: args.triangles,
        rays: args.rays.unwrap_or_default(),
        epo_samples: args.epo_samples,
        camera: camera(&args.camera),
        moments: moment(args.motion.moment),
        follow: follow(&args.motion.follow),
        json: args.json,
    }
}

pub fn layouts(args: LayoutsArgs) -> LayoutsCommand {
    LayoutsCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        plan: LayoutPlan {
            children: args.children.0,
            collapses: args.collapse.0,
            planes: args.planes.0,
            leaf_sizes: args.leaves.0,
        },
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        moments: moment(args.moment),
        camera: camera(&args.camera),
        size: args.costs.size,
        settings: RenderSettings { simd: args.simd.unwrap_or_default(), ..RenderSettings::default() },
        rays: args.costs.rays,
        output: Output { json: args.costs.json, format: args.costs.format, csv: args.costs.csv, plot: args.plot },
    }
}

pub fn copies(args: CopiesArgs) -> CopiesCommand {
    CopiesCommand {
        source: args.model.unwrap_or_else(|| SceneSource::Builtin { name: "forest".to_owned(), size: None }),
        most: args.most,
        measured: match args.open {
            Some(open) => MeasuredCopies::Forms(open.0),
            None if args.advice => MeasuredCopies::Advice,
            None => MeasuredCopies::Costs,
        },
        build: args.build.settings.0.settings(),
        camera: camera(&args.camera),
        size: args.costs.size,
        settings: RenderSettings { simd: args.simd.unwrap_or_default(), ..RenderSettings::default() },
        rays: args.costs.rays,
        output: Output { json: args.costs.json, format: args.costs.format, csv: args.costs.csv, plot: args.plot },
    }
}

pub fn tree(args: TreeArgs) -> TreeCommand {
    TreeCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        wide: args.wide,
        with_triangles: args.with_triangles,
        moments: moment(args.motion.moment),
        follow: follow(&args.motion.follow),
        output: args.output,
    }
}

/// Where the tree comes from: the file that is named, else settings if any is given, else the model's own file if it holds one.
fn tree_origin(build: &BuildArgs, file: Option<PathBuf>) -> TreeOrigin {
    match file {
        Some(path) => TreeOrigin::File(path),
        None if build.settings.0.is_empty() || only_orients(&build.settings.0) => TreeOrigin::OfModel,
        None => TreeOrigin::Built,
    }
}

/// True if all that is asked for is oriented boxes, which the tree of a file can have too.
fn only_orients(given: &Given) -> bool {
    given.settings() == BuildSettings::default().for_container(ContainerKind::Oriented)
}

/// Fails where the picture has no such pixel.
pub fn ray(args: RayArgs) -> Result<RayCommand, Failure> {
    let start = match (args.rays, args.pixel, args.origin, args.direction) {
        (Some(path), ..) => ChosenStart::OfFile(path, args.number),
        (_, Some([x, y]), ..) if x >= args.size[0] || y >= args.size[1] => {
            let [width, height] = args.size;
            let last = format!("{},{}", width - 1, height - 1);
            return Err(Failure::Usage(format!(
                "--pixel {x},{y}: the picture has {width}x{height} pixels, 0,0 to {last}; --size gives it more"
            )));
        }
        (_, Some(pixel), ..) => ChosenStart::Pixel(pixel),
        (.., Some(origin), Some(direction)) => ChosenStart::Given(origin, direction),
        _ => return Err(Failure::Usage("--pixel, --rays, or --origin and --direction say which ray".to_owned())),
    };
    let base = RenderSettings::default();
    Ok(RayCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        camera: camera(&args.camera),
        size: args.size,
        settings: RenderSettings { light: args.light.unwrap_or(base.light), ..base },
        section: args.section,
        start,
        kind: args.kind,
        method: if args.wide { RayMethod::Wide } else { RayMethod::Binary(args.traversal) },
        moments: moment(args.motion.moment),
        follow: follow(&args.motion.follow),
        json: args.json,
    })
}

/// Fails where no rays are chosen.
pub fn rays(args: RaysArgs) -> Result<RaysCommand, Failure> {
    let rays = match (args.kind, args.rays) {
        (_, Some(path)) if args.verify => ChosenRays::Checked(path, args.sample.unwrap_or(Sample::Default)),
        (_, Some(path)) => ChosenRays::File(path),
        (Some(population), None) => ChosenRays::Population(population, args.count),
        (None, None) => return Err(Failure::Usage("--kind or --rays says which rays".to_owned())),
    };
    let base = RenderSettings::default();
    Ok(RaysCommand {
        source: args.model.unwrap_or_else(SceneSource::default_builtin),
        build: args.build.settings.0.settings(),
        tree: tree_origin(&args.build, args.tree.tree),
        rays,
        camera: camera(&args.camera),
        size: args.size,
        settings: RenderSettings {
            light: args.light.unwrap_or(base.light),
            simd: args.simd.unwrap_or_default(),
            ..base
        },
        output: args.output,
        json: args.json,
    })
}

#[cfg(all(test, feature = "gui"))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use clap::Parser as _;

    use super::super::args::{Cli, CommandArgs};
    use super::*;
    use crate::app::commands::command_line;
    use crate::app::state::{AppState, Preferences, Wanted};
    use crate::camera::Projection;
    use crate::catalog::metrics::AREA;
    use crate::colors::ColorMap;
    use crate::overlay::{ColorBy, ContainerSet};
    use crate::render::{Background, Exposure, HeatKind, Light, NormalSource, Shading};
    use crate::scene::{Instancing, LoadOptions};
    use crate::section::SectionPlane;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;
    use bvhscope_engine::tree::traverse::Traversal;

    #[test]
    fn the_copied_command_line_reproduces_the_window() {
        let mut wanted = Wanted::new(SceneSource::default_builtin());
        wanted.build =
            BuildSettings { container: ContainerKind::Sphere, threshold: 9, curve: Curve::Hilbert, ..wanted.build };
        wanted.build.optimize = Passes::NONE.with(Pass::Collapse).with(Pass::Reinsert);
        wanted.threads = 2;
        wanted.camera.projection = Projection::Orthographic;
        wanted.camera.eye.x = -1.25e-3;
        wanted.offset = glam::DVec3::new(408_204.0, 4_080_928.0, -0.5);
        wanted.render = RenderSettings {
            shading: Shading::Heat(HeatKind::Primitives),
            light: Light::Headlight,
            exposure: Exposure::Fixed(-1.25),
            normals: NormalSource::Crease,
            background: Background::Light,
            crease_degrees: 25.5,
            traversal: Traversal::Paper,
            heat_range: Some([1.0, 80.5]),
            color_map: ColorMap::Turbo,
            samples: 3,
            ..wanted.render
        };
        wanted.render.mesh_edges = true;
        wanted.render.section = Some(SectionPlane { normal: glam::Vec3::Y, offset: 0.25, flipped: true });
        wanted.render.ground = true;
        wanted.overlay.leaves_only = true;
        wanted.overlay.parents = true;
        wanted.overlay.follows_tree = false;
        wanted.overlay.containers = ContainerKind::OF_PAPER.into_iter().collect();
        wanted.overlay.depth = Some([2, 7]);
        wanted.overlay.color_by = ColorBy::Metric(AREA);
        wanted.overlay.hidden_alpha = 0.4;
        wanted.overlay.line_width = 2.5;
        wanted.overlay.budget = Some(123);
        let mut state = AppState::new(wanted.clone(), Preferences::default());
        state.layout.viewport_px = [800, 500];
        state.selection.nodes.selected = Some(7);
        state.selection.nodes.hidden.extend([3, 8]);
        state.selection.nodes.isolated = Some(2);
        state.preferences.show_geometry = false;
        state.model.load_options =
            LoadOptions { allow_outside: true, scene: Some(1), fps: Some(30.0), instances: Instancing::TwoLevel };
        let line = command_line(&state);
        let cli = Cli::try_parse_from(line.split(' ')).unwrap_or_else(|error| panic!("{line}\n{error}"));
        let Some(CommandArgs::Render(args)) = cli.command else { panic!("{line} does not render") };
        assert_eq!(args.build.threads, Some(2));
        assert_eq!(parts::load(&args.load.any), state.model.load_options);
        let job = render(args).unwrap();
        // Passes for boxes only are dropped for spheres.
        let built = BuildSettings { optimize: Passes::NONE.with(Pass::Collapse), ..wanted.build };
        let bounds = bvhscope_engine::geometry::Aabb { min: glam::Vec3::ZERO, max: glam::Vec3::ONE };
        assert_eq!(job.section.map(|choice| choice.plane(&bounds, wanted.offset)), wanted.render.section);
        let settings = RenderSettings { section: None, ..wanted.render };
        assert_eq!((job.source, job.build, job.settings), (wanted.source, built, settings), "{line}");
        assert_eq!((job.overlay, job.size), (Some(wanted.overlay), [800, 500]), "{line}");
        assert_eq!((job.selection, job.geometry), (state.selection.nodes, false));
        let in_file = |point| Some(crate::scene::to_file(point, wanted.offset));
        assert_eq!((job.camera.eye, job.camera.target), (in_file(wanted.camera.eye), in_file(wanted.camera.target)));
        assert!(job.camera.orthographic && (job.camera.fov_y.unwrap() - wanted.camera.fov_y).abs() < 1e-4);
    }

    /// The state after starting the program with `line`, where the last run ended with `last`.
    fn started(line: &str, last: &Wanted) -> (Wanted, Preferences) {
        let cli = Cli::try_parse_from(line.split(' ')).unwrap();
        let (mut wanted, mut preferences) =
            (last.clone(), Preferences { show_containers: false, show_geometry: false, ..Preferences::default() });
        viewer(cli.viewer).overrides.apply(&mut wanted, &mut preferences);
        (wanted, preferences)
    }

    #[test]
    fn a_flag_overrides_only_its_own_setting_of_the_last_run() {
        let mut last = Wanted::new(SceneSource::default_builtin());
        last.build = BuildSettings { container: ContainerKind::Sphere, threshold: 30, ..last.build };
        last.render = RenderSettings {
            shading: Shading::Normals,
            light: Light::Headlight,
            samples: 4,
            color_map: ColorMap::Turbo,
            ..last.render
        };
        last.overlay.depth = Some([1, 2]);
        last.overlay.containers = ContainerKind::OF_PAPER.into_iter().collect();
        last.overlay.leaves_only = true;
        assert_eq!(started("bvhscope", &last).0, last, "no flag is given");

        // Flags with default values override too.
        let (wanted, preferences) = started("bvhscope --shading lit --samples 16", &last);
        let render = RenderSettings { shading: Shading::Lit, samples: 16, ..last.render };
        assert_eq!(wanted, Wanted { render, ..last.clone() });
        assert!(preferences.show_geometry && !preferences.show_containers, "the requested picture is visible");

        let (wanted, _) = started("bvhscope --light sun --color-map inferno --depth 4..6 --container box", &last);
        assert_eq!((wanted.render.light, wanted.render.color_map), (Light::Sun, ColorMap::Inferno));
        assert_eq!(wanted.render.shading, last.render.shading);
        assert_eq!((wanted.overlay.depth, wanted.overlay.leaves_only), (Some([4, 6]), true));
        assert_eq!(wanted.build, BuildSettings { container: ContainerKind::Aabb, ..last.build });

        let (wanted, preferences) = started("bvhscope --overlay box", &last);
        assert!(preferences.show_containers && wanted.overlay.containers == ContainerSet::of(ContainerKind::Aabb));
        assert_eq!(wanted.overlay.depth, last.overlay.depth);

        let (wanted, _) = started("bvhscope --preset hq --threshold 20", &last);
        let hq = BuildSettings::preset(Preset::Hq, ContainerKind::Sphere);
        assert_eq!(wanted.build, BuildSettings { threshold: 20, ..hq });
    }

    #[test]
    fn flags_override_incompatible_settings_of_the_last_run() {
        let mut last = Wanted::new(SceneSource::default_builtin());
        last.build = BuildSettings { builder: BuilderKind::BinnedSah, ..last.build };
        let (spheres, _) = started("bvhscope --container sphere", &last);
        assert_eq!((spheres.build.builder, spheres.build.container), (BuilderKind::Aac, ContainerKind::Sphere));
        let (boxes, _) = started("bvhscope --builder binned-sah", &spheres);
        assert_eq!((boxes.build.builder, boxes.build.container), (BuilderKind::BinnedSah, ContainerKind::Aabb));
        assert_eq!(started("bvhscope --threshold 9", &last).0.build.builder, BuilderKind::Aac);
    }
}
