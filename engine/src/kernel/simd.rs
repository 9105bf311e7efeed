//! SIMD instruction set of the kernels, chosen at run time once per build, tile or batch of rays. All levels give the same trees
//! and hits.

#![allow(clippy::inline_always, reason = "a token must land in the caller, whose type it decides")]

use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::Level;

/// Position in [`SimdLevel::ALL`] above which builds use no level.
static WIDEST_OF_BUILDS: AtomicUsize = AtomicUsize::new(usize::MAX);

/// A SIMD instruction set.
///
/// ```
/// use bvhscope_engine::{BuildSettings, CancelToken, Ray, SimdLevel, Triangle, build, glam::Vec3};
///
/// let triangles = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
/// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
/// let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
/// for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_available()) {
///     // Every level finds the same hit; `Bvh::closest_hit` uses the best.
///     assert_eq!(bvh.wide().tree.closest_hit(simd.level(), &ray), bvh.closest_hit(&ray));
/// }
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SimdLevel {
    /// SSE2, which every 64-bit x86 has.
    Sse2,
    /// AVX2.
    Avx2,
    /// AVX-512 with the extensions of Ice Lake.
    Avx512,
    /// NEON, which every 64-bit ARM has.
    Neon,
}

impl SimdLevel {
    /// All levels, whether this machine supports them or not.
    pub const ALL: [Self; 4] = [Self::Sse2, Self::Avx2, Self::Avx512, Self::Neon];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sse2 => "sse2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }

    /// The widest level that this machine supports.
    pub fn best() -> Self {
        Self::ALL.into_iter().rfind(|level| level.is_available()).unwrap_or(Self::Sse2)
    }

    /// The level that builds use: the widest that this machine supports, up to [`SimdLevel::limit_builds`].
    pub fn of_builds() -> Self {
        let widest = WIDEST_OF_BUILDS.load(Ordering::Relaxed);
        let mut allowed = Self::ALL.into_iter().take(widest.saturating_add(1));
        allowed.rfind(|level| level.is_available()).unwrap_or(Self::Sse2)
    }

    /// From now on no build of this process uses a wider level than `widest`; `None` allows all. For measuring what wider vectors
    /// gain, and for tests: the trees are the same. Rays are traced with the level that each call names.
    pub fn limit_builds(widest: Option<Self>) {
        let position = widest.and_then(|widest| Self::ALL.iter().position(|level| *level == widest));
        WIDEST_OF_BUILDS.store(position.unwrap_or(usize::MAX), Ordering::Relaxed);
    }

    /// Whether this machine supports it.
    pub fn is_available(self) -> bool {
        self.find().is_some()
    }

    /// Dispatch level for kernels; the baseline where this machine does not support `self`.
    pub fn level(self) -> Level {
        self.find().unwrap_or_else(Level::baseline)
    }

    fn find(self) -> Option<Level> {
        let machine = Level::new();
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => machine.as_sse2().map(Level::Sse2),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => machine.as_avx2().map(Level::Avx2),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => machine.as_avx512().map(Level::Avx512),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => machine.as_neon().map(Level::Neon),
            #[allow(unreachable_patterns, reason = "levels of other machines")]
            _ => {
                let _ = machine;
                None
            }
        }
    }
}

/// The instructions that every machine has.
#[cfg(target_arch = "x86_64")]
pub(crate) type Baseline = fearless_simd::Sse2;
#[cfg(target_arch = "aarch64")]
pub(crate) type Baseline = fearless_simd::Neon;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(crate) type Baseline = fearless_simd::Fallback;

/// Proof of the baseline. For code that gains nothing from more: it is compiled once instead of once for each level.
#[inline(always)]
pub(crate) fn baseline() -> Baseline {
    #[cfg(target_arch = "x86_64")]
    let token = Level::baseline().as_sse2();
    #[cfg(target_arch = "aarch64")]
    let token = Level::baseline().as_neon();
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let token = Some(fearless_simd::Fallback::new());
    token.unwrap_or_else(|| unreachable!("every machine has them"))
}

/// Proof of the widest instructions of a [`Level`] that kernels are compiled for.
#[derive(Clone, Copy)]
pub(crate) enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx512(fearless_simd::Avx512),
    #[cfg(target_arch = "x86_64")]
    Avx2(fearless_simd::Avx2),
    Baseline(Baseline),
}

impl Instructions {
    #[inline(always)]
    pub(crate) fn of(level: Level) -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = level.as_avx512() {
            return Self::Avx512(simd);
        }
        Self::of_plain_loops(level)
    }

    #[inline(always)]
    pub(crate) fn of_plain_loops(level: Level) -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = level.as_avx2() {
            return Self::Avx2(simd);
        }
        let _ = level;
        Self::Baseline(baseline())
    }
}

/// Evaluates an expression with the widest instructions of a [`Level`]. Unlike the macro of `fearless_simd`, which has a copy for SSE4.2
/// too: processors with that and without AVX2 are older than 2013.
macro_rules! dispatch {
    ($level:expr, $simd:pat => $body:expr) => {
        match $crate::kernel::simd::Instructions::of($level) {
            #[cfg(target_arch = "x86_64")]
            $crate::kernel::simd::Instructions::Avx512(simd) => {
                $crate::kernel::simd::vectorized!(simd, $simd => $body)
            }
            #[cfg(target_arch = "x86_64")]
            $crate::kernel::simd::Instructions::Avx2(simd) => $crate::kernel::simd::vectorized!(simd, $simd => $body),
            $crate::kernel::simd::Instructions::Baseline(simd) => {
                $crate::kernel::simd::vectorized!(simd, $simd => $body)
            }
        }
    };
}

/// [`dispatch`] for kernels with plain loops, which the compiler vectorises: with AVX2 at most, because its auto-vectoriser has been
/// seen to give wrong results for AVX-512.
macro_rules! dispatch_plain {
    ($level:expr, $simd:pat => $body:expr) => {
        match $crate::kernel::simd::Instructions::of_plain_loops($level) {
            #[cfg(target_arch = "x86_64")]
            $crate::kernel::simd::Instructions::Avx512(_) => unreachable!("plain loops do without"),
            #[cfg(target_arch = "x86_64")]
            $crate::kernel::simd::Instructions::Avx2(simd) => $crate::kernel::simd::vectorized!(simd, $simd => $body),
            $crate::kernel::simd::Instructions::Baseline(simd) => {
                $crate::kernel::simd::vectorized!(simd, $simd => $body)
            }
        }
    };
}

/// An expression compiled with the instructions that a token proves.
macro_rules! vectorized {
    ($token:expr, $simd:pat => $body:expr) => {{
        let token = $token;
        fearless_simd::Simd::vectorize(
            token,
            #[inline(always)]
            || {
                let $simd = token;
                $body
            },
        )
    }};
}

pub(crate) use {dispatch, dispatch_plain, vectorized};

impl Default for SimdLevel {
    fn default() -> Self {
        Self::best()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_level_is_available() {
        assert!(SimdLevel::best().is_available() || cfg!(not(any(target_arch = "x86_64", target_arch = "aarch64"))));
        #[cfg(target_arch = "x86_64")]
        assert!(SimdLevel::Sse2.is_available() && !SimdLevel::Neon.is_available());
    }
}
