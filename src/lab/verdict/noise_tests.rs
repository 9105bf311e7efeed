//! Proof that words hold: two trees of made times under noise, a hundred times each.

use std::cmp::Ordering;

use super::{Factor, Order};

/// Comparisons of each kind.
const RUNS: u32 = 100;

/// Random numbers by xorshift (Marsaglia 2003).
struct Random(u64);

impl Random {
    /// Evenly distributed from 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Roughly normal, with variance 1 (twelve even ones).
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// The factor on a time that is sampled at a moment from 0 to 1; `burst` is the state of a disturbance that lasts.
type Noise = fn(&mut Random, moment: f64, burst: &mut f64) -> f64;

const MODELS: [(&str, Noise); 5] = [
    ("steady", |random, _, _| 1.0 + 0.02 * random.normal()),
    ("drift", |random, moment, _| (1.0 + 0.5 * moment) * (1.0 + 0.02 * random.normal())),
    ("waves", |random, moment, _| (1.0 + 0.2 * (moment * 40.0).sin()) * (1.0 + 0.02 * random.normal())),
    ("bursts", |random, _, burst| {
        // A tenth of the samples begins a disturbance of about three that doubles times.
        *burst = if random.next() < 0.1 {
            1.0
        } else if random.next() < 0.35 {
            0.0
        } else {
            *burst
        };
        (1.0 + *burst * random.next()) * (1.0 + 0.02 * random.normal())
    }),
    // A Pareto tail without a variance: one sample in a hundred takes five times as long.
    ("heavy tail", |random, _, _| 1.0 + 0.02 * (1.0 / (1.0 - random.next()).max(1e-9)).powf(1.0 / 0.9)),
];

/// The samples of two trees in `rounds` rounds, taken in turn, in another order each second round.
fn measured(random: &mut Random, noise: Noise, rounds: usize, factor: f64) -> [Vec<f64>; 2] {
    let (mut lists, mut burst) = ([Vec::new(), Vec::new()], 0.0);
    for round in 0..rounds {
        for turn in 0..2 {
            let tree = (turn + round) % 2;
            let moment = (2 * round + turn) as f64 / (2 * rounds) as f64;
            lists[tree].push(5.0 * if tree == 1 { factor } else { 1.0 } * noise(random, moment, &mut burst));
        }
    }
    lists
}

/// In how many runs B is called slower, and faster.
fn words(name: &str, noise: Noise, rounds: usize, factor: f64) -> [usize; 2] {
    let seed = name
        .bytes()
        .fold(0x9e37_79b9_7f4a_7c15_u64, |seed, byte| (seed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let (mut random, mut found) = (Random(seed | 1), [0; 2]);
    for _ in 0..RUNS {
        let [a, b] = measured(&mut random, noise, rounds, factor);
        match Factor::of(&a, &b, Order::InTurn).and_then(|factor| factor.decided()) {
            Some(Ordering::Greater) => found[0] += 1,
            Some(_) => found[1] += 1,
            None => {}
        }
    }
    found
}

#[test]
fn one_tree_measured_twice_is_seldom_called_two() {
    for (name, noise) in MODELS {
        for rounds in [3, 5, 9, 30, 101] {
            let [slower, faster] = words(name, noise, rounds, 1.0);
            assert!(slower + faster <= 5, "{name}, {rounds} rounds: {slower} slower, {faster} faster");
        }
    }
}

#[test]
fn three_percent_are_found_under_each_noise() {
    for (name, noise) in MODELS {
        let [slower, faster] = words(name, noise, 101, 1.03);
        assert!(slower >= 90 && faster == 0, "{name}: {slower} slower, {faster} faster");
    }
}

#[test]
fn three_rounds_call_nothing_and_nine_a_factor() {
    for (name, noise) in MODELS {
        assert_eq!(words(name, noise, 3, 1.03), [0; 2], "{name}");
        let [slower, faster] = words(name, noise, 9, 2.6);
        assert!(slower >= 95 && faster == 0, "{name}: {slower} slower, {faster} faster");
    }
}
