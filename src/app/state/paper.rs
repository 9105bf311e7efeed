//! The paper panel's plain values: what shall be measured on the open model, and what came of it. The measuring itself is
//! [`crate::lab`]'s, as on the command line.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::app::state::wanted::Wanted;
use crate::camera::Camera;
use crate::lab::plot::{Panel, PlotFormat, draw, panels};
use crate::lab::report_table::{ReportTable, tables};
use crate::lab::rows::{write_csv, write_json_lines};
use crate::lab::{Job, Measurement, Setup, SweepPlan, TraceView};
use crate::scene::Scene;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// What can be measured, named after the paper's tables and figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Experiment {
    /// Tables 1 and 2: box against sphere.
    Tables,
    /// Figures 9 and 10: what the threshold does.
    Thresholds,
    /// Figure 11: the speed-up over threads.
    Threads,
    /// The builders side by side.
    Builders,
}

impl Experiment {
    /// All, in the order of the panel.
    pub const ALL: [Self; 4] = [Self::Tables, Self::Thresholds, Self::Threads, Self::Builders];

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Tables => "Tables 1 and 2",
            Self::Thresholds => "Figures 9 and 10",
            Self::Threads => "Figure 11",
            Self::Builders => "Builders",
        }
    }

    /// What is measured, in one sentence.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Tables => "Box against sphere: build time, trace time and tests per ray of the present tree settings",
            Self::Thresholds => "What the threshold does to build time, trace time, tests per ray and SAH cost",
            Self::Threads => "The speed-up of building and tracing over the number of threads",
            Self::Builders => "Every builder side by side: build time, trace time, tests per ray and SAH cost",
        }
    }

    /// Whether the tables say more than the plots.
    const fn prefers_tables(self) -> bool {
        matches!(self, Self::Tables | Self::Builders)
    }
}

/// How the rows are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Display {
    /// As numbers.
    Tables,
    /// As curves.
    Plots,
}

/// Which files the rows are saved as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowFormat {
    /// A table for spreadsheets.
    Csv,
    /// One object a line.
    Json,
    /// The plot as pixels.
    Png,
    /// The plot as vectors.
    Svg,
}

impl RowFormat {
    /// All, in the order of the buttons.
    pub const ALL: [Self; 4] = [Self::Csv, Self::Json, Self::Png, Self::Svg];

    /// The name on the button.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Csv => "CSV",
            Self::Json => "JSON",
            Self::Png => "PNG",
            Self::Svg => "SVG",
        }
    }

    /// The extension of its files.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Json => "jsonl",
            Self::Png => "png",
            Self::Svg => "svg",
        }
    }
}

/// What shall be measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PaperPlan {
    /// What.
    pub experiment: Experiment,
    /// How it is shown.
    pub display: Display,
    /// Boxes, spheres or both.
    pub containers: Vec<ContainerKind>,
    /// How rays visit nodes.
    pub traversal: Traversal,
    /// From the model's default camera, as on the command line; otherwise from the window's.
    pub default_camera: bool,
    /// Width and height of the traced picture in pixels.
    pub side_px: u32,
    /// Repetitions of each measurement.
    pub repeat: usize,
    /// First and last threshold of the figures.
    pub thresholds: [u32; 2],
    /// Each ε of the figures.
    pub epsilons: Vec<f32>,
    /// The tables have testing every triangle as well.
    pub no_bvh: bool,
}

impl Default for PaperPlan {
    fn default() -> Self {
        Self {
            experiment: Experiment::Tables,
            display: Display::Tables,
            containers: ContainerKind::ALL.to_vec(),
            traversal: Traversal::Ordered,
            default_camera: true,
            side_px: 1024,
            repeat: 3,
            thresholds: [2, 32],
            epsilons: vec![0.2],
            no_bvh: false,
        }
    }
}

impl PaperPlan {
    /// Sizes of the traced picture that are offered.
    pub const SIDES_PX: [u32; 4] = [256, 512, 1024, 2048];
    /// Most repetitions that can be chosen.
    pub const MAX_REPEAT: usize = 99;
    /// Each ε that is offered.
    pub const EPSILONS: [f32; 5] = [0.0, 0.1, 0.2, 0.3, 0.4];

    /// Chooses what is measured, and shows it as it is best shown.
    pub fn choose(&mut self, experiment: Experiment) {
        self.experiment = experiment;
        self.display = if experiment.prefers_tables() { Display::Tables } else { Display::Plots };
    }

    /// Brings numbers that no control can reach back into its range.
    pub fn limit(&mut self) {
        self.repeat = self.repeat.clamp(1, Self::MAX_REPEAT);
        if !Self::SIDES_PX.contains(&self.side_px) {
            self.side_px = Self::default().side_px;
        }
        let [first, last] =
            self.thresholds.map(|value| value.clamp(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD));
        self.thresholds = [first.min(last), last];
        self.epsilons.retain(|epsilon| Self::EPSILONS.contains(epsilon));
        if self.epsilons.is_empty() {
            self.epsilons = Self::default().epsilons;
        }
        self.containers.dedup();
        if self.containers.is_empty() {
            self.containers = ContainerKind::ALL.to_vec();
        }
    }

    /// What the laboratory is asked for. The tables and figure 11 measure the tree that `wanted` describes.
    pub fn job(&self, wanted: &Wanted) -> Job {
        let setup = |&container| {
            // Without a tree there is nothing to compare.
            let builder =
                if wanted.build.builder == BuilderKind::None { BuilderKind::Aac } else { wanted.build.builder };
            let build = BuildSettings { builder, container, ..wanted.build };
            Setup { build, preset: None, threads: wanted.threads }
        };
        let setups = || self.containers.iter().map(setup).filter(|setup| setup.build.refusal(0).is_none()).collect();
        match self.experiment {
            Experiment::Tables => Job::Bench { setups: setups(), no_bvh: self.no_bvh },
            Experiment::Thresholds => Job::Sweep(SweepPlan {
                thresholds: (self.thresholds[0]..=self.thresholds[1]).collect(),
                epsilons: self.epsilons.clone(),
                containers: self.containers.clone(),
                threads: wanted.threads,
                shard: (1, 1),
            }),
            Experiment::Threads => Job::Scaling {
                setups: setups(),
                max_threads: if wanted.threads == 0 { rayon::current_num_threads() } else { wanted.threads },
            },
            Experiment::Builders => Job::Compare { containers: self.containers.clone(), threads: wanted.threads },
        }
    }

    /// Which rays are traced.
    pub fn view(&self, scene: &Scene, wanted: &Wanted) -> TraceView {
        TraceView {
            camera: if self.default_camera { Camera::framing(&scene.bounds, scene.up) } else { wanted.camera },
            size: [self.side_px; 2],
            traversal: self.traversal,
            repeat: self.repeat,
            simd: wanted.render.simd,
        }
    }
}

/// What has been measured so far.
#[derive(Debug, Clone)]
pub struct PaperResult {
    /// What.
    pub experiment: Experiment,
    /// On which model.
    pub scene: Arc<Scene>,
    /// The rows, as the command line prints them.
    pub rows: Arc<Vec<Measurement>>,
    /// The rows as tables.
    pub tables: Vec<ReportTable>,
    /// The rows as plots; empty where there is nothing to draw.
    pub panels: Vec<Panel>,
    /// All is there.
    pub finished: bool,
}

impl PaperResult {
    /// Everything that is shown of `rows`.
    pub fn new(experiment: Experiment, scene: Arc<Scene>, rows: Vec<Measurement>, finished: bool) -> Self {
        let command = rows.first().map_or("", |row| row.command.as_str());
        Self {
            experiment,
            scene,
            tables: if rows.is_empty() { Vec::new() } else { tables(command, &rows) },
            panels: panels(&rows).unwrap_or_default(),
            rows: Arc::new(rows),
            finished,
        }
    }

    /// The bytes of a file.
    pub fn file(&self, format: RowFormat) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        match format {
            RowFormat::Csv => write_csv(&self.rows, &mut bytes)?,
            RowFormat::Json => write_json_lines(&self.rows, &mut bytes)?,
            RowFormat::Png => bytes = draw(&self.panels, PlotFormat::Png)?,
            RowFormat::Svg => bytes = draw(&self.panels, PlotFormat::Svg)?,
        }
        Ok(bytes)
    }

    /// What its files are called, without number and extension: `teapot-sweep`.
    pub fn stem(&self) -> String {
        let label = self.scene.source.label();
        let stem =
            std::path::Path::new(&label).file_stem().map_or_else(|| label.clone(), |s| s.to_string_lossy().into());
        let command = self.rows.first().map_or("rows", |row| row.command.as_str());
        format!("{stem}-{command}")
    }
}

/// Sets `wanted` to the settings a row was measured with.
pub fn apply_row(row: &Measurement, wanted: &mut Wanted) {
    let Some(builder) = BuilderKind::ALL.into_iter().find(|builder| builder.name() == row.builder) else { return };
    wanted.build = BuildSettings {
        builder,
        container: row.container,
        threshold: row.threshold,
        epsilon: row.epsilon,
        curve: row.curve,
        optimize: row.optimize,
    };
    if row.command == "scaling" {
        wanted.threads = row.threads;
    }
}
