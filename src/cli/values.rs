//! Parsers of flag values. Each error states what was expected; clap adds the flag and the given text.

pub use crate::text::{parse_direction as direction, parse_vector as vector};

use super::named::{Named, named};
#[cfg(feature = "gui")]
use crate::app::SharedState;
use crate::budget::MemoryLimit;
use crate::catalog::settings::Limits;
use crate::scene::SceneSource;
use crate::view::NamedView;

/// Maximum width and height of a picture in pixels.
pub const MAX_SIDE: u32 = 16_384;
/// Maximum number of threads.
pub const MAX_THREADS: usize = 1024;
/// Maximum number of repetitions of a measurement.
pub const MAX_REPEAT: usize = 1000;

/// Values of a setting that is a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers(pub Vec<f32>);

/// Parses an integer in `low..=high`.
pub fn whole<T>(text: &str, low: T, high: T) -> Result<T, String>
where
    T: std::str::FromStr + PartialOrd + std::fmt::Display,
{
    match text.parse::<T>() {
        Ok(value) if low <= value && value <= high => Ok(value),
        _ => Err(format!("a whole number from {low} to {high} is expected")),
    }
}

/// Values of an axis, each once.
#[derive(Debug, Clone)]
pub struct List<T>(pub Vec<T>);

impl<T: Copy + PartialEq> List<T> {
    /// Those of a comma-separated list, or `all`.
    fn parse(text: &str, all: &[T], value: impl Fn(&str) -> Result<T, String>) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self(all.to_vec()));
        }
        let mut list = Vec::new();
        for part in text.split(',') {
            let value = value(part)?;
            if !list.contains(&value) {
                list.push(value);
            }
        }
        Ok(Self(list))
    }
}

/// Parses a list of how far trees over copies are opened.
pub fn openings(text: &str) -> Result<List<f32>, String> {
    let mut list = List::parse(text, &[1.0, 1.5, 2.0, 3.0, 4.0, 8.0], |text| decimal(text, 1.0, 64.0))?;
    list.0.sort_by(f32::total_cmp);
    Ok(list)
}

/// Parses a comma-separated list of values of `T`, or `all`.
pub fn named_list<T: Named + PartialEq>(text: &str) -> Result<List<T>, String> {
    List::parse(text, T::VALUES, named)
}

/// Parses a comma-separated list of whole numbers within limits, or `all`.
pub fn number_list(text: &str, [low, high]: [u32; 2], all: &[u32]) -> Result<List<u32>, String> {
    List::parse(text, all, |part| whole(part, low, high))
}

/// A value of `--camera`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewArg {
    Named(NamedView),
    /// A camera of the file, counted from 0.
    OfFile(usize),
}

/// Parses the name of a view, or the number of a camera of the file.
pub fn view(text: &str) -> Result<ViewArg, String> {
    match text.parse() {
        Ok(index) => Ok(ViewArg::OfFile(index)),
        Err(_) => named(text).map(ViewArg::Named),
    }
}

/// Parses `on` or `off`.
pub fn on_or_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("on or off is expected".to_owned()),
    }
}

/// Parses a decimal number in `low..=high`.
pub fn decimal(text: &str, low: f32, high: f32) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if low <= value && value <= high => Ok(value),
        _ => Err(format!("a number from {low} to {high} is expected")),
    }
}

/// Parses values of a setting, `6` or `2,4,8`, or where it has whole numbers, a range with both ends, `2..32` or `2..=32`. Whole
/// numbers are sorted, each once.
pub fn numbers(limits: &Limits, text: &str) -> Result<Numbers, String> {
    let is_whole = limits.decimals == 0;
    if let Some((first, last)) = text.split_once("..").filter(|_| is_whole) {
        let last = last.strip_prefix('=').unwrap_or(last);
        let [from, to] = [first, last].map(|end| end.parse::<u32>().ok());
        if from.is_some() && to.is_some() && from > to {
            return Err("the range is reversed: write it as SMALLEST..LARGEST".to_owned());
        }
        let (first, last) = (limits.parse(first)?, limits.parse(last)?);
        return Ok(Numbers((first as u32..=last as u32).map(|value| value as f32).collect()));
    }
    let mut values = text.split(',').map(|text| limits.parse(text)).collect::<Result<Vec<_>, _>>()?;
    if is_whole {
        values.sort_by(f32::total_cmp);
        values.dedup();
    }
    Ok(Numbers(values))
}

pub fn threads(text: &str) -> Result<usize, String> {
    whole(text, 1, MAX_THREADS)
}

pub fn repeat(text: &str) -> Result<usize, String> {
    whole(text, 1, MAX_REPEAT)
}

/// Parses `X,Y`: column and row of a pixel, from 0.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| whole::<u32>(text.trim(), 0, MAX_SIDE - 1).ok();
    let parts = text.split_once(',').and_then(|(x, y)| Some([side(x)?, side(y)?]));
    parts.ok_or_else(|| {
        "column and row X,Y of a pixel, from 0 at the upper left, are expected, as in 640,360".to_owned()
    })
}

/// Parses an angle in degrees; returns radians.
pub fn fov(text: &str) -> Result<f32, String> {
    decimal(text, 1.0, 170.0).map_err(|_| "degrees from 1 to 170 are expected".to_owned()).map(f32::to_radians)
}

/// A state that Ctrl+L of the window copied.
#[cfg(feature = "gui")]
pub fn shared_state(text: &str) -> Result<Box<SharedState>, String> {
    SharedState::parse(text).map(Box::new)
}

/// Parses `WxH` in pixels.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X']).and_then(|(width, height)| {
        let side = |text| whole::<u32>(text, 1, MAX_SIDE).ok();
        Some([side(width)?, side(height)?])
    });
    parts.ok_or_else(|| format!("WIDTHxHEIGHT in pixels, each from 1 to {MAX_SIDE}, is expected, as in 1280x720"))
}

/// Parses `4GB`, `500MB` or `50%`; units are powers of 1000, or of 1024 with an i (`4GiB`).
pub fn memory(text: &str) -> Result<MemoryLimit, String> {
    let expected = || "a size from 16MB on, as in 4GB or 500MB, or a fraction from 1% to 100% is expected".to_owned();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let number: f64 = number.parse().map_err(|_| expected())?;
    let power = |base: f64, power: i32| Some(number * base.powi(power));
    let bytes = match unit.trim().to_ascii_lowercase().as_str() {
        "%" if (1.0..=100.0).contains(&number) => return Ok(MemoryLimit::Fraction(number / 100.0)),
        "b" => Some(number),
        "k" | "kb" => power(1000.0, 1),
        "m" | "mb" => power(1000.0, 2),
        "g" | "gb" => power(1000.0, 3),
        "t" | "tb" => power(1000.0, 4),
        "kib" => power(1024.0, 1),
        "mib" => power(1024.0, 2),
        "gib" => power(1024.0, 3),
        "tib" => power(1024.0, 4),
        _ => None,
    };
    bytes
        .filter(|bytes| (16e6..1e18).contains(bytes))
        .map(|bytes| MemoryLimit::Bytes(bytes as u64))
        .ok_or_else(expected)
}

/// Parses a time in seconds.
pub fn seconds(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|seconds: &f32| seconds.is_finite())
        .ok_or_else(|| "a time in seconds is expected".to_owned())
}

/// Parses frames a second.
pub fn fps(text: &str) -> Result<f32, String> {
    decimal(text, 0.01, 1000.0)
}

/// Parses the index of a node.
pub fn node(text: &str) -> Result<u32, String> {
    whole(text, 0, u32::MAX)
}

/// Parses `I/N`: the I-th of N shards, counted from 1.
pub fn shard(text: &str) -> Result<(usize, usize), String> {
    let expected = || "I/N with 1 <= I <= N is expected, as in 2/8".to_owned();
    let (index, count) = text.split_once('/').ok_or_else(expected)?;
    match (index.parse::<usize>(), count.parse::<usize>()) {
        (Ok(index), Ok(count)) if 1 <= index && index <= count && count <= 1_000_000 => Ok((index, count)),
        _ => Err(expected()),
    }
}

/// Parser of a model argument, which may be any bytes that a file name may have.
#[derive(Debug, Clone)]
pub struct ModelParser;

impl clap::builder::TypedValueParser for ModelParser {
    type Value = SceneSource;

    fn parse_ref(
        &self,
        command: &clap::Command,
        _arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<Self::Value, clap::Error> {
        SceneSource::parse(value).map_err(|message| {
            clap::Error::raw(clap::error::ErrorKind::ValueValidation, format!("{message}\n")).with_cmd(command)
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;
    use crate::catalog::settings::{EPSILON, Setting, THRESHOLD, Value};

    fn numbers_of(setting: &Setting, text: &str) -> Result<Vec<f32>, String> {
        let Value::Number(number) = &setting.value else { return Err("it is no number".to_owned()) };
        numbers(&number.limits, text).map(|numbers| numbers.0)
    }

    #[test]
    fn ranges_include_both_ends() {
        let thresholds = |text: &str| numbers_of(&THRESHOLD, text);
        assert_eq!(thresholds("2..=5").unwrap(), [2.0, 3.0, 4.0, 5.0]);
        assert_eq!(thresholds("2..5").unwrap(), [2.0, 3.0, 4.0, 5.0]);
        assert_eq!(thresholds("4..4").unwrap(), [4.0]);
        assert_eq!(thresholds("8,2,8").unwrap(), [2.0, 8.0]);
        assert!(thresholds("2..1").unwrap_err().contains("reversed"), "though 1 is none of its values");
        for bad in ["", "1", "65", "5..=2", "2..", "a..b", "2..=1e9"] {
            assert!(thresholds(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn invalid_numbers_are_rejected() {
        for bad in ["0x5", "NaN", "", "1x", "x1", "1x1x1", "-1x5", "99999x1"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(size("640x480").unwrap(), [640, 480]);
        for bad in ["nan", "inf", "-0.1", "0.6", ""] {
            assert!(numbers_of(&EPSILON, bad).is_err(), "{bad}");
        }
        assert_eq!(numbers_of(&EPSILON, "0.2,0.1").unwrap(), [0.2, 0.1]);
        for bad in ["1,2", "1,2,NaN", "1,2,inf", "a,b,c", "1,2,3,4"] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert!(direction("0,0,0").is_err());
        for bad in ["0/2", "3/2", "1", "a/b", "1/0"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
    }
}
