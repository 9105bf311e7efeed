//! The contents of a file of rays, as `bvhscope rays` prints them.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use super::command::RaysCommand;
use super::export::{offset_of, write};
use crate::console::printable_lines;
use crate::export::Protected;
use crate::headless::context::{Context, Failure, Finished, ignore_missing_reader};
use crate::headless::output::json_line;
use crate::headless::progress::Progress;
use crate::headless::ray_input::{note_skipped, of_ray_file};
use crate::ray_file::{FileRay, RayFaults, RayHeader, RayReader, RaySet};
use crate::scene::Scene;
use crate::text::{counted, number, printable, shown_path};

/// Counts of the rays of a file. Field names are the JSON names.
#[derive(Debug, Default, Serialize)]
struct Counts {
    /// Those that can be traced.
    rays: u64,
    skipped_rays: u64,
    /// Rays that any hit ends.
    any_rays: u64,
    /// Rays that enter the box of the scene.
    entering_rays: u64,
    /// Rays of which the file states what another program found.
    expected_rays: u64,
    weight_sum: f64,
}

impl Counts {
    fn add(&mut self, rays: &[FileRay], scene: &Scene) {
        for ray in rays {
            self.rays += 1;
            self.any_rays += u64::from(ray.any);
            self.entering_rays += u64::from(scene.is_entered_by(&ray.ray));
            self.expected_rays += u64::from(ray.expected_triangle.is_some() || ray.expected_t.is_some());
            self.weight_sum += f64::from(ray.weight);
        }
    }
}

/// The JSON object that `--json` prints.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    command: &'static str,
    model: String,
    file: String,
    header: &'a RayHeader,
    #[serde(flatten)]
    counts: Counts,
    warnings: Vec<String>,
}

/// Prints what the file holds, and writes its rays where an output is named.
pub(super) fn run(
    command: &RaysCommand,
    path: &Path,
    (scene, read): (&Arc<Scene>, &Protected),
    context: &mut Context<'_>,
) -> Result<Finished, Failure> {
    let token = &context.token.clone();
    let progress = Progress::new("Reading rays", token);
    let failed = |error| of_ray_file(path, error);
    let mut counts = Counts::default();
    let (header, faults) = if let Some(output) = &command.output {
        let set = RaySet::read(path, scene.offset, token).map_err(failed)?;
        counts.add(&set.rays, scene);
        let header = RayHeader { offset: offset_of(scene), ..set.header };
        write(output, read, &header, &set.rays, token)?;
        (header, set.faults)
    } else {
        let mut reader = RayReader::open(path, scene.offset, token).map_err(failed)?;
        let mut chunk = Vec::new();
        while reader.read(&mut chunk, token).map_err(failed)? {
            counts.add(&chunk, scene);
        }
        (reader.header().clone(), reader.faults().clone())
    };
    drop(progress);
    counts.skipped_rays = faults.count();
    print(command, path, (header, counts, &faults), context)?;
    Ok(Finished { warned: !faults.is_empty() })
}

fn print(
    command: &RaysCommand,
    path: &Path,
    (header, counts, faults): (RayHeader, Counts, &RayFaults),
    context: &mut Context<'_>,
) -> Result<(), Failure> {
    note_skipped(path, faults);
    let text = if command.json {
        let summary = Summary {
            command: "rays",
            model: command.source.to_string(),
            file: path.display().to_string(),
            header: &header,
            counts,
            warnings: faults.texts().collect(),
        };
        json_line(&summary)?
    } else {
        printable_lines(&text(command, path, &header, &counts))
    };
    Ok(ignore_missing_reader(context.out.write_all(text.as_bytes()))?)
}

fn text(command: &RaysCommand, path: &Path, header: &RayHeader, counts: &Counts) -> String {
    let Counts { rays, any_rays, entering_rays, expected_rays, weight_sum, .. } = counts;
    let mut text = format!("{}: {}", shown_path(path), counted(*rays, "rays"));
    let stated = [("name", &header.name), ("mesh", &header.mesh), ("kind", &header.kind), ("source", &header.source)];
    for (key, value) in stated {
        if let Some(value) = value {
            let _ = write!(text, "\n  {key:<10}{}", printable(value));
        }
    }
    let lines = [
        ("shadow", format!("{} that any hit ends", counted(*any_rays, "rays"))),
        ("entering", format!("{} that enter the box of {}", counted(*entering_rays, "rays"), command.source.label())),
        ("expected", format!("{} with what another program found", counted(*expected_rays, "rays"))),
        ("weights", format!("{} in all", number(*weight_sum))),
    ];
    for (key, line) in lines {
        let _ = write!(text, "\n  {key:<10}{line}");
    }
    text + "\n"
}
