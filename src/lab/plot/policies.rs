//! The charts of policies over the frames of a clip.

use super::axis::{Axis, Scale};
use super::chart::{Chart, Curve, Look, Point};
use super::series::{curves, series_name, value_axis};
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{EPO, POPULATION_TESTS_PER_RAY, RAY_NS, READY_MS, SAH_COST};
use crate::catalog::reading::Times;
use crate::lab::measurement::Measurement;

/// The numbers that are drawn, and the labels of their axes.
const QUANTITIES: [(&Number, &str); 5] = [
    (READY_MS, "Update until rays can be traced (ms)"),
    (POPULATION_TESTS_PER_RAY, "Tests per ray"),
    (RAY_NS, "Time of a ray (ns)"),
    (SAH_COST, "SAH cost"),
    (EPO, "End-point overlap"),
];

/// Part of a linear axis below which the curves without the farthest one are flattened by it.
const FLAT: f64 = 0.35;
/// Frames from which markers would cover the lines.
const MANY: usize = 40;

/// Each quantity over the time of the clip, one curve a policy; and the time of a frame with a ray for each pixel.
pub(super) fn policy_charts(rows: &[Measurement]) -> Vec<Chart> {
    let of_number = QUANTITIES.map(|(number, label)| {
        chart(rows, label, |row| Some((row.values.known(number)?, quartiles(row.rounds_of(number).to_vec()))))
    });
    let of_frame = chart(rows, "Frame with a ray for each pixel (ms)", |row| {
        let rays = f64::from(row.width_px) * f64::from(row.height_px);
        let frame_ms = |ready_ms: f64, ray_ns: f64| ready_ms + ray_ns * rays * 1e-6;
        let rounds = row.rounds_of(READY_MS).iter().zip(row.rounds_of(RAY_NS));
        let rounds = rounds.map(|(&ready_ms, &ray_ns)| frame_ms(ready_ms, ray_ns)).collect();
        Some((frame_ms(row.values.known(READY_MS)?, row.values.known(RAY_NS)?), quartiles(rounds)))
    });
    of_number.into_iter().chain([of_frame]).filter(|chart| !chart.curves.is_empty()).collect()
}

fn quartiles(rounds: Vec<f64>) -> Option<[f64; 2]> {
    Times::of(rounds).spread
}

/// `read` gives value and spread of a row.
fn chart(rows: &[Measurement], label: &str, read: impl Fn(&Measurement) -> Option<(f64, Option<[f64; 2]>)>) -> Chart {
    let is_one_tree = rows.iter().all(|row| row.view() == rows[0].view() && row.container == rows[0].container);
    let name = |row: &Measurement| {
        let policy = row.motion.as_ref().map_or("", |motion| motion.policy.label());
        if is_one_tree { policy.to_owned() } else { format!("{policy}, {}", series_name(row, rows)) }
    };
    let mut curves: Vec<Curve> = curves(rows, name, |row| {
        let (value, spread) = read(row).filter(|(value, _)| value.is_finite())?;
        Some(Point { spread, ..Point::of([f64::from(row.motion.as_ref()?.time_s), value]) })
    });
    for curve in curves.iter_mut().filter(|curve| curve.points.len() > MANY) {
        curve.look = Look::Line;
    }
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let axes = [Axis::linear(points().map(|point| point.x)), policy_axis(&curves)];
    let scale = if axes[1].scale == Scale::Log { ", logarithmic" } else { "" };
    let labels = ["Time of the clip (s)".to_owned(), format!("{label}{scale}")];
    Chart { title: String::new(), labels, axes, curves, rows: Vec::new() }
}

/// The axis up: logarithmic also where a single curve is so far from all others that it would flatten them.
fn policy_axis(curves: &[Curve]) -> Axis {
    let range = |left_out: Option<usize>| {
        let others = curves.iter().enumerate().filter(|(index, _)| Some(*index) != left_out);
        let values = others.flat_map(|(_, curve)| curve.points.iter().map(|point| point.y));
        let [low, high] =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
        [low, high - low]
    };
    let [least, all] = range(None);
    let is_flattened = curves.len() > 2 && (0..curves.len()).any(|index| range(Some(index))[1] < all * FLAT);
    if is_flattened && least > 0.0 {
        let points = curves.iter().flat_map(|curve| &curve.points);
        Axis::logarithmic(points.flat_map(|point| point.spread.into_iter().flatten().chain([point.y])))
    } else {
        value_axis(curves, |point| point.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::measurement::FrameOfClip;
    use crate::lab::plot::notes::notes;
    use crate::lab::sample::sample;
    use bvhscope_engine::follow::Policy;

    #[test]
    fn each_policy_is_a_curve_over_time() {
        let row = |policy, frame: usize| {
            let motion = FrameOfClip { policy, clip: "run".to_owned(), frame, time_s: frame as f32 * 0.5 };
            let row = Measurement { command: "animate".to_owned(), motion: Some(motion), ..sample() };
            let mut row = row.with(READY_MS, 2.0).with(RAY_NS, 100.0);
            row.rounds = [("ready_ms", vec![1.0, 2.0, 3.0]), ("ray_ns", vec![80.0, 100.0, 300.0])]
                .map(|(key, rounds)| (key.to_owned(), rounds))
                .into();
            row
        };
        let rows: Vec<Measurement> =
            (0..3).flat_map(|frame| [Policy::Refit, Policy::Rebuild].map(|policy| row(policy, frame))).collect();
        let charts = policy_charts(&rows);
        assert_eq!(charts.len(), 6);
        for chart in &charts {
            let names: Vec<&str> = chart.curves.iter().map(|curve| curve.name.as_str()).collect();
            assert_eq!(
                (names.as_slice(), chart.labels[0].as_str()),
                (&["Refit", "Rebuild"][..], "Time of the clip (s)")
            );
            let times: Vec<f64> = chart.curves[0].points.iter().map(|point| point.x).collect();
            assert_eq!(times, [0.0, 0.5, 1.0]);
        }
        // 101 × 103 rays of 100 ns.
        let point = charts[5].curves[1].points[2];
        assert!((point.y - 3.0403).abs() < 1e-9);
        // The upper quartile of 1.832, 3.040 and 6.121 ms.
        assert!(point.spread.is_some_and(|[_, upper]| (upper - 4.580_6).abs() < 1e-4), "{point:?}");
        assert_eq!(charts[2].curves[0].points[0].spread, Some([90.0, 200.0]));
        assert_eq!(charts[0].curves[0].points[0].spread, Some([1.5, 2.5]));
        let notes = notes(&rows, &charts);
        assert!(notes[0].starts_with("thing.obj, 7,001 triangles, clip 'run', boxes. "), "{notes:?}");
        assert!(notes.iter().any(|note| note.contains("quartiles of the rounds")), "{notes:?}");
        assert!(!notes.iter().any(|note| note.contains("predictions")), "{notes:?}");
    }

    #[test]
    fn a_policy_far_from_all_others_makes_the_axis_logarithmic() {
        let curve = |name: &str, values: [f64; 2]| Curve {
            name: name.to_owned(),
            color: 0,
            look: Look::Measured,
            points: values.map(|value| Point::of([value, value])).into(),
        };
        let near = [curve("refit", [20.0, 24.0]), curve("rebuild", [19.0, 22.0])];
        assert_eq!(policy_axis(&near).scale, Scale::Linear);
        let far = [near.to_vec(), vec![curve("keep", [21.0, 128.0])]].concat();
        assert_eq!(policy_axis(&far).scale, Scale::Log);
    }
}
