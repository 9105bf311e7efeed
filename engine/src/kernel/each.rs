//! Unrolled arrays of three.

/// The three values of an expression in an axis, corner or part. A macro, because closures need not become part of the
/// function around them and then lose its vector instructions.
macro_rules! each {
    ($part:ident => $value:expr) => {
        [
            {
                let $part = 0_usize;
                $value
            },
            {
                let $part = 1_usize;
                $value
            },
            {
                let $part = 2_usize;
                $value
            },
        ]
    };
}

pub(crate) use each;
