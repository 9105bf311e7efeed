//! A tree that another is compared with, as a parameter of a study.

use std::sync::{Arc, Weak};

use crate::accel::Accel;

/// A tree by identity. Does not keep it in memory.
#[derive(Debug, Clone)]
pub struct OtherTree(Weak<Accel>);

impl OtherTree {
    /// Names `accel`.
    pub fn new(accel: &Arc<Accel>) -> Self {
        Self(Arc::downgrade(accel))
    }

    /// The tree, while it is there.
    pub fn get(&self) -> Option<Arc<Accel>> {
        self.0.upgrade()
    }
}

impl PartialEq for OtherTree {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}
