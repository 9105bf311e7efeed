//! Checking what trees find along the rays of a file, and what the file expects.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use super::command::{RaysCommand, Sample};
use super::export::{offset_of, write};
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::console::{note, printable_lines};
use crate::export::Protected;
use crate::headless::context::{Context, Failure, Finished, ignore_missing_reader, in_pool, needs_triangles};
use crate::headless::measure::of_job;
use crate::headless::output::json_line;
use crate::headless::progress::Progress;
use crate::headless::ray_input::{note_skipped, of_ray_file};
use crate::headless::tree_origin::{TreeOrigin, note_faults};
use crate::lab::ray_check::{Agreement, Blamed, Compared, Finding, RayCheck, check_rays, check_table};
use crate::provenance::VERSION;
use crate::ray_file::{FileRay, MISS, RayFaults, RayFileError, RayHeader, RayReader, append_rays};
use crate::scene::Scene;
use crate::text::{count, shown_path};
use bvhscope_engine::cancel::CancelToken;

/// Checks rays, prints the results, and writes the worst rays where an output is named.
pub(super) fn run(
    command: &RaysCommand,
    (path, sample): (&Path, Sample),
    (scene, read): (&Arc<Scene>, &Protected),
    context: &mut Context<'_>,
) -> Result<Finished, Failure> {
    needs_triangles(scene, "rays --verify")?;
    let token = &context.token.clone();
    let progress = Progress::new("Reading rays", token);
    let sampled = Sampled::read(path, sample.rays(scene.triangles.len()), scene, token);
    let sampled = sampled.map_err(|error| of_ray_file(path, error))?;
    note_skipped(path, &sampled.faults);
    if sampled.rays.is_empty() {
        return Err(Failure::Failed(format!("{}: has no ray that can be traced", shown_path(path))));
    }
    progress.set_label("Checking rays");
    let (given, check) = in_pool(|| {
        let given = given_tree(command, scene, token)?;
        let named = given.as_ref().map(|(name, accel)| (name.as_str(), accel));
        let check = check_rays(scene, named, &sampled.rays, token).map_err(|error| of_job(error, &command.source))?;
        Ok::<_, Failure>((given, check))
    })?;
    let has_faults = given.is_some_and(|(_, accel)| note_faults(&accel));
    if let Some(output) = command.output.as_ref().filter(|_| check.worst.is_empty()) {
        progress.suspend(|| note(format_args!("bvhscope: {} is not written, as no ray is wrong", shown_path(output))));
    } else if let Some(output) = &command.output {
        let header = RayHeader {
            name: Some(format!("worst of {}", shown_path(path))),
            mesh: Some(command.source.to_string()),
            source: Some(format!("bvhscope {VERSION}")),
            offset: offset_of(scene),
            ..RayHeader::default()
        };
        let worst: Vec<FileRay> = check.worst.iter().map(with_exact_hit).collect();
        write(output, read, &header, &worst, token)?;
    }
    drop(progress);
    let is_wrong = check.compared.iter().any(|compared| compared.faults() > 0);
    print(command, path, (&sampled, &check), context)?;
    Ok(Finished { warned: has_faults || is_wrong || !sampled.faults.is_empty() })
}

/// The tree of the command, where it names one: of a file, or with settings.
fn given_tree(
    command: &RaysCommand,
    scene: &Arc<Scene>,
    token: &CancelToken,
) -> Result<Option<(String, Arc<Accel>)>, Failure> {
    let name = match &command.tree {
        TreeOrigin::File(path) => shown_path(path),
        TreeOrigin::OfModel if !scene.has_tree => return Ok(None),
        TreeOrigin::OfModel => command.source.label(),
        TreeOrigin::Built => "these settings".to_owned(),
    };
    let unmoved = (Follow::default(), &mut FollowSession::default());
    let accel = command.tree.accel(scene, &command.source, &command.build, unmoved, token)?;
    Ok(Some((name, Arc::new(accel))))
}

/// A ray that expects the exact hit, so that it can be checked again.
fn with_exact_hit(finding: &Finding) -> FileRay {
    let (triangle, t) = finding.exact.map_or((MISS, f32::INFINITY), |exact| (exact.triangle, exact.t as f32));
    FileRay { expected_triangle: Some(triangle), expected_t: Some(t), ..finding.ray }
}

/// Rays of a file, at equal distances.
struct Sampled {
    rays: Vec<FileRay>,
    /// Rays of the whole file, with those that were skipped.
    all: u64,
    faults: RayFaults,
}

impl Sampled {
    /// Reads at most `most` rays. Where there are twice as many, every other one is dropped, and from then on only every other one is kept.
    fn read(path: &Path, most: usize, scene: &Scene, token: &CancelToken) -> Result<Self, RayFileError> {
        let mut reader = RayReader::open(path, scene.offset, token)?;
        let (mut rays, mut chunk, mut step, mut place) = (Vec::new(), Vec::new(), 1_u64, 0_u64);
        while reader.read(&mut chunk, token)? {
            chunk.retain(|_| {
                place += 1;
                (place - 1).is_multiple_of(step)
            });
            append_rays(&mut rays, &chunk)?;
            while rays.len() > most.saturating_mul(2) {
                let mut is_kept = false;
                rays.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
                step *= 2;
            }
        }
        if rays.len() > most {
            rays = (0..most).map(|place| rays[place * rays.len() / most]).collect();
        }
        Ok(Self { rays, all: reader.position(), faults: reader.faults().clone() })
    }
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    command: &'static str,
    model: String,
    file: String,
    rays: u64,
    skipped_rays: u64,
    checked_rays: usize,
    hits: usize,
    /// The meaning of the numbers of rays in `compared`.
    agreements: [&'static str; Agreement::ALL.len()],
    compared: &'a [Compared],
    worst: Vec<WorstRay<'a>>,
}

#[derive(Debug, Serialize)]
struct WorstRay<'a> {
    ray: u64,
    pixel: Option<[u32; 2]>,
    tree: &'a str,
    method: &'a str,
    agreement: &'static str,
    exact_triangle: Option<u32>,
    exact_t: Option<f64>,
    found_triangle: Option<u32>,
    found_t: Option<f32>,
    blamed: Option<Blamed>,
}

impl<'a> WorstRay<'a> {
    fn new(finding: &'a Finding) -> Self {
        Self {
            ray: finding.ray.index,
            pixel: finding.ray.pixel,
            tree: &finding.name,
            method: &finding.method,
            agreement: finding.agreement.name(),
            exact_triangle: finding.exact.map(|exact| exact.triangle),
            exact_t: finding.exact.map(|exact| exact.t),
            found_triangle: finding.found.and_then(|(triangle, _)| triangle),
            found_t: finding.found.and_then(|(_, t)| t),
            blamed: finding.blamed,
        }
    }
}

fn print(
    command: &RaysCommand,
    path: &Path,
    (sampled, check): (&Sampled, &RayCheck),
    context: &mut Context<'_>,
) -> Result<(), Failure> {
    let text = if command.json {
        let summary = Summary {
            command: "rays",
            model: command.source.to_string(),
            file: path.display().to_string(),
            rays: sampled.all,
            skipped_rays: sampled.faults.count(),
            checked_rays: check.rays,
            hits: check.hits,
            agreements: Agreement::ALL.map(Agreement::name),
            compared: &check.compared,
            worst: check.worst.iter().map(WorstRay::new).collect(),
        };
        json_line(&summary)?
    } else {
        let title = format!(
            "{}: {} of {} rays of {}, {} of which hit, against a test of every triangle in double precision",
            command.source,
            count(check.rays as u64),
            count(sampled.all),
            shown_path(path),
            count(check.hits as u64)
        );
        printable_lines(&check_table(title, check).to_string())
    };
    Ok(ignore_missing_reader(context.out.write_all(text.as_bytes()))?)
}
