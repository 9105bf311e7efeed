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
}

impl FrameCost {
    /// Time in milliseconds of the update and so many rays.
    pub fn time_ms(&self, rays: f64) -> f64 {
        self.ready_ms + rays * self.ray_ns * 1e-6
    }
}

/// For each frame in turn, the index of the policy whose update and `rays` rays take the least time. `policies` have the frames of each, in
/// order; frames that one lacks are left out.
pub fn cheapest(policies: &[Vec<FrameCost>], rays: f64) -> Vec<usize> {
    let frames = policies.iter().map(Vec::len).min().unwrap_or(0);
    let of_frame = |frame: usize| {
        let time = |policy: usize| policies[policy][frame].time_ms(rays);
        (0..policies.len()).min_by(|&a, &b| time(a).total_cmp(&time(b)))
    };
    (0..frames).filter_map(of_frame).collect()
}

/// The first frame in which `rebuilt`, with its update, takes less time than `followed` for so many rays: from there on rebuilding would
/// have paid. `None` where it never does.
pub fn pays_from(followed: &[FrameCost], rebuilt: &[FrameCost], rays: f64) -> Option<usize> {
    let mut pairs = followed.iter().zip(rebuilt);
    pairs.find(|(followed, rebuilt)| rebuilt.time_ms(rays) < followed.time_ms(rays)).map(|(pair, _)| pair.frame)
}

/// The rays of a frame above which `rebuilt` takes less time than `followed`; `None` where its rays are no faster. 0 where its update is
/// not slower either.
pub fn break_even_rays(followed: &FrameCost, rebuilt: &FrameCost) -> Option<f64> {
    let gain_ns = followed.ray_ns - rebuilt.ray_ns;
    (gain_ns > 0.0).then(|| ((rebuilt.ready_ms - followed.ready_ms) * 1e6 / gain_ns).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn costs(of: [[f64; 2]; 3]) -> Vec<FrameCost> {
        of.into_iter().zip(0..).map(|([ready_ms, ray_ns], frame)| FrameCost { frame, ready_ms, ray_ns }).collect()
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
}
