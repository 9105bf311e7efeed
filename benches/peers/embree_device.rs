//! Embree's devices.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::ffi::{CString, c_void};
use std::ptr;
use std::sync::atomic::{AtomicIsize, Ordering};

use bvhscope_engine::kernel::SimdLevel;

use crate::embree_library::Library;

/// How carefully Embree builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Quality {
    /// Its Morton builder.
    Low = 0,
    /// Binned SAH.
    Medium = 1,
    /// SAH with spatial splits.
    High = 2,
}

impl Quality {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

/// Bytes that Embree holds for all devices together.
pub fn held_bytes() -> isize {
    HELD_BYTES.load(Ordering::Relaxed)
}

static HELD_BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn monitor(_: *mut c_void, bytes: isize, _: bool) -> bool {
    HELD_BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// Embree with a number of threads.
pub struct Device {
    /// The library that it belongs to.
    pub library: &'static Library,
    device: *mut c_void,
}

impl Device {
    /// Starts it.
    pub fn new(library: &'static Library, threads: usize) -> Self {
        // Up to the level that this engine is limited to.
        let isa = match SimdLevel::of_builds() {
            SimdLevel::Sse2 => ",isa=sse2",
            SimdLevel::Sse4 => ",isa=sse4.2",
            SimdLevel::Avx2 => ",isa=avx2",
            SimdLevel::Avx512 | SimdLevel::Neon => "",
        };
        let config = CString::new(format!("threads={threads},set_affinity=0{isa}")).expect("no zero in it");
        // SAFETY: the text outlives the call; a null device is refused below.
        let device = unsafe { (library.common.new_device)(config.as_ptr()) };
        assert!(!device.is_null(), "Embree does not start");
        // SAFETY: the device is alive; the monitor is a static function that ignores its user pointer.
        unsafe { (library.common.set_monitor)(device, Some(monitor), ptr::null_mut()) };
        Self { library, device }
    }

    /// The device, as an argument of Embree's functions.
    pub fn handle(&self) -> *mut c_void {
        self.device
    }

    /// Fails where Embree has reported an error.
    pub fn check(&self) {
        // SAFETY: the device is alive.
        let error = unsafe { (self.library.common.device_error)(self.device) };
        assert!(error == 0, "{} reports error {error}", self.library.name);
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: released once; scenes hold references of their own.
        unsafe { (self.library.common.release_device)(self.device) };
    }
}
