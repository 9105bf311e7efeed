//! When rebuilding pays: the time of a frame is that of the update and of its rays.

/// A tree in a frame, as far as time goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameCost {
    /// The frame, from 0.
    pub frame: usize,
    /// Time in milliseconds until rays can be traced.
    pub ready_ms: f64,
    /// Time of a ray in nanoseconds.
    pub ray_ns: f64,
    /// Slowest minus fastest repetition of that; `None` where it was measured once.
    pub ray_spread_ns: Option<f64>,
    /// Containers and triangles that a ray is tested against, where they were counted.
    pub tests: Option<f64>,
}

impl FrameCost {
    /// Time in milliseconds of the update and of `rays` rays.
    pub fn time_ms(&self, rays: f64) -> f64 {
        self.ready_ms + rays * self.ray_ns * 1e-6
    }

    /// Time in nanoseconds by which a ray takes longer than in `other`. Tests decide where the times differ by no more than their
    /// spread, or have none, at the price that a test has in both trees.
    fn slower_ns(&self, other: &Self) -> f64 {
        let difference = self.ray_ns - other.ray_ns;
        let spread = self.ray_spread_ns.zip(other.ray_spread_ns).map(|(own, others)| own.max(others));
        if spread.is_some_and(|spread| difference.abs() > spread) {
            return difference;
        }
        match self.tests.zip(other.tests) {
            Some((own, others)) if own + others > 0.0 => (own - others) * (self.ray_ns + other.ray_ns) / (own + others),
            _ if spread.is_some() => 0.0,
            _ => difference,
        }
    }
}

/// The mean over `frames`, whose number is that of the first; `None` of none.
pub fn mean(frames: &[FrameCost]) -> Option<FrameCost> {
    let over_all = |of: fn(&FrameCost) -> Option<f64>| -> Option<f64> {
        let values: Vec<f64> = frames.iter().map(of).collect::<Option<_>>()?;
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    Some(FrameCost {
        frame: frames.first()?.frame,
        ready_ms: over_all(|cost| Some(cost.ready_ms))?,
        ray_ns: over_all(|cost| Some(cost.ray_ns))?,
        ray_spread_ns: over_all(|cost| cost.ray_spread_ns),
        tests: over_all(|cost| cost.tests),
    })
}

/// The median update time of the frame at `at` and its neighbours in milliseconds, of two the lower: their work is much the same, so that a
/// single update that was disturbed decides nothing.
fn usual_ready_ms(frames: &[FrameCost], at: usize) -> f64 {
    let near = &frames[at.saturating_sub(1)..frames.len().min(at + 2)];
    let mut times: Vec<f64> = near.iter().map(|cost| cost.ready_ms).collect();
    times.sort_by(f64::total_cmp);
    times[(times.len() - 1) / 2]
}

/// True if policy `a` takes less time than `b` for the update and `rays` rays of the frame at `at`, which both have.
fn is_cheaper(a: &[FrameCost], b: &[FrameCost], at: usize, rays: f64) -> bool {
    usual_ready_ms(a, at) + rays * a[at].slower_ns(&b[at]) * 1e-6 < usual_ready_ms(b, at)
}

/// For each frame in turn, the index of the policy whose update and `rays` rays take the least time, the first of equal ones.
/// `policies` have the frames of each, in order; frames that one lacks are left out.
pub fn cheapest(policies: &[Vec<FrameCost>], rays: f64) -> Vec<usize> {
    let frames = policies.iter().map(Vec::len).min().unwrap_or(0);
    let of_frame = |at: usize| {
        let better = |best: usize, other: usize| {
            if is_cheaper(&policies[other], &policies[best], at, rays) { other } else { best }
        };
        (1..policies.len()).fold(0, better)
    };
    (0..frames).map(of_frame).collect()
}

/// The first frame in which `rebuilt`, with its update, takes less time than `followed` for `rays` rays: from there on rebuilding would
/// have paid. `None` where it never does.
pub fn pays_from(followed: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> Option<usize> {
    let frames = followed.len().min(rebuilt.len());
    (0..frames).find(|&at| is_cheaper(rebuilt, followed, at, rays)).map(|at| followed[at].frame)
}

/// The rays of a frame above which `rebuilt` takes less time than `followed`; `None` where its rays are no faster. 0 where its update is
/// not slower either.
pub fn break_even_rays(followed: &FrameCost, rebuilt: &FrameCost) -> Option<f64> {
    let gain_ns = followed.slower_ns(rebuilt);
    (gain_ns > 0.0).then(|| ((rebuilt.ready_ms - followed.ready_ms) * 1e6 / gain_ns).max(0.0))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn costs(of: [[f64; 2]; 3]) -> Vec<FrameCost> {
        let cost = |([ready_ms, ray_ns], frame): ([f64; 2], usize)| FrameCost {
            frame,
            ready_ms,
            ray_ns,
            ray_spread_ns: None,
            tests: None,
        };
        of.into_iter().zip(0..).map(cost).collect()
    }

    #[test]
    fn rebuilding_pays_once_rays_lose_more_than_a_build() {
        let refit = costs([[1.0, 100.0], [1.0, 110.0], [1.0, 150.0]]);
        let rebuild = costs([[11.0, 100.0], [11.0, 100.0], [11.0, 100.0]]);
        // 10 ms more for 10 ns and 50 ns less: a million rays, and 200,000.
        let break_even = |frame: usize| break_even_rays(&refit[frame], &rebuild[frame]);
        assert_eq!([0, 1, 2].map(break_even), [None, Some(1e6), Some(2e5)]);
        let at = |rays| pays_from(&refit, &rebuild, rays);
        assert_eq!([1e5, 3e5, 9e5, 2e6].map(at), [None, Some(2), Some(2), Some(1)]);
        let both = [refit.clone(), rebuild.clone()];
        assert_eq!(cheapest(&both, 1e5), [0, 0, 0]);
        assert_eq!(cheapest(&both, 3e5), [0, 0, 1]);
        assert_eq!(cheapest(&both, 2e6), [0, 1, 1]);
        assert_eq!(cheapest(&[refit.clone(), rebuild[..1].to_vec()], 2e6), [0], "of whole frames only");
        assert_eq!(break_even_rays(&rebuild[2], &FrameCost { ready_ms: 2.0, ray_ns: 1.0, ..refit[0] }), Some(0.0));
        assert!(cheapest(&[], 1.0).is_empty());
    }

    #[test]
    fn noise_decides_nothing() {
        let noisy = |of: [[f64; 2]; 3], tests: f64| {
            let cost = |cost: FrameCost| FrameCost { ray_spread_ns: Some(30.0), tests: Some(tests), ..cost };
            costs(of).into_iter().map(cost).collect::<Vec<_>>()
        };
        // Rays seem slower and faster in turn; an update was disturbed.
        let refit = noisy([[1.0, 120.0], [40.0, 100.0], [1.0, 120.0]], 20.0);
        let rebuild = noisy([[3.0, 100.0], [3.0, 120.0], [3.0, 100.0]], 20.0);
        assert_eq!(pays_from(&refit, &rebuild, 1e9), None, "a ray has as many tests");
        assert_eq!(cheapest(&[refit.clone(), rebuild.clone()], 1e9), [0; 3]);
        assert_eq!(break_even_rays(&mean(&refit).unwrap(), &mean(&rebuild).unwrap()), None);
        let fewer = noisy([[3.0, 100.0], [3.0, 120.0], [3.0, 100.0]], 10.0);
        assert_eq!(pays_from(&refit, &fewer, 1e6), Some(0), "counts decide");
        // Beyond the spread, times do.
        let slow = noisy([[1.0, 200.0], [1.0, 200.0], [1.0, 200.0]], 20.0);
        assert_eq!(break_even_rays(&mean(&slow).unwrap(), &FrameCost { ray_ns: 100.0, ..rebuild[0] }), Some(2e4));
    }
}
