//! The context of a command (cancellation, output, threads), its outcome, and its progress bar.

use std::cell::OnceCell;
use std::io::{IsTerminal as _, Write};
use std::sync::Arc;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::export::ExportError;
use crate::scene::{LoadError, LoadOptions, Scene, SceneSource, load};
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The failure of a command.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Something cannot be used or done; the text says what and why. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Invalid combination of settings. Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Stopped by the user. Exit code 130.
    #[error("interrupted")]
    Interrupted,
    /// The reader of the output closed the pipe. Silent.
    #[error("the reader of the output closed it")]
    BrokenPipe,
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Interrupted
    }
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Cancelled(_) => Self::Interrupted,
            BuildError::Refused(text) => Self::Failed(text),
        }
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Cancelled(_) => Self::Interrupted,
            error @ LoadError::Unusable { .. } => Self::Failed(error.to_string()),
        }
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        Self::Failed(error.to_string())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            Self::BrokenPipe
        } else {
            Self::Failed(format!("the results cannot be printed: {error}"))
        }
    }
}

/// The success of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Finished {
    /// Whether a file was loaded with warnings: exit code 3 under `--strict`.
    pub warned: bool,
}

/// The context of a command.
pub struct Context<'a> {
    /// Cancelled by Ctrl-C.
    pub token: CancelToken,
    /// Output for results.
    pub out: &'a mut (dyn Write + Send),
    /// Number of threads for building and tracing; `None` for all.
    pub threads: Option<usize>,
    /// Permissions for loading.
    pub load: LoadOptions,
    /// The thread pool, created at first use.
    pub pool: OnceCell<rayon::ThreadPool>,
}

impl Context<'_> {
    /// Loads `source` with a progress bar, and prints its warnings to stderr.
    pub fn load(&self, source: &SceneSource) -> Result<Arc<Scene>, Failure> {
        let progress = Progress::new(&format!("Loading {}", source.label()), &self.token);
        let (options, token) = (&self.load, &self.token);
        let scene = self.pool()?.install(|| load(source, options, token))?;
        drop(progress);
        for warning in &scene.warnings.entries {
            eprintln!("bvhscope: {source}: {warning}");
        }
        Ok(Arc::new(scene))
    }

    /// The thread pool; has fewer threads than requested, with a message on stderr, if the system refuses more.
    pub fn pool(&self) -> Result<&rayon::ThreadPool, Failure> {
        if let Some(pool) = self.pool.get() {
            return Ok(pool);
        }
        let requested = self.threads.unwrap_or(0);
        let pool = match crate::lab::pool(requested) {
            Ok(pool) => pool,
            Err(refusal) => fewer_threads(requested, &refusal)?,
        };
        Ok(self.pool.get_or_init(|| pool))
    }
}

/// A pool of fewer than the `requested` threads (0 for all), which the system refused; the calling thread alone if necessary.
fn fewer_threads(requested: usize, refusal: &str) -> Result<rayon::ThreadPool, Failure> {
    let mut fewer = if requested == 0 { crate::lab::available_threads() } else { requested } / 2;
    while fewer > 0 {
        // The threads of the last attempt take a moment to end and count until then.
        std::thread::sleep(Duration::from_millis(20));
        if let Ok(pool) = crate::lab::pool(fewer) {
            eprintln!("bvhscope: {refusal}; working with {fewer}");
            return Ok(pool);
        }
        fewer /= 2;
    }
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let pool = alone.map_err(|error| Failure::Failed(format!("{refusal}; nor does it work without ({error})")))?;
    eprintln!("bvhscope: {refusal}; working without");
    Ok(pool)
}

/// A progress bar on stderr that follows a token's progress on a thread of its own; hidden if stderr is not a terminal.
pub struct Progress {
    bar: Option<ProgressBar>,
    follower: Option<(std::sync::mpsc::Sender<()>, std::thread::JoinHandle<()>)>,
}

impl Progress {
    /// Starts a bar for the progress of `token` with `label`.
    pub fn new(label: &str, token: &CancelToken) -> Self {
        token.set_progress(0.0);
        if !std::io::stderr().is_terminal() {
            return Self { bar: None, follower: None };
        }
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:32!} {bar:30} {percent:>3} %  {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(label.to_owned());
        let (stop, stopped) = std::sync::mpsc::channel();
        let (thread_bar, token) = (bar.clone(), token.clone());
        let follower = std::thread::Builder::new().name("progress".to_owned()).spawn(move || {
            while let Err(std::sync::mpsc::RecvTimeoutError::Timeout) = stopped.recv_timeout(Duration::from_millis(50))
            {
                thread_bar.set_position((token.progress() * 1000.0) as u64);
            }
        });
        Self { bar: Some(bar), follower: follower.ok().map(|thread| (stop, thread)) }
    }

    /// Changes the label.
    pub fn set_label(&self, label: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(label.to_owned());
        }
    }

    /// Runs `print` with the bar hidden.
    pub fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((stop, thread)) = self.follower.take() {
            drop(stop);
            // A panic in the progress bar is not worth reporting.
            let _ = thread.join();
        }
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
