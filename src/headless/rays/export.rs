//! Writing the rays of a population.

use std::path::Path;
use std::sync::Arc;

use super::command::RaysCommand;
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::budget::Budget;
use crate::export::{Protected, cannot_be_written, write_file};
use crate::headless::context::{Context, Failure, Finished, camera_of, in_pool};
use crate::headless::picture::{check_written, note_written};
use crate::headless::progress::Progress;
use crate::headless::tree_origin::note_faults;
use crate::lab::population::{Population, ViewRays};
use crate::provenance::VERSION;
use crate::ray_file::{FileRay, RayHeader, write_rays};
use crate::scene::Scene;
use crate::text::counted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Number of times that a view is divided into smaller squares until enough of them have a ray.
const MOST_DIVISIONS: usize = 4;
/// Maximum number of squares that a view is divided into for more rays than squares were asked for: a view of nearly nothing has few.
const MOST_SQUARES: u64 = 1 << 24;

/// Writes the rays of a population, `count` of them where the view has so many.
pub(super) fn run(
    command: &RaysCommand,
    (population, count): (Population, Option<u32>),
    (scene, read): (&Arc<Scene>, &Protected),
    context: &Context<'_>,
) -> Result<Finished, Failure> {
    let Some(path) = &command.output else {
        return Err(Failure::Usage("--kind: -o FILE says where the rays are written".to_owned()));
    };
    let per_ray = size_of::<FileRay>() as u64 * 2;
    Budget::of_process()
        .check("the rays", u64::from(count.unwrap_or_default()) * per_ray)
        .map_err(|error| Failure::Failed(error.to_string()))?;
    let camera = camera_of(&command.camera, scene)?;
    let view = ViewRays::new(population, camera, command.size, &command.settings);
    let token = &context.token;
    let progress = Progress::new("Building", token);
    let (accel, rays) = in_pool(|| {
        let unmoved = (Follow::default(), &mut FollowSession::default());
        let accel = Arc::new(command.tree.accel(scene, &command.source, &command.build, unmoved, token)?);
        let rays = rays_of(view.clone(), count, &accel, token)?;
        Ok::<_, Failure>((accel, rays))
    })?;
    let has_faults = note_faults(&accel);
    if rays.is_empty() {
        return Err(Failure::Failed(format!("--kind {}: {}", population.name(), population.absence(view.light()))));
    }
    progress.set_label("Writing");
    let header = RayHeader {
        name: Some(format!("{} of {}", population.name(), command.source.label())),
        mesh: Some(command.source.to_string()),
        kind: Some(population.name().to_owned()),
        source: Some(format!("bvhscope {VERSION}")),
        offset: offset_of(scene),
        ..RayHeader::default()
    };
    write(path, read, &header, &rays, token)?;
    drop(progress);
    Ok(Finished { warned: has_faults })
}

/// The offset of a scene, where it has one.
pub(super) fn offset_of(scene: &Scene) -> Option<[f64; 3]> {
    (scene.offset != glam::DVec3::ZERO).then(|| scene.offset.to_array())
}

/// Writes a file of rays, and says so.
pub(super) fn write(
    path: &Path,
    read: &Protected,
    header: &RayHeader,
    rays: &[FileRay],
    token: &CancelToken,
) -> Result<(), Failure> {
    let written = write_file(path, read, |writer| {
        write_rays(header, rays, writer, token).map_err(|error| cannot_be_written(&error))
    });
    check_written(written, token)?;
    note_written(path, &counted(rays.len() as u64, "rays"));
    Ok(())
}

/// The rays of `view`: with a count as many of them, at equal distances, from smaller squares where its own are too few.
fn rays_of(
    view: ViewRays,
    count: Option<u32>,
    accel: &Arc<Accel>,
    token: &CancelToken,
) -> Result<Vec<FileRay>, Cancelled> {
    let wanted = count.map(|count| count as usize);
    let mut view = count.map_or(view.clone(), |count| view.with_squares(count));
    let mut rays = view.list(accel, token)?;
    let mut squares = u64::from(count.unwrap_or_default());
    for _ in 0..MOST_DIVISIONS {
        let is_enough = wanted.is_none_or(|wanted| rays.len() >= wanted);
        if is_enough || rays.is_empty() || squares >= MOST_SQUARES {
            break;
        }
        let needed = (squares * u64::from(count.unwrap_or_default())).div_ceil(rays.len() as u64);
        // A little more, as smaller squares meet other surfaces.
        squares = (needed + needed / 20 + 1).min(MOST_SQUARES);
        view = view.with_squares(squares as u32);
        rays = view.list(accel, token)?;
    }
    let any = view.population().ends_at_any_hit();
    let kept = wanted.unwrap_or(rays.len()).min(rays.len());
    let ray = |place: usize| {
        let index = (place as u64 * rays.len() as u64 / kept as u64) as usize;
        FileRay { any, pixel: view.square_of(index), ..FileRay::new(place as u64, rays[index]) }
    };
    Ok((0..kept).map(ray).collect())
}
