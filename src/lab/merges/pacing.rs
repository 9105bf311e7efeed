//! Which steps of a construction a film shows.

use super::key_frames::KeyFrame;

/// At most `frames` ascending steps from 0 to the last of `steps`: the number of active clusters falls by the same factor from
/// frame to frame, so that the end, where few large merges happen, gets its time; where they `are_splits`, it grows so, and the beginning
/// does. The frame nearest to a key frame shows just that.
pub fn paced_steps(steps: u32, are_splits: bool, frames: usize, key_frames: &[KeyFrame]) -> Vec<u32> {
    let frames = frames.clamp(2, steps as usize + 2);
    let last = (frames - 1) as f64;
    let all = f64::from(steps) + 1.0;
    let step = |frame: usize| {
        let part = frame as f64 / last;
        let standing = |exponent: f64| all.powf(exponent).round().clamp(1.0, all);
        if are_splits { standing(part) as u32 - 1 } else { (all - standing(1.0 - part)) as u32 }
    };
    let mut paced: Vec<u32> = (0..frames).map(step).collect();
    for key in key_frames.iter().map(|key| key.step).filter(|&step| step > 0 && step < steps) {
        let near = (1..paced.len().saturating_sub(1)).min_by_key(|&at| paced[at].abs_diff(key));
        if let Some(at) = near {
            paced[at] = key;
        }
    }
    paced.sort_unstable();
    paced.dedup();
    paced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_gets_as_many_frames_as_the_beginning() {
        let steps = paced_steps(999_999, false, 61, &[]);
        assert_eq!((steps.first(), steps.last()), (Some(&0), Some(&999_999)));
        assert!(steps.is_sorted_by(|a, b| a < b));
        let at_most_1000_left = steps.iter().filter(|&&step| step >= 999_000).count();
        assert!((25..=31).contains(&at_most_1000_left), "{at_most_1000_left} of {}", steps.len());
        let splits: Vec<u32> = paced_steps(999_999, true, 61, &[]).iter().rev().map(|step| 999_999 - step).collect();
        assert_eq!(splits, steps, "the other way round");
    }

    #[test]
    fn key_frames_are_shown_exactly() {
        let key = KeyFrame { step: 654_321, label: String::new() };
        assert!(paced_steps(999_999, false, 61, &[key]).contains(&654_321));
    }

    #[test]
    fn few_merges_make_few_frames() {
        assert_eq!(paced_steps(0, false, 60, &[]), [0]);
        assert_eq!(paced_steps(2, false, 60, &[]), [0, 1, 2]);
        assert_eq!(paced_steps(100, false, 0, &[]), [0, 100]);
    }
}
