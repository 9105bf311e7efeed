//! Tables and findings of `animate`: each policy over all frames.

use super::aligned::ReportTable;
use super::format::{conditions_and_threads, costs, models, name_among, number};
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{EPO, POPULATION_TESTS_PER_RAY, RAY_NS, READY_MS, SAH_COST, UPDATE_MS};
use crate::lab::measurement::{FrameOfClip, Measurement};
use crate::lab::motion::{FrameCost, break_even_rays, cheapest, mean, pays_from};
use crate::lab::population::Population;
use crate::text::{count, counted};
use bvhscope_engine::follow::{FRAMES_BEHIND, Policy};

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

    fn mean(&self, of: &Number) -> f64 {
        self.rows.iter().map(|row| row.number(of)).sum::<f64>() / self.rows.len().max(1) as f64
    }

    fn most(&self, of: &Number) -> f64 {
        self.rows.iter().map(|row| row.number(of)).fold(f64::NAN, f64::max)
    }

    /// Time of each frame, as far as it is known.
    fn costs(&self) -> Vec<FrameCost> {
        let cost = |row: &&Measurement| {
            let frame = row.motion.as_ref()?.frame;
            let [ready_ms, ray_ns] = [row.values.known(READY_MS)?, row.values.known(RAY_NS)?];
            let ray_spread_ns = row.values.spread(RAY_NS).map(|[fastest, slowest]| slowest - fastest);
            Some(FrameCost {
                frame,
                ready_ms,
                ray_ns,
                ray_spread_ns,
                tests: row.values.known(POPULATION_TESTS_PER_RAY),
            })
        };
        self.rows.iter().map_while(cost).collect()
    }

    fn mean_time(&self, rays: f64) -> f64 {
        let costs = self.costs();
        costs.iter().map(|cost| cost.time_ms(rays)).sum::<f64>() / costs.len().max(1) as f64
    }
}

/// A table for each model and container, with what its numbers say.
pub(super) fn policy_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let mut groups: Vec<Vec<&Measurement>> = Vec::new();
    for row in rows {
        let is_like = |group: &&mut Vec<&Measurement>| {
            group[0].model == row.model && group[0].container == row.container && group[0].builder == row.builder
        };
        match groups.iter_mut().find(is_like) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    let models = models(rows);
    let names = |row: &Measurement| {
        format!("{}, {}, {}", name_among(&row.model, &models), row.builder_name(), row.container.name())
    };
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
            line.push(number(followed.mean(of)));
            line.extend(has_most.then(|| number(followed.most(of))));
        }
        line.push(number(followed.mean_time(rays)));
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
            "Means over all frames. Update: of the binary tree; ready: and of the wide one, through which {} rays take the time under 'a \
             ray', all threads together; frame: ready and {} rays.",
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
    let least = cheapest(&costs, rays);
    if least.is_empty() || all.len() < 2 {
        return Vec::new();
    }
    let mut won: Vec<(usize, &Followed<'_>)> = all
        .iter()
        .enumerate()
        .map(|(index, followed)| (least.iter().filter(|&&policy| policy == index).count(), followed))
        .filter(|(frames, _)| *frames > 0)
        .collect();
    won.sort_by_key(|(frames, _)| std::cmp::Reverse(*frames));
    let shares: Vec<String> = won.iter().map(|(frames, one)| format!("{} in {frames}", one.policy.name())).collect();
    let mut findings = Vec::new();
    if let Some(fastest) = fastest(all, &costs, rays) {
        findings.push(format!(
            "With {} rays a frame, {fastest}; of {} the least is that of {}.",
            count(rays as u64),
            counted(least.len() as u64, "frames"),
            shares.join(", ")
        ));
    }
    let Some(rebuilt) = all.iter().position(|one| one.policy == Policy::Rebuild) else { return findings };
    for (index, followed) in all.iter().enumerate().filter(|(index, _)| *index != rebuilt) {
        // Others build too, at least in part.
        if !matches!(followed.policy, Policy::Keep | Policy::Refit | Policy::WholeClip) {
            continue;
        }
        findings.push(pays(followed, &costs[index], &costs[rebuilt], rays));
    }
    findings
}

/// The policies that take the least time on average: more than one where the spread of their times is larger than what they differ by.
fn fastest(all: &[Followed<'_>], costs: &[Vec<FrameCost>], rays: f64) -> Option<String> {
    let means: Vec<(Policy, FrameCost)> =
        all.iter().zip(costs).filter_map(|(followed, costs)| Some((followed.policy, mean(costs)?))).collect();
    let time = |cost: &FrameCost| cost.time_ms(rays);
    let (_, best) = means.iter().min_by(|a, b| time(&a.1).total_cmp(&time(&b.1)))?;
    let spread_ms = |cost: &FrameCost| rays * cost.ray_spread_ns.unwrap_or(0.0) * 1e-6;
    let is_as_fast = |cost: &FrameCost| time(cost) - time(best) <= spread_ms(cost).max(spread_ms(best));
    let least: Vec<&(Policy, FrameCost)> = means.iter().filter(|(_, cost)| is_as_fast(cost)).collect();
    if let [(policy, cost)] = least[..] {
        return Some(format!("{} takes the least time, {} ms a frame on average", policy.name(), number(time(cost))));
    }
    let names: Vec<String> =
        least.iter().map(|(policy, cost)| format!("{} ({} ms)", policy.name(), number(time(cost)))).collect();
    let names = names.join(", ");
    Some(format!("{names} take the least time on average, and differ by less than the spread of their times"))
}

/// When rebuilding would have paid against a tree that is never built again.
fn pays(followed: &Followed<'_>, costs: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> String {
    let name = followed.policy.name();
    let time = |frame: usize| {
        let motion = followed.rows.get(frame).and_then(|row| row.motion.as_ref());
        motion.map_or(f64::NAN, |motion| f64::from(motion.time_s))
    };
    if let Some(frame) = pays_from(costs, rebuilt, rays) {
        return format!("Rebuilding would have paid against {name} from frame {frame} ({} s) on.", number(time(frame)));
    }
    let frames = costs.len().min(rebuilt.len());
    let means = mean(&costs[..frames]).zip(mean(&rebuilt[..frames]));
    match means.and_then(|(followed, rebuilt)| break_even_rays(&followed, &rebuilt)) {
        Some(least) if least > rays => format!(
            "Rebuilding never paid against {name}: by the means over all frames it takes {} rays a frame.",
            count(least as u64)
        ),
        Some(_) => format!("Rebuilding and {name} take about the same time."),
        None => format!("Rebuilding never paid against {name}, whose rays are as fast."),
    }
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

    #[test]
    fn findings_say_who_is_cheapest_and_when_rebuilding_pays() {
        // 101 × 103 rays a frame: 10,403, so that 100 ns are 1 ms.
        let times = [[1.0, 100.0], [1.0, 200.0], [1.0, 400.0]];
        let mut rows = Vec::new();
        for (frame, [ready, ns]) in times.into_iter().enumerate() {
            rows.push(row(Policy::Refit, frame, ready, ns));
            rows.push(row(Policy::Rebuild, frame, 3.0, 100.0));
        }
        let tables = policy_tables(&rows);
        let [table] = &tables[..] else { unreachable!("{tables:?}") };
        let start = "thing.obj, aac + hilbert + collapse, box: 3 frames of clip 'run' (";
        assert!(table.title.starts_with(start), "{}", table.title);
        assert_eq!(table.rows[1][..4], ["rebuild", "0.750", "0.750", "3.000"]);
        assert_eq!(table.rows[0].last().map(String::as_str), Some("3.427"));
        let text = table.notes.join("\n");
        for part in [
            "With 10,403 rays a frame, refit takes the least time, 3.427 ms a frame on average; of 3 frames the least is that of refit in 2, \
             rebuild in 1.",
            "Rebuilding would have paid against refit from frame 2 (1.000 s) on.",
        ] {
            assert!(text.contains(part), "{part} is missing in:\n{text}");
        }
        let slow: Vec<Measurement> = rows.iter().filter(|row| row.number(RAY_NS) < 300.0).cloned().collect();
        let text = policy_tables(&slow)[0].notes.join("\n");
        assert!(
            text.contains(
                "Rebuilding never paid against refit: by the means over all frames it takes 40,000 rays a frame."
            ),
            "{text}"
        );
        let same: Vec<Measurement> = rows.iter().filter(|row| row.number(RAY_NS) < 200.0).cloned().collect();
        let text = policy_tables(&same)[0].notes.join("\n");
        assert!(text.contains("Rebuilding never paid against refit, whose rays are as fast."), "{text}");
        for row in &mut rows {
            row.values.set_spread(RAY_NS, Some([0.0, 1000.0]));
        }
        let text = policy_tables(&rows)[0].notes.join("\n");
        assert!(
            text.contains("refit (3.427 ms), rebuild (4.040 ms) take the least time on average, and differ"),
            "{text}"
        );
        assert!(text.contains("Rebuilding never paid against refit, whose rays are as fast."), "{text}");
    }
}
