//! Which policy takes the least time, and when rebuilding pays: the time of a frame is that of the update and of its rays.

use crate::catalog::reading::quantile;
use crate::lab::verdict::{Factor, LEAST_PAIRS, Order, median_interval};

/// A tree in a frame, as far as time goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameCost {
    /// The frame, from 0.
    pub frame: usize,
    /// Time in milliseconds until rays can be traced.
    pub ready_ms: f64,
    /// Time of a ray in nanoseconds.
    pub ray_ns: f64,
}

impl FrameCost {
    /// Time in milliseconds of the update and of `rays` rays.
    pub fn time_ms(&self, rays: f64) -> f64 {
        self.ready_ms + rays * self.ray_ns * 1e-6
    }
}

/// The times of each frame in milliseconds.
fn times(frames: &[FrameCost], rays: f64) -> Vec<f64> {
    frames.iter().map(|cost| cost.time_ms(rays)).collect()
}

/// For each frame in turn, the index of the policy whose update and `rays` rays were measured to take the least time, the first of equal
/// ones. `policies` have the frames of each, in order; frames that one lacks are left out.
pub fn cheapest(policies: &[Vec<FrameCost>], rays: f64) -> Vec<usize> {
    let frames = policies.iter().map(Vec::len).min().unwrap_or(0);
    let of_frame = |at: usize| {
        let time = |policy: usize| policies[policy][at].time_ms(rays);
        (1..policies.len()).fold(0, |best, other| if time(other) < time(best) { other } else { best })
    };
    (0..frames).map(of_frame).collect()
}

/// The factor of the times of `b` over those of `a` with `rays` rays, frame by frame.
pub fn factor(a: &[FrameCost], b: &[FrameCost], rays: f64) -> Option<Factor> {
    Factor::of(&times(a, rays), &times(b, rays), Order::InTurn)
}

/// The policy that takes the least time over all frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    /// Its index.
    pub policy: usize,
    /// The other policies that are not decided to take more, in the order given.
    pub rivals: Vec<usize>,
}

/// The policy with the least sum of times, and those that it does not beat for certain, frame by frame; `None` of fewer than two.
pub fn least(policies: &[Vec<FrameCost>], rays: f64) -> Option<Least> {
    let sum = |policy: &usize| times(&policies[*policy], rays).iter().sum::<f64>();
    let policy = (0..policies.len()).min_by(|a, b| sum(a).total_cmp(&sum(b))).filter(|_| policies.len() > 1)?;
    let takes_more = |other: usize| {
        let factor = factor(&policies[policy], &policies[other], rays);
        factor.and_then(|factor| factor.decided()) == Some(std::cmp::Ordering::Greater)
    };
    let rivals = (0..policies.len()).filter(|&other| other != policy && !takes_more(other)).collect();
    Some(Least { policy, rivals })
}

/// In how many frames `rebuilt`, with its update, takes less time than `followed` for `rays` rays.
pub fn cheaper_in(followed: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> usize {
    followed.iter().zip(rebuilt).filter(|(followed, rebuilt)| rebuilt.time_ms(rays) < followed.time_ms(rays)).count()
}

/// The first frame from which on `rebuilt`, with its update, takes less time than `followed` in each to the end: from there rebuilding would
/// have paid. `None` where that is no frame, and where so few are left that chance does the same.
pub fn pays_from(followed: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> Option<usize> {
    let frames = followed.len().min(rebuilt.len());
    let pays = |at: &usize| rebuilt[*at].time_ms(rays) < followed[*at].time_ms(rays);
    let count = (0..frames).rev().take_while(pays).count();
    (count >= LEAST_PAIRS).then(|| followed[frames - count].frame)
}

/// The rays of a frame above which rebuilding takes less time.
#[derive(Debug, Clone, PartialEq)]
pub struct BreakEven {
    /// The median over the frames of the quotient of what the update takes more and a ray takes less; infinite where in most frames rays are
    /// no faster.
    pub rays: f64,
    /// The interval in which it is; infinite ends as above, `None` of too few frames.
    pub interval: Option<[f64; 2]>,
    /// Number of frames.
    pub frames: usize,
}

/// The break-even of `rebuilt` against `followed`, frame by frame; `None` without frames.
pub fn break_even(followed: &[FrameCost], rebuilt: &[FrameCost]) -> Option<BreakEven> {
    let rays = |(followed, rebuilt): (&FrameCost, &FrameCost)| {
        let [more_ms, gain_ns] = [rebuilt.ready_ms - followed.ready_ms, followed.ray_ns - rebuilt.ray_ns];
        if gain_ns > 0.0 { (more_ms * 1e6 / gain_ns).max(0.0) } else { f64::INFINITY }
    };
    let mut all: Vec<f64> = followed.iter().zip(rebuilt).map(rays).collect();
    all.sort_by(f64::total_cmp);
    let (interval, frames) = (median_interval(&all), all.len());
    (frames > 0).then(|| BreakEven { rays: quantile(&all, 0.5), interval, frames })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn costs(of: &[[f64; 2]]) -> Vec<FrameCost> {
        of.iter().zip(0..).map(|(&[ready_ms, ray_ns], frame)| FrameCost { frame, ready_ms, ray_ns }).collect()
    }

    /// A refitted tree whose rays take longer from frame to frame, and one that is built anew.
    fn clip() -> [Vec<FrameCost>; 2] {
        let refit: Vec<[f64; 2]> = (0..20).map(|frame| [1.0, 100.0 + 5.0 * f64::from(frame)]).collect();
        [costs(&refit), costs(&[[11.0, 100.0]; 20])]
    }

    #[test]
    fn rebuilding_pays_from_a_frame_on_only_where_it_does_in_each_to_the_end() {
        let [mut refit, rebuild] = clip();
        // 10 ms more for 5 ns less a frame: with 200,000 rays beyond the tenth frame.
        assert_eq!(pays_from(&refit, &rebuild, 2e5), Some(11));
        assert_eq!(cheaper_in(&refit, &rebuild, 2e5), 9);
        refit[15].ray_ns = 100.0;
        assert_eq!(pays_from(&refit, &rebuild, 2e5), None, "four frames are chance");
        assert_eq!(cheaper_in(&refit, &rebuild, 2e5), 8);
        assert_eq!(pays_from(&refit, &rebuild, 1e9), None);
        assert_eq!(pays_from(&refit, &refit, 1e9), None);
    }

    #[test]
    fn break_even_follows_from_the_rows() {
        let [refit, rebuild] = clip();
        // 10 ms over 0, 5, … 95 ns: infinite, 2e6, … 2e6 / 19; the median between 2e6 / 9 and 2e6 / 10, and 4 left out at each end.
        let found = break_even(&refit, &rebuild).unwrap();
        assert!((found.rays - 2e6 * (1.0 / 9.0 + 0.1) / 2.0).abs() < 1e-3, "{found:?}");
        let [least, most] = found.interval.unwrap();
        assert!((least - 2e6 / 16.0).abs() < 1e-3 && (most - 2e6 / 3.0).abs() < 1e-3, "{found:?}");
        assert_eq!(found.frames, 20);
        assert_eq!(break_even(&rebuild, &refit).map(|found| found.rays), Some(f64::INFINITY));
        assert_eq!(break_even(&refit[..3], &rebuild[..3]).and_then(|found| found.interval), None);
        assert_eq!(break_even(&[], &[]), None);
    }

    #[test]
    fn the_least_time_is_decided_frame_by_frame() {
        let [refit, rebuild] = clip();
        let noise = |frames: &[FrameCost], steps: [f64; 2]| -> Vec<FrameCost> {
            let step = |cost: &FrameCost| steps[cost.frame % 2];
            frames.iter().map(|cost| FrameCost { ready_ms: cost.ready_ms + step(cost), ..*cost }).collect()
        };
        // In turn better and worse than refitting; and steadily worse, but for one frame that was disturbed.
        let alike = noise(&refit, [0.1, -0.1]);
        let mut worse = noise(&refit, [0.2, 0.2]);
        worse[3].ready_ms = 0.5;
        let all = [rebuild.clone(), refit.clone(), alike, worse];
        assert_eq!(least(&all, 1e3), Some(Least { policy: 1, rivals: vec![2] }));
        assert_eq!(cheapest(&all[..2], 2e5), [[1; 10].as_slice(), &[0; 10]].concat());
        assert_eq!(cheapest(&[rebuild[..1].to_vec(), refit.clone()], 1e9), [1], "of whole frames only");
        assert_eq!(least(&all[..1], 1e3), None);
        assert!(cheapest(&[], 1.0).is_empty());
    }
}
