//! What every command gets, and how it may end.

use std::cell::OnceCell;
use std::io::{IsTerminal as _, Write};
use std::sync::Arc;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::export::ExportError;
use crate::scene::{LoadError, LoadOptions, Scene, SceneSource, load};
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A command's end without its result.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Something cannot be used or done; the text says what, where and why. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Flags that do not fit together, known only now. Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Stopped by the user. Exit code 130.
    #[error("interrupted")]
    Interrupted,
    /// Whoever read the results has gone. Silent.
    #[error("the reader of the output has gone")]
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

/// A command's end with its result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Finished {
    /// A file was loaded with warnings: exit code 3 under `--strict`.
    pub warned: bool,
}

/// What every command gets.
pub struct Context<'a> {
    /// Cancelled by Ctrl-C.
    pub token: CancelToken,
    /// Where results go.
    pub out: &'a mut (dyn Write + Send),
    /// Threads for building and tracing; `None` for all.
    pub threads: Option<usize>,
    /// What loading may do.
    pub load: LoadOptions,
    /// The threads once they have been started.
    pub pool: OnceCell<rayon::ThreadPool>,
}

impl Context<'_> {
    /// Loads `source` with a bar on stderr where that is a terminal; prints its warnings to stderr.
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

    /// A pool of the asked-for threads; of fewer, with a word about it, where the system gives no more.
    pub fn pool(&self) -> Result<&rayon::ThreadPool, Failure> {
        if let Some(pool) = self.pool.get() {
            return Ok(pool);
        }
        let wanted = self.threads.unwrap_or(0);
        let pool = match crate::lab::pool(wanted) {
            Ok(pool) => pool,
            Err(refusal) => fewer_threads(wanted, &refusal)?,
        };
        Ok(self.pool.get_or_init(|| pool))
    }
}

/// Fewer than the `wanted` threads (0 for all), which were refused; the calling thread alone where there is no other.
fn fewer_threads(wanted: usize, refusal: &str) -> Result<rayon::ThreadPool, Failure> {
    let mut fewer = if wanted == 0 { crate::lab::available_threads() } else { wanted } / 2;
    while fewer > 0 {
        // Those of the last try take a moment to end, and count until then.
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

/// A bar that follows a token's progress from a thread of its own; nothing where stderr is no terminal.
pub struct Progress {
    bar: Option<ProgressBar>,
    follower: Option<(std::sync::mpsc::Sender<()>, std::thread::JoinHandle<()>)>,
}

impl Progress {
    /// Starts to follow `token` under `label`.
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
        let (theirs, token) = (bar.clone(), token.clone());
        let follower = std::thread::Builder::new().name("progress".to_owned()).spawn(move || {
            while let Err(std::sync::mpsc::RecvTimeoutError::Timeout) = stopped.recv_timeout(Duration::from_millis(50))
            {
                theirs.set_position((token.progress() * 1000.0) as u64);
            }
        });
        Self { bar: Some(bar), follower: follower.ok().map(|thread| (stop, thread)) }
    }

    /// What is being done now.
    pub fn say(&self, label: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(label.to_owned());
        }
    }

    /// Prints through `print` without tearing the bar.
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
            // Nothing to do about a bar that fell over.
            let _ = thread.join();
        }
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
