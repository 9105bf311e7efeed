//! Log lines on stderr, as notes.

use env_filter::Filter;
use log::{Log, Metadata, Record};

use super::output::note;

/// The lines of the window's libraries that are shown unless `RUST_LOG` is set: graphics drivers log errors only.
const DEFAULT_FILTER: &str = "warn,wgpu_hal=error,winit=error";

struct Logger {
    filter: Filter,
}

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        self.filter.enabled(metadata)
    }

    fn log(&self, record: &Record<'_>) {
        if self.filter.matches(record) {
            note(format_args!("[{:<5} {}] {}", record.level(), record.target(), record.args()));
        }
    }

    fn flush(&self) {}
}

/// Shows log lines on stderr: those that `RUST_LOG` selects (`RUST_LOG=bvhscope=info` for the events of the window), else
/// warnings.
pub fn start_log() {
    let wanted = std::env::var("RUST_LOG").unwrap_or_else(|_| DEFAULT_FILTER.to_owned());
    let mut builder = env_filter::Builder::new();
    if let Err(error) = builder.try_parse(&wanted) {
        note(format_args!("bvhscope: RUST_LOG is not used: {error}"));
        builder = env_filter::Builder::new();
        let _ = builder.try_parse(DEFAULT_FILTER);
    }
    let filter = builder.build();
    let level = filter.filter();
    // Fails where a library of the process logs already, which then goes on.
    if log::set_boxed_logger(Box::new(Logger { filter })).is_ok() {
        log::set_max_level(level);
    }
}
