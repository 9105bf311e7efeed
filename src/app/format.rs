//! Text for numbers: counts, durations, sizes, percentages. One function for each kind of quantity.

use std::time::Duration;

use serde_json::Value;

use crate::catalog::metrics::{Form, Metric};
use crate::catalog::numbers::{Digits, Number};
pub use crate::text::count;
use crate::text::{factor, whole};

/// A count with its noun, in the plural unless it is 1: `1 triangle`, `69,451 triangles`.
pub fn counted(value: u64, noun: &str) -> String {
    format!("{} {noun}{}", count(value), if value == 1 { "" } else { "s" })
}

/// A text with a capital letter at its beginning.
pub fn capital(text: &str) -> String {
    let mut rest = text.chars();
    rest.next().map_or_else(String::new, |first| first.to_uppercase().chain(rest).collect())
}

/// Three significant digits without an exponent: `0.0123`, `1.23`, `12.3`, `123`, `1,234`. Zero is `0`, NaN and infinities
/// are `–`.
pub fn significant(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let magnitude = value.abs();
    if magnitude == 0.0 {
        "0".to_owned()
    } else if magnitude >= 99.95 {
        let text = whole(magnitude);
        if value < 0.0 { format!("−{text}") } else { text }
    } else {
        let decimals = (2 - magnitude.log10().floor() as i32).clamp(1, 6) as usize;
        let text = format!("{magnitude:.decimals$}");
        if value < 0.0 { format!("−{text}") } else { text }
    }
}

/// The [`significant`] digits of a value that is one of `all`, with as many more as tell it apart from those of them that differ.
pub fn told_apart(value: f64, all: &[f64]) -> String {
    let text = significant(value);
    let nearest = all.iter().map(|other| (other - value).abs()).filter(|gap| *gap > 0.0).fold(f64::INFINITY, f64::min);
    if !nearest.is_finite() || all.iter().all(|other| *other == value || significant(*other) != text) {
        return text;
    }
    let decimals = (-nearest.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

/// A duration with its unit: `850 µs`, `12.3 ms`, `1.24 s`, `3 min 20 s`.
pub fn duration(value: Duration) -> String {
    let (number, unit) = duration_parts(value);
    format!("{number} {unit}")
}

/// The factor from seconds to the unit in which [`duration_parts`] shows `value`.
pub fn duration_scale(value: Duration) -> f64 {
    match duration_parts(value).1 {
        "µs" => 1e6,
        "ms" => 1e3,
        _ => 1.0,
    }
}

/// A duration as its number and its unit, for aligned columns.
pub fn duration_parts(value: Duration) -> (String, &'static str) {
    let seconds = value.as_secs_f64();
    if seconds >= 100.0 {
        let whole = seconds.round() as u64;
        (format!("{} min {}", whole / 60, whole % 60), "s")
    } else if seconds >= 0.999_5 {
        (significant(seconds), "s")
    } else if seconds >= 0.000_999_5 || seconds == 0.0 {
        (significant(seconds * 1e3), "ms")
    } else {
        (significant(seconds * 1e6), "µs")
    }
}

/// A number of the catalogue as the window writes it, without its unit; smallest, mean and largest between slashes.
pub fn of_number(number: &Number, value: &Value) -> String {
    let text = |value: f64| match number.digits {
        Digits::Count => whole(value),
        Digits::Bytes => bytes(value as usize),
        // Least and most are whole numbers beside a mean.
        _ if value.fract() == 0.0 && number.compared.is_none() => whole(value),
        _ => significant(value),
    };
    let parts = value.as_array().map_or_else(|| std::slice::from_ref(value), Vec::as_slice);
    let parts: Vec<String> = parts.iter().map(|part| part.as_f64().map_or_else(|| "–".to_owned(), text)).collect();
    parts.join(" / ")
}

/// A metric of a node as text: a share in percent, visits as a factor.
pub fn of_metric(metric: &Metric, value: f32) -> String {
    match metric.form {
        Form::Share => percent(f64::from(value)),
        Form::Ratio => format!("{} ×", significant(f64::from(value))),
        Form::Count => count(value as u64),
    }
}

/// A name within a sentence: "area growth", but "SAH cost".
pub fn lower(name: &str) -> String {
    let mut chars = name.chars();
    let (first, rest) = (chars.next(), chars.as_str());
    match first {
        Some(first) if !rest.starts_with(char::is_uppercase) => first.to_lowercase().chain(rest.chars()).collect(),
        _ => name.to_owned(),
    }
}

/// An age in whole seconds, minutes or hours: `12 s`, `3 min`, `2 h`.
pub fn age(value: Duration) -> String {
    match value.as_secs() {
        seconds @ 0..60 => format!("{seconds} s"),
        seconds @ 60..3600 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3600),
    }
}

/// A size in bytes with a binary unit: `812 B`, `12.3 KiB`, `1.20 GiB`.
pub fn bytes(value: usize) -> String {
    let (number, unit) = bytes_parts(value);
    format!("{number} {unit}")
}

/// A size in bytes as its number and its unit, for aligned columns.
pub fn bytes_parts(value: usize) -> (String, &'static str) {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut number = value as f64;
    let mut unit = 0;
    while number >= 1023.5 && unit + 1 < UNITS.len() {
        number /= 1024.0;
        unit += 1;
    }
    let text = if unit == 0 { value.to_string() } else { significant(number) };
    (text, UNITS[unit])
}

/// The rate of frames that follow each other after `seconds`: `24 frames a second`, `29.97 frames a second`.
pub fn frame_rate(seconds: f32) -> String {
    format!("{} frames a second", (100.0 / seconds).round() / 100.0)
}

/// A fraction between 0 and 1 as a percentage: `0.04 %`, `12.3 %`.
pub fn percent(fraction: f64) -> String {
    format!("{} %", significant(fraction * 100.0))
}

/// The relative change from `before` to `after` as a signed percentage, or as a factor from threefold on: `−12 %`, `+0.3 %`, `× 224`. Empty
/// where `before` is 0 or either is not finite.
pub fn change(before: f64, after: f64) -> String {
    if before == 0.0 || !before.is_finite() || !after.is_finite() {
        return String::new();
    }
    if let Some(factor) = factor(before, after) {
        return factor;
    }
    let percent = (after - before) / before.abs() * 100.0;
    let sign = if percent < 0.0 { '−' } else { '+' };
    let magnitude = percent.abs();
    if magnitude >= 9.95 { format!("{sign}{magnitude:.0} %") } else { format!("{sign}{magnitude:.1} %") }
}

/// Shortens `text` to at most `max_chars` characters by eliding its middle: `conference_ro…final.obj`. Both ends are kept because
/// they tell file names apart.
pub fn elide_middle(text: &str, max_chars: usize) -> String {
    let length = text.chars().count();
    if length <= max_chars || max_chars < 3 {
        return text.to_owned();
    }
    let tail = (max_chars - 1) / 2;
    let head = max_chars - 1 - tail;
    let start: String = text.chars().take(head).collect();
    let end: String = text.chars().skip(length - tail).collect();
    format!("{start}…{end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_thousands_separators() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(1_000), "1,000");
        assert_eq!(count(69_451), "69,451");
        assert_eq!(count(1_234_567), "1,234,567");
        assert_eq!(counted(1, "triangle"), "1 triangle");
        assert_eq!(counted(0, "triangle"), "0 triangles");
        assert_eq!(counted(1_000, "triangle"), "1,000 triangles");
    }

    #[test]
    fn numbers_keep_three_significant_digits() {
        let cases = [(0.0, "0"), (0.0123, "0.0123"), (1.234, "1.23"), (12.34, "12.3"), (99.96, "100")];
        for (value, text) in cases {
            assert_eq!(significant(value), text);
        }
        assert_eq!(significant(12_345.6), "12,346");
        assert_eq!(significant(-1.5), "−1.50");
        assert_eq!(significant(f64::NAN), "–");
    }

    #[test]
    fn numbers_that_differ_have_digits_enough() {
        let apart = |all: &[f64]| all.iter().map(|&value| told_apart(value, all)).collect::<Vec<_>>();
        assert_eq!(apart(&[0.305, 0.30691, 0.30712]), ["0.305", "0.3069", "0.3071"]);
        assert_eq!(apart(&[1.0, 1.0, 2.0]), ["1.00", "1.00", "2.00"]);
        assert_eq!(apart(&[-123.45, -123.41]), ["−123.45", "−123.41"]);
        assert_eq!(apart(&[f64::NAN, 1.0]), ["–", "1.00"]);
    }

    #[test]
    fn durations_choose_their_unit() {
        assert_eq!(duration(Duration::from_micros(12_340)), "12.3 ms");
        assert_eq!(duration(Duration::from_micros(850)), "850 µs");
        assert_eq!(duration(Duration::from_millis(1_240)), "1.24 s");
        assert_eq!(duration(Duration::from_secs(200)), "3 min 20 s");
        assert_eq!(duration(Duration::ZERO), "0 ms");
    }

    #[test]
    fn frame_rates_are_whole_where_they_can_be() {
        let rates = [0.04, 1.0 / 24.0, 1.0 / 29.97, 2.0].map(frame_rate);
        assert_eq!(rates, ["25", "24", "29.97", "0.5"].map(|rate| format!("{rate} frames a second")));
    }

    #[test]
    fn bytes_have_binary_units() {
        assert_eq!(bytes(812), "812 B");
        assert_eq!(bytes(12_595), "12.3 KiB");
        assert_eq!(bytes(1 << 20), "1.00 MiB");
    }

    #[test]
    fn changes_are_signed() {
        assert_eq!(change(36.1, 34.6), "−4.2 %");
        assert_eq!(change(2.0, 3.0), "+50 %");
        assert_eq!([change(1.0, 223.7), change(0.5, 1.5), change(448.0, 2.0)], ["× 224", "× 3.0", "÷ 224"]);
        assert_eq!(change(0.0, 3.0), "");
        assert_eq!(percent(0.123), "12.3 %");
    }

    #[test]
    fn long_names_lose_their_middle() {
        assert_eq!(elide_middle("short.obj", 20), "short.obj");
        let elided = elide_middle("conference_room_final.obj", 15);
        assert_eq!(elided.chars().count(), 15);
        assert!(elided.starts_with("confere") && elided.ends_with("al.obj"), "{elided}");
    }
}
