//! Machine, day and version that a measurement was made with.

use std::sync::{LazyLock, OnceLock};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::text::quote;

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
static COMMIT: OnceLock<&str> = OnceLock::new();

/// Commit that the program was built from, where the build named it.
pub fn commit() -> Option<&'static str> {
    COMMIT.get().copied()
}

/// Sets what [`commit`] returns from then on. The program calls it with the variable of its build, not this crate, which would be
/// compiled again for each commit.
pub fn set_commit(commit: Option<&'static str>) {
    if let Some(commit) = commit.filter(|commit| !commit.is_empty()) {
        // The first call counts.
        let _ = COMMIT.set(commit);
    }
}

/// The command line of this process, ready to be pasted.
pub fn command_line() -> String {
    let given = std::env::args_os().skip(1).map(|word| quote(&word.to_string_lossy()));
    std::iter::once("bvhscope".to_owned()).chain(given).collect::<Vec<_>>().join(" ")
}

/// Name of the processor, with the number of threads that it runs at once.
pub fn machine() -> &'static str {
    static MACHINE: LazyLock<String> = LazyLock::new(name_of_processor);
    &MACHINE
}

fn name_of_processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let value = |name: &str| {
        let line = info.lines().find(|line| line.starts_with(name))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    // Names of virtual machines leave the generation out.
    let family = value("cpu family").zip(value("model\t")).map_or_else(String::new, |(f, m)| format!(" {f}/{m}"));
    let name = value("model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    format!("{name}{family}, {} threads", crate::threads::available_threads())
}

/// Day and minute in UTC of the first request, "2026-05-31T17:04Z": that at which the measurements of this process began.
pub fn date() -> &'static str {
    static DATE: LazyLock<String> =
        LazyLock::new(|| date_of(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())));
    &DATE
}

/// Day and minute in UTC, "2026-05-31T17:04Z" (Hinnant, *chrono-compatible low-level date algorithms*).
fn date_of(seconds: u64) -> String {
    let (days, minutes) = (seconds as i64 / 86_400 + 719_468, seconds % 86_400 / 60);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}T{:02}:{:02}Z", minutes / 60, minutes % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        assert_eq!(date_of(0), "1970-01-01T00:00Z");
        assert_eq!(date_of(951_868_740), "2000-02-29T23:59Z");
        assert_eq!(date_of(951_868_800), "2000-03-01T00:00Z");
        assert_eq!(date_of(1_780_247_040), "2026-05-31T17:04Z");
        assert_eq!(date_of(4_107_501_000), "2100-02-28T12:30Z");
    }
}
