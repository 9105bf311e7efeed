//! Embree 3 and 4, through the few functions of their C interface that are used here (<https://www.embree.org/api.html>). The
//! libraries are opened while the program runs: it is built without them, and measures those that are there, both at once.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::ffi::{OsString, c_char, c_int, c_uint, c_void};
use std::ptr;
use std::sync::OnceLock;

use libloading::Library as File;

/// Called with the bytes that Embree allocates, or gives back.
pub type Monitor = extern "C" fn(*mut c_void, isize, bool) -> bool;

/// Called with a triangle that may have a nearer point.
pub type Measure = unsafe extern "C" fn(*mut c_void) -> bool;

/// A table of functions, each found by its name.
macro_rules! functions {
    ($(#[$doc:meta])* $table:ident { $($field:ident: $name:ident($($argument:ty),*) $(-> $result:ty)?,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $table {
            $(pub $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl $table {
            fn find(file: &File) -> Result<Self, libloading::Error> {
                // SAFETY: the types are those of Embree's headers, and the file stays open.
                unsafe { Ok(Self { $($field: *file.get(stringify!($name).as_bytes())?,)* }) }
            }
        }
    };
}

functions! {
    /// Functions that are the same in both versions.
    Common {
        new_device: rtcNewDevice(*const c_char) -> *mut c_void,
        release_device: rtcReleaseDevice(*mut c_void),
        device_error: rtcGetDeviceError(*mut c_void) -> c_uint,
        device_property: rtcGetDeviceProperty(*mut c_void, c_uint) -> isize,
        set_monitor: rtcSetDeviceMemoryMonitorFunction(*mut c_void, Option<Monitor>, *mut c_void),
        new_scene: rtcNewScene(*mut c_void) -> *mut c_void,
        release_scene: rtcReleaseScene(*mut c_void),
        set_scene_quality: rtcSetSceneBuildQuality(*mut c_void, c_uint),
        set_scene_flags: rtcSetSceneFlags(*mut c_void, c_uint),
        commit_scene: rtcCommitScene(*mut c_void),
        new_geometry: rtcNewGeometry(*mut c_void, c_uint) -> *mut c_void,
        release_geometry: rtcReleaseGeometry(*mut c_void),
        set_geometry_quality: rtcSetGeometryBuildQuality(*mut c_void, c_uint),
        set_buffer: rtcSetSharedGeometryBuffer(*mut c_void, c_uint, c_uint, c_uint, *const c_void, usize, usize, usize),
        update_buffer: rtcUpdateGeometryBuffer(*mut c_void, c_uint, c_uint),
        commit_geometry: rtcCommitGeometry(*mut c_void),
        set_instanced_scene: rtcSetGeometryInstancedScene(*mut c_void, *mut c_void),
        set_transform: rtcSetGeometryTransform(*mut c_void, c_uint, c_uint, *const c_void),
        attach_geometry: rtcAttachGeometry(*mut c_void, *mut c_void) -> c_uint,
        new_bvh: rtcNewBVH(*mut c_void) -> *mut c_void,
        release_bvh: rtcReleaseBVH(*mut c_void),
        build_bvh: rtcBuildBVH(*const c_void) -> *mut c_void,
        allocate: rtcThreadLocalAlloc(*mut c_void, usize, usize) -> *mut c_void,
    }
}

functions! {
    /// Rays, with the scene. In Embree 3 a context and the rays follow, in Embree 4 the rays and their arguments. Packets begin with
    /// the lanes that count.
    Queries {
        intersect1: rtcIntersect1(*mut c_void, *mut c_void, *mut c_void),
        intersect8: rtcIntersect8(*const c_int, *mut c_void, *mut c_void, *mut c_void),
        intersect16: rtcIntersect16(*const c_int, *mut c_void, *mut c_void, *mut c_void),
        occluded1: rtcOccluded1(*mut c_void, *mut c_void, *mut c_void),
        occluded8: rtcOccluded8(*const c_int, *mut c_void, *mut c_void, *mut c_void),
        occluded16: rtcOccluded16(*const c_int, *mut c_void, *mut c_void, *mut c_void),
        point_query: rtcPointQuery(*mut c_void, *mut c_void, *mut c_void, Option<Measure>, *mut c_void) -> bool,
    }
}

functions! {
    /// Streams of rays, which Embree 4 has no more: scene, context, rays, their number and stride.
    Streams {
        intersect: rtcIntersect1M(*mut c_void, *mut c_void, *mut c_void, c_uint, usize),
        occluded: rtcOccluded1M(*mut c_void, *mut c_void, *mut c_void, c_uint, usize),
    }
}

/// An opened library.
pub struct Library {
    /// Its name in tables and rows.
    pub name: &'static str,
    /// Functions of either version.
    pub common: Common,
    /// Functions for rays.
    pub queries: Queries,
    /// More of them, in Embree 3 alone.
    pub streams: Option<Streams>,
    // Closed last.
    _file: File,
}

/// Versions: number, name in rows, and the variable that names the file.
const VERSIONS: [(u32, &str, &str); 2] = [(3, "embree", "BVHSCOPE_EMBREE3"), (4, "embree 4", "BVHSCOPE_EMBREE4")];
/// `RTC_DEVICE_PROPERTY_VERSION`.
const VERSION: c_uint = 0;

/// The libraries of this machine. Says once which they are, and which are missing.
pub fn libraries() -> &'static [Library] {
    static LIBRARIES: OnceLock<Vec<Library>> = OnceLock::new();
    LIBRARIES.get_or_init(|| VERSIONS.into_iter().filter_map(found).collect())
}

/// The file that the variable names, or the one that the system has by that name.
fn found((number, name, variable): (u32, &'static str, &str)) -> Option<Library> {
    let usual = || {
        let plain = libloading::library_filename(format!("embree{number}"));
        vec![OsString::from(format!("libembree{number}.so.{number}")), plain]
    };
    let files = std::env::var_os(variable).map_or_else(usual, |file| vec![file]);
    let mut error = None;
    for file in &files {
        match open(number, name, file) {
            Ok(library) => {
                let (major, minor, patch) = library.version();
                eprintln!("Embree {major}.{minor}.{patch}: {}", file.display());
                assert!(major == number as isize, "{variable} should name a library of Embree {number}");
                return Some(library);
            }
            Err(why) => error = error.or(Some(why)),
        }
    }
    let error = error.map_or_else(String::new, |error| format!(": {error}"));
    eprintln!("without Embree {number} ({variable} can name its library){error}");
    None
}

fn open(number: u32, name: &'static str, file: &OsString) -> Result<Library, libloading::Error> {
    // SAFETY: Embree's initialisers have no requirements.
    let file = unsafe { File::new(file)? };
    let (common, queries) = (Common::find(&file)?, Queries::find(&file)?);
    let streams = if number == 3 { Some(Streams::find(&file)?) } else { None };
    Ok(Library { name, common, queries, streams, _file: file })
}

impl Library {
    /// Major, minor and patch.
    fn version(&self) -> (isize, isize, isize) {
        // SAFETY: without a configuration; the device is released once, and not used after that.
        let number = unsafe {
            let device = (self.common.new_device)(ptr::null());
            let number = (self.common.device_property)(device, VERSION);
            (self.common.release_device)(device);
            number
        };
        (number / 10_000, number / 100 % 100, number % 100)
    }
}
