//! Tables and findings of `animate`: each policy over all frames.

use super::aligned::ReportTable;
use super::format::{conditions_and_threads, costs, name_among, number, ratio};
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{
    EPO, POPULATION_TESTS_PER_RAY, PREPARATION_MS, RAY_NS, READY_MS, SAH_COST, UPDATE_MS,
};
use crate::catalog::reading::quantile;
use crate::lab::measurement::{FrameOfClip, Measurement, model_views};
use crate::lab::motion::{BreakEven, FrameCost, break_even, cheaper_in, cheapest, factor, least, pays_from};
use crate::lab::population::Population;
use crate::text::{count, counted};
use bvhscope_engine::follow::{FRAMES_BEHIND, POSES, Policy};

/// Numbers of the table, each with its column, and whether its largest value has one too.
const COLUMNS: [(&Number, &str, &str, bool); 6] = [
    (UPDATE_MS, "update", "ms", true),
    (READY_MS, "ready", "ms", true),
    (RAY_NS, "a ray", "ns", false),
    (POPULATION_TESTS_PER_RAY, "tests", "a ray", true),
    (SAH_COST, "SAH cost", "", true),
    (EPO, "EPO", "", false),
];

/// The rows of one policy, in the order of frames.
struct Followed<'a> {
    policy: Policy,
    rows: Vec<&'a Measurement>,
}

impl<'a> Followed<'a> {
    /// The rows of each policy among those of one model and container.
    fn all(rows: &[&'a Measurement]) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for &row in rows {
            let Some(motion) = &row.motion else { continue };
            match all.iter_mut().find(|followed| followed.policy == motion.policy) {
                Some(followed) => followed.rows.push(row),
                None => all.push(Self { policy: motion.policy, rows: vec![row] }),
            }
        }
        all
    }

    fn median(&self, of: &Number) -> f64 {
        median(self.rows.iter().map(|row| row.number(of)))
    }

    fn most(&self, of: &Number) -> f64 {
        self.rows.iter().map(|row| row.number(of)).fold(f64::NAN, f64::max)
    }

    /// Time of each frame, as far as it is known.
    fn costs(&self) -> Vec<FrameCost> {
        let cost = |row: &&Measurement| {
            let frame = row.motion.as_ref()?.frame;
            let [ready_ms, ray_ns] = [row.values.known(READY_MS)?, row.values.known(RAY_NS)?];
            Some(FrameCost { frame, ready_ms, ray_ns })
        };
        self.rows.iter().map_while(cost).collect()
    }

    fn median_time(&self, rays: f64) -> f64 {
        median(self.costs().iter().map(|cost| cost.time_ms(rays)))
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

/// A table for each model and container, with what its numbers say.
pub(super) fn policy_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let mut groups: Vec<Vec<&Measurement>> = Vec::new();
    for row in rows {
        let is_like = |group: &&mut Vec<&Measurement>| {
            group[0].view() == row.view() && group[0].container == row.container && group[0].builder == row.builder
        };
        match groups.iter_mut().find(is_like) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    let models = model_views(rows);
    let names =
        |row: &Measurement| format!("{}, {}, {}", name_among(row.view(), &models), row.name(), row.container.name());
    groups.iter().map(|group| policy_table(&names(group[0]), group)).collect()
}

fn policy_table(name: &str, rows: &[&Measurement]) -> ReportTable {
    let (all, rays) = (Followed::all(rows), rays_of_frame(rows[0]));
    let frames = all.iter().map(|followed| followed.rows.len()).max().unwrap_or(0);
    let clip = rows[0].motion.as_ref().map(FrameOfClip::clip_text).unwrap_or_default();
    let own: Vec<Measurement> = rows.iter().map(|row| (*row).clone()).collect();
    let mut table = ReportTable::new(
        format!("{name}: {} of {clip} ({})", counted(frames as u64, "frames"), conditions_and_threads(&own)),
        &[("policy", "")],
    );
    for (_, column, unit, has_most) in COLUMNS {
        table.columns.push((column.to_owned(), unit.to_owned()));
        table.columns.extend(has_most.then(|| ("most".to_owned(), unit.to_owned())));
    }
    table.columns.push(("frame".to_owned(), "ms".to_owned()));
    for followed in &all {
        let mut line = vec![followed.policy.name().to_owned()];
        for (of, .., has_most) in COLUMNS {
            line.push(number(followed.median(of)));
            line.extend(has_most.then(|| number(followed.most(of))));
        }
        line.push(number(followed.median_time(rays)));
        table.rows.push(line);
    }
    table.notes = notes(rows[0], &all, rays);
    table.notes.extend(findings(&all, rays));
    table
}

/// A ray for each pixel of the picture.
fn rays_of_frame(row: &Measurement) -> f64 {
    f64::from(row.width_px) * f64::from(row.height_px)
}

/// How to read the table.
fn notes(row: &Measurement, all: &[Followed<'_>], rays: f64) -> Vec<String> {
    let population = row.populations.first().map_or(Population::Primary, |rays| rays.population);
    let mut notes = vec![
        format!(
            "Medians over all frames. Update: of the binary tree (in two levels, of the one over the copies); ready: and of the wide one, \
             through which {} rays take the time under 'a ray', all threads together; frame: ready and {} rays.",
            population.name(),
            count(rays as u64)
        ),
        costs(std::slice::from_ref(row)),
    ];
    let has = |policy| all.iter().any(|followed| followed.policy == policy);
    if has(Policy::Keep) {
        notes.push(
            "keep: its root encloses the whole clip, over whose area its SAH cost is; more rays enter it than the root of another tree."
                .to_owned(),
        );
    }
    if let Some(whole) = all.iter().find(|followed| followed.policy == Policy::WholeClip) {
        let ms = whole.rows.first().map_or(f64::NAN, |row| row.number(PREPARATION_MS));
        notes.push(format!(
            "whole-clip: its tree of {POSES} poses takes {} ms before the first frame, once.",
            number(ms)
        ));
    }
    if has(Policy::RebuildBehind) {
        notes.push(format!(
            "rebuild-behind: each tree takes over {FRAMES_BEHIND} frames after it was begun; building it is not counted, as another \
             thread's."
        ));
    }
    notes
}

/// Which policy takes the least time, and when rebuilding would have paid.
fn findings(all: &[Followed<'_>], rays: f64) -> Vec<String> {
    let costs: Vec<Vec<FrameCost>> = all.iter().map(Followed::costs).collect();
    let mut findings: Vec<String> = fastest(all, &costs, rays).into_iter().collect();
    if findings.is_empty() {
        return findings;
    }
    if let Some(rebuilt) = all.iter().position(|one| one.policy == Policy::Rebuild) {
        // Others build too, at least in part.
        let is_never_built =
            |one: &Followed<'_>| matches!(one.policy, Policy::Keep | Policy::Refit | Policy::WholeClip);
        let followed = all.iter().zip(&costs).filter(|(one, _)| is_never_built(one));
        findings.extend(followed.map(|(one, costs_of)| pays(one, costs_of, &costs[rebuilt], rays)));
    }
    findings.push(
        "Verdicts and intervals hold with 99 %, by the sign test over the frames, each the median of its rounds; fewer than 8 frames decide \
         none but large factors."
            .to_owned(),
    );
    findings
}

/// The policy that takes the least time over all frames, or those between which that is not decided; and in how many frames each was measured
/// to take the least.
fn fastest(all: &[Followed<'_>], costs: &[Vec<FrameCost>], rays: f64) -> Option<String> {
    let in_frames = cheapest(costs, rays);
    let found = least(costs, rays).filter(|_| !in_frames.is_empty())?;
    let mut won: Vec<(usize, &Followed<'_>)> = all
        .iter()
        .enumerate()
        .map(|(index, followed)| (in_frames.iter().filter(|&&policy| policy == index).count(), followed))
        .filter(|(frames, _)| *frames > 0)
        .collect();
    won.sort_by_key(|(frames, _)| std::cmp::Reverse(*frames));
    let shares: Vec<String> = won.iter().map(|(frames, one)| format!("{} in {frames}", one.policy.name())).collect();
    let frames = counted(in_frames.len() as u64, "frames");
    let named = |index: usize| format!("{} ({} ms)", all[index].policy.name(), number(all[index].median_time(rays)));
    let verdict = if found.rivals.is_empty() {
        let factors = (0..all.len()).filter(|&other| other != found.policy).filter_map(|other| {
            let factor = factor(&costs[found.policy], &costs[other], rays)?;
            Some((other, factor.median, factor.interval?))
        });
        let (next, median, [lower, upper]) = factors.min_by(|a, b| a.1.total_cmp(&b.1))?;
        format!(
            "{} takes the least time of a frame; {} takes {} times as long ({} to {})",
            named(found.policy),
            named(next),
            ratio(median),
            ratio(lower),
            ratio(upper)
        )
    } else {
        let names: Vec<String> = std::iter::once(found.policy).chain(found.rivals).map(named).collect();
        format!("the least time of a frame is not decided between {}", names.join(", "))
    };
    Some(format!(
        "With {} rays a frame and over {frames}, {verdict}. The least was measured of {}.",
        count(rays as u64),
        shares.join(", ")
    ))
}

/// When rebuilding would have paid against a tree that is never built again.
fn pays(followed: &Followed<'_>, costs: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> String {
    let name = followed.policy.name();
    let time = |frame: usize| {
        let motion = followed.rows.get(frame).and_then(|row| row.motion.as_ref());
        motion.map_or(f64::NAN, |motion| f64::from(motion.time_s))
    };
    let frames = counted(costs.len().min(rebuilt.len()) as u64, "frames");
    let cheaper = cheaper_in(costs, rebuilt, rays);
    let decided = factor(costs, rebuilt, rays).and_then(|factor| factor.decided());
    let text = match (pays_from(costs, rebuilt, rays), decided) {
        (Some(frame), _) => {
            format!(
                "Rebuilding would have paid against {name} from frame {frame} ({} s) to the end",
                number(time(frame))
            )
        }
        (None, Some(std::cmp::Ordering::Less)) => {
            format!("Rebuilding would have paid against {name}: it took less time in {cheaper} of {frames}")
        }
        (None, Some(_)) if cheaper == 0 => format!("Rebuilding never paid against {name}"),
        (None, Some(_)) => format!("Rebuilding paid against {name} in {cheaper} of {frames}"),
        (None, None) => format!("Not decided against {name}: rebuilding took less time in {cheaper} of {frames}"),
    };
    let even = break_even(costs, rebuilt).map_or_else(String::new, |even| break_even_text(&even));
    format!("{text}. {even}")
}

/// "Break-even at 257,000 rays a frame (180,000 to 420,000)".
fn break_even_text(even: &BreakEven) -> String {
    let of = |rays: f64| if rays.is_finite() { count(rays.round() as u64) } else { "no number".to_owned() };
    let interval = match even.interval {
        Some(ends) if ends[0].is_infinite() => String::new(),
        Some([least, most]) if most.is_infinite() => format!(" (from {} on)", of(least)),
        Some([least, most]) => format!(" ({} to {})", of(least), of(most)),
        None => String::new(),
    };
    if even.rays.is_infinite() {
        return format!(
            "Its rays are no faster in most frames, so that no number of them is the break-even{interval}."
        );
    }
    let undecided = if even.interval.is_none() { ", of too few frames for an interval" } else { "" };
    format!("Break-even: {} rays a frame{interval}{undecided}.", of(even.rays))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::measurement::FrameOfClip;
    use crate::lab::sample::sample;

    fn row(policy: Policy, frame: usize, ready_ms: f64, ray_ns: f64) -> Measurement {
        let motion = FrameOfClip { policy, clip: "run".to_owned(), frame, time_s: frame as f32 * 0.5 };
        let row = Measurement { command: "animate".to_owned(), motion: Some(motion), ..sample() };
        let mut row = row.with(READY_MS, ready_ms).with(RAY_NS, ray_ns);
        row.values.set_spread(RAY_NS, Some([ray_ns - 1.0, ray_ns + 1.0]));
        row
    }

    /// 101 × 103 rays a frame: 10,403, so that 100 ns are 1 ms.
    fn tables(frames: usize, refit: impl Fn(usize) -> [f64; 2], rebuild: [f64; 2]) -> Vec<ReportTable> {
        let both = |frame| {
            let [[a, b], [c, d]] = [refit(frame), rebuild];
            [row(Policy::Refit, frame, a, b), row(Policy::Rebuild, frame, c, d)]
        };
        policy_tables(&(0..frames).flat_map(both).collect::<Vec<_>>())
    }

    fn assert_notes(table: &ReportTable, parts: &[&str]) {
        let text = table.notes.join("\n");
        for part in parts {
            assert!(text.contains(part), "{part} is missing in:\n{text}");
        }
    }

    #[test]
    fn findings_say_who_is_cheapest_and_when_rebuilding_pays() {
        let tables = tables(12, |frame| [1.0, if frame < 2 { 200.0 } else { 400.0 }], [3.0, 100.0]);
        let [table] = &tables[..] else { unreachable!("{tables:?}") };
        let start = "thing.obj, aac + hilbert + collapse, box: 12 frames of clip 'run' (";
        assert!(table.title.starts_with(start), "{}", table.title);
        assert_eq!(table.rows[1][..4], ["rebuild", "0.750", "0.750", "3.000"]);
        assert_eq!(table.rows[0].last().map(String::as_str), Some("5.161"));
        assert_notes(
            table,
            &[
                "With 10,403 rays a frame and over 12 frames, rebuild (4.040 ms) takes the least time of a frame; refit (5.161 ms) takes 1.277 \
                 times as long (1.277 to 1.277). The least was measured of rebuild in 10, refit in 2.",
                // 2 ms for 300 ns less.
                "Rebuilding would have paid against refit from frame 2 (1.000 s) to the end. Break-even: 6,667 rays a frame (6,667 to 20,000).",
            ],
        );
    }

    #[test]
    fn rebuilding_that_never_pays_has_a_break_even() {
        let slow = tables(12, |_| [1.0, 150.0], [3.0, 100.0]);
        assert_notes(
            &slow[0],
            &["Rebuilding never paid against refit. Break-even: 40,000 rays a frame (40,000 to 40,000)."],
        );
        let as_fast = tables(12, |_| [1.0, 100.0], [3.0, 100.0]);
        assert_notes(&as_fast[0], &["Rebuilding never paid against refit. Its rays are no faster in most frames"]);
    }

    #[test]
    fn noise_has_no_winner() {
        // In turn better and worse; and three frames decide nothing.
        let turns = tables(12, |frame| [1.0, if frame % 2 == 0 { 90.0 } else { 110.0 }], [1.0, 100.0]);
        assert_notes(
            &turns[0],
            &[
                "the least time of a frame is not decided between refit (2.040 ms), rebuild (2.040 ms). The least was measured of refit in 6, \
                 rebuild in 6.",
                "Not decided against refit: rebuilding took less time in 6 of 12 frames.",
            ],
        );
        let few = tables(3, |_| [1.0, 110.0], [1.0, 100.0]);
        assert_notes(&few[0], &["not decided between rebuild", "of too few frames for an interval"]);
    }
}
