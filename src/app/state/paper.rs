//! Settings and results of the view "Paper": experiments of the paper on the open model, measured by [`crate::lab`] as on the
//! command line.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::app::state::second_tree::TreeSide;
use crate::app::state::wanted::Wanted;
use crate::catalog::settings::{EPSILON, Setting, THRESHOLD};
use crate::lab::plot::{Figure, PlotFormat, draw};
use crate::lab::population::Populations;
use crate::lab::report_table::{ReportTable, tables};
use crate::lab::rows::{write_csv, write_json_lines};
use crate::lab::{Job, Measurement, Setup, SweepPlan, TraceView};
use crate::scene::Scene;
use crate::view::{NamedView, Place};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// A measurement, named after the paper's tables and figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Experiment {
    /// Tables 1 and 2: box against sphere.
    Tables,
    /// Figures 9 and 10: the effect of the threshold.
    Thresholds,
    /// Figure 11: the speed-up over threads.
    Threads,
    /// The builders side by side.
    Builders,
}

impl Experiment {
    /// All, in the order of the panel.
    pub const ALL: [Self; 4] = [Self::Tables, Self::Thresholds, Self::Threads, Self::Builders];

    /// The question that it answers.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Tables => "Box or sphere?",
            Self::Thresholds => "What does the threshold do?",
            Self::Threads => "How far does it scale?",
            Self::Builders => "Which builder?",
        }
    }

    /// Its tables and figures in the paper; empty where it goes beyond that.
    pub const fn in_paper(self) -> &'static str {
        match self {
            Self::Tables => "tables 1, 2",
            Self::Thresholds => "figures 9, 10",
            Self::Threads => "figure 11",
            Self::Builders => "",
        }
    }

    /// The measurement, in one sentence.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Tables => "Box against sphere: build time, trace time and tests per ray of the present tree settings",
            Self::Thresholds => "What the threshold does to build time, trace time, tests per ray and SAH cost",
            Self::Threads => "The speed-up of building and tracing over the number of threads",
            Self::Builders => "Every builder side by side: build time, trace time, tests per ray and SAH cost",
        }
    }

    /// Whether tables suit it better than plots.
    const fn prefers_tables(self) -> bool {
        matches!(self, Self::Tables | Self::Builders)
    }
}

/// How the rows are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Display {
    /// Tables of numbers.
    Tables,
    /// Curves.
    Plots,
}

/// A file format for measured rows and their plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowFormat {
    /// Comma-separated values.
    Csv,
    /// JSON lines: one object per row.
    Json,
    /// The plots as a raster image.
    Png,
    /// The plots as a vector image.
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

    /// The file name extension without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Json => "jsonl",
            Self::Png => "png",
            Self::Svg => "svg",
        }
    }
}

/// Settings of a measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PaperPlan {
    /// The experiment.
    pub experiment: Experiment,
    /// How its rows are shown.
    pub display: Display,
    /// Containers to measure.
    pub containers: Vec<ContainerKind>,
    /// Order in which rays visit nodes.
    pub traversal: Traversal,
    /// Trace from the model's default camera, as the command line does, instead of the window's.
    pub default_camera: bool,
    /// Width and height of the picture in pixels.
    pub side_px: u32,
    /// Number of repetitions of each measurement.
    pub repeat: usize,
    /// First and last threshold δ of the figures.
    pub thresholds: [u32; 2],
    /// Reduction exponents ε of the figures.
    pub epsilons: Vec<f32>,
    /// The tables include a row without a tree, where every ray tests every triangle.
    pub no_bvh: bool,
}

impl Default for PaperPlan {
    fn default() -> Self {
        Self {
            experiment: Experiment::Tables,
            display: Display::Tables,
            containers: ContainerKind::OF_PAPER.to_vec(),
            traversal: Traversal::Ordered,
            default_camera: true,
            side_px: 1024,
            repeat: 9,
            thresholds: [2, 32],
            epsilons: vec![0.2],
            no_bvh: false,
        }
    }
}

impl PaperPlan {
    /// Name of its view.
    pub const VIEW: &str = "Paper";
    /// Offered values of `side_px`.
    pub const SIDES_PX: [u32; 4] = [256, 512, 1024, 2048];
    /// Maximum of `repeat`.
    pub const MAX_REPEAT: usize = 99;
    /// The setting of which each chosen value has a curve in the figures.
    pub const CURVES: &Setting = &EPSILON;
    /// Its values on offer.
    pub const CURVE_VALUES: [f32; 5] = [0.0, 0.1, 0.2, 0.3, 0.4];

    /// A value has a curve.
    pub fn has_curve(&self, value: f32) -> bool {
        self.epsilons.contains(&value)
    }

    /// Adds or removes a curve; the last one stays.
    pub fn toggle_curve(&mut self, value: f32) {
        let on = self.has_curve(value);
        if !on || self.epsilons.len() > 1 {
            let chosen = |other: &f32| self.has_curve(*other) != (*other == value);
            self.epsilons = Self::CURVE_VALUES.into_iter().filter(chosen).collect();
        }
    }

    /// Selects an experiment, and the display that suits it best.
    pub fn choose(&mut self, experiment: Experiment) {
        self.experiment = experiment;
        self.display = if experiment.prefers_tables() { Display::Tables } else { Display::Plots };
    }

    /// Limits all settings to the ranges of their controls.
    pub fn limit(&mut self) {
        self.repeat = self.repeat.clamp(1, Self::MAX_REPEAT);
        if !Self::SIDES_PX.contains(&self.side_px) {
            self.side_px = Self::default().side_px;
        }
        let [first, last] =
            self.thresholds.map(|value| value.clamp(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD));
        self.thresholds = [first.min(last), last];
        self.epsilons.retain(|epsilon| Self::CURVE_VALUES.contains(epsilon));
        if self.epsilons.is_empty() {
            self.epsilons = Self::default().epsilons;
        }
        self.containers.dedup();
        if self.containers.is_empty() {
            self.containers = ContainerKind::OF_PAPER.to_vec();
        }
    }

    /// The job for [`crate::lab`]. Tables and figure 11 measure the tree settings in `wanted`.
    pub fn job(&self, wanted: &Wanted) -> Job {
        let setup = |&container| {
            // The experiments compare trees, so brute force is replaced by AAC.
            let builder =
                if wanted.build.builder == BuilderKind::None { BuilderKind::Aac } else { wanted.build.builder };
            let build = BuildSettings { builder, container, ..wanted.build };
            Setup { build, preset: None, threads: wanted.threads }
        };
        let setups = || self.containers.iter().map(setup).filter(|setup| setup.build.refusal(0).is_none()).collect();
        match self.experiment {
            Experiment::Tables => Job::Bench { setups: setups(), no_bvh: self.no_bvh },
            Experiment::Thresholds => Job::Sweep(SweepPlan {
                ranges: vec![
                    (Self::CURVES, self.epsilons.clone()),
                    (&THRESHOLD, (self.thresholds[0]..=self.thresholds[1]).map(|value| value as f32).collect()),
                ],
                containers: self.containers.clone(),
                threads: wanted.threads,
                shard: (1, 1),
            }),
            Experiment::Threads => {
                Job::Scaling { setups: setups(), max_threads: crate::threads::count(wanted.threads), predict: false }
            }
            Experiment::Builders => {
                Job::Compare { containers: self.containers.clone(), slow: false, threads: wanted.threads }
            }
        }
    }

    /// Whether the trees are many and different enough to judge predictions of costs by them.
    const fn measures_rays(&self) -> bool {
        matches!(self.experiment, Experiment::Builders | Experiment::Thresholds)
    }

    /// Camera, size and traversal of the traced picture.
    pub fn view(&self, scene: &Scene, wanted: &Wanted) -> TraceView {
        let default = NamedView::Default;
        let (camera, place) = if self.default_camera {
            (default.camera(scene, scene.up), default.place(scene))
        } else {
            (wanted.camera, Place::Given)
        };
        TraceView {
            camera,
            place,
            size: [self.side_px; 2],
            traversal: self.traversal,
            repeat: self.repeat,
            simd: wanted.render.simd,
            populations: if self.measures_rays() { Populations::ALL } else { Populations::NONE },
            epo_samples: None,
        }
    }
}

/// Rows measured so far.
#[derive(Debug, Clone)]
pub struct PaperResult {
    /// The experiment.
    pub experiment: Experiment,
    /// The model.
    pub scene: Arc<Scene>,
    /// The rows, the same as on the command line.
    pub rows: Arc<Vec<Measurement>>,
    /// The rows as tables.
    pub tables: Vec<ReportTable>,
    /// The rows as plots; without charts where there is nothing to plot.
    pub figure: Figure,
    /// All rows are measured.
    pub finished: bool,
}

impl PaperResult {
    /// Makes tables and plots of `rows`.
    pub fn new(experiment: Experiment, scene: Arc<Scene>, rows: Vec<Measurement>, finished: bool) -> Self {
        let command = rows.first().map_or("", |row| row.command.as_str());
        Self {
            experiment,
            scene,
            tables: if rows.is_empty() { Vec::new() } else { tables(command, &rows) },
            figure: Figure::of_rows(&rows).unwrap_or_default(),
            rows: Arc::new(rows),
            finished,
        }
    }

    /// Contents of a file in `format`.
    pub fn file(&self, format: RowFormat) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        match format {
            RowFormat::Csv => write_csv(&self.rows, &mut bytes)?,
            RowFormat::Json => write_json_lines(&self.rows, &mut bytes)?,
            RowFormat::Png => bytes = self.drawn(PlotFormat::Png)?,
            RowFormat::Svg => bytes = self.drawn(PlotFormat::Svg)?,
        }
        Ok(bytes)
    }

    fn drawn(&self, format: PlotFormat) -> Result<Vec<u8>, String> {
        draw(&self.figure, format, &CancelToken::new()).map_err(|error| error.to_string())
    }

    /// Name of its files without number and extension: `teapot-sweep`.
    pub fn stem(&self) -> String {
        let label = self.scene.source.label();
        let stem =
            std::path::Path::new(&label).file_stem().map_or_else(|| label.clone(), |s| s.to_string_lossy().into());
        let command = self.rows.first().map_or("rows", |row| row.command.as_str());
        format!("{stem}-{command}")
    }
}

/// The settings a row was measured with; `None` where its builder is unknown and where a file holds its tree.
pub fn settings_of(row: &Measurement) -> Option<BuildSettings> {
    if row.tree.is_some() {
        return None;
    }
    let builder = BuilderKind::ALL.into_iter().find(|builder| builder.name() == row.builder)?;
    let mut build = BuildSettings { builder, ..BuildSettings::default() }.for_container(row.container);
    row.settings.apply(&mut build);
    Some(build)
}

/// Sets `wanted` to the tree of a row: its file, or the settings it was measured with.
pub fn apply_row(row: &Measurement, wanted: &mut Wanted) {
    wanted.set_tree_file(TreeSide::A, row.tree.as_ref().map(Into::into));
    let Some(build) = settings_of(row) else { return };
    wanted.build = build;
    if row.command == "scaling" {
        wanted.threads = row.threads;
    }
}
