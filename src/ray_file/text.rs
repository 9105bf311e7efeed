//! Reading lines of six or eight numbers.

use std::io::{BufRead as _, BufReader, Read};

use super::error::RayFileError;
use super::ray::RawRay;
use crate::text::quoted;

/// Maximum length of a line in bytes.
const MAX_LINE: u64 = 1 << 12;

const EXPECTED: &str =
    "write origin x y z, direction x y z, or origin, t_min, direction, t_max; docs/ray-file.md has the formats";

/// Lines under way.
pub(super) struct Text<'a> {
    source: BufReader<Box<dyn Read + 'a>>,
    line: u64,
    bytes: Vec<u8>,
}

impl<'a> Text<'a> {
    pub(super) fn new(source: Box<dyn Read + 'a>) -> Self {
        Self { source: BufReader::new(source), line: 0, bytes: Vec::new() }
    }

    /// Appends the rays of the next lines, at most `most`. Blank lines and those that begin with # are skipped.
    pub(super) fn read(&mut self, most: usize, rays: &mut Vec<RawRay>) -> Result<(), RayFileError> {
        while rays.len() < most {
            self.bytes.clear();
            let read = self.source.by_ref().take(MAX_LINE).read_until(b'\n', &mut self.bytes);
            if read.map_err(|error| RayFileError::of_read(&error))? == 0 {
                break;
            }
            self.line = self.line.saturating_add(1);
            rays.extend(self.ray()?);
        }
        Ok(())
    }

    /// The ray of the line that has been read.
    fn ray(&self) -> Result<Option<RawRay>, RayFileError> {
        let fault = |problem: &str| RayFileError::new(format!("line {}: {problem}", self.line), EXPECTED);
        if self.bytes.len() as u64 == MAX_LINE {
            return Err(fault("longer than a ray"));
        }
        let Ok(text) = std::str::from_utf8(&self.bytes) else { return Err(fault("neither text nor a ray file")) };
        let text = text.trim_start_matches('\u{feff}').trim();
        if text.is_empty() || text.starts_with('#') {
            return Ok(None);
        }
        let words = || text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        let number = |word: &str| word.parse::<f64>().map_err(|_| fault(&format!("{} is no number", quoted(word))));
        let numbers = words().map(number).collect::<Result<Vec<f64>, _>>()?;
        let ray = RawRay::of_numbers(&numbers);
        ray.map(Some).ok_or_else(|| fault(&format!("{} numbers where 6 or 8 are expected", numbers.len())))
    }
}
