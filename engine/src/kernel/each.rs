//! Arrays of three with unrolled elements.

/// `[value(0), value(1), value(2)]` of an expression in an index, such as an axis or a corner. A macro, because a closure that is
/// not inlined would be compiled without the vector instructions of the function around it.
macro_rules! each {
    ($index:ident => $value:expr) => {
        [
            {
                let $index = 0_usize;
                $value
            },
            {
                let $index = 1_usize;
                $value
            },
            {
                let $index = 2_usize;
                $value
            },
        ]
    };
}

pub(crate) use each;
