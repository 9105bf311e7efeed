//! Freeing large values off the UI thread.

/// Drops `value` on a thread of its own: freeing a tree of hundreds of megabytes takes longer than a UI frame.
pub(crate) fn drop_in_background(value: impl Send + 'static) {
    // Where no thread can be started, the closure is dropped here, and the value with it.
    let _ = std::thread::Builder::new().name("drop".to_owned()).spawn(move || drop(value));
}
