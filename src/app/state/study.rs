//! Data that a view of the laboratory derives from the presented tree, on a thread of its own; another tree as a parameter
//! of it.

use std::sync::{Arc, Weak};

use crate::accel::{Accel, is_same};

/// A value of type `V` that is derived from a tree and parameters `K`, or on its way. Kept until tree or parameters change, and that of the
/// tree before while that tree exists.
#[derive(Debug)]
pub struct Study<K, V> {
    known: Option<Known<K, V>>,
    /// Of another tree than that of `known`.
    before: Option<Known<K, V>>,
    /// The cancelled inputs, for which nothing is derived again until the user wants it after all.
    cancelled: Option<(Weak<Accel>, K)>,
}

#[derive(Debug)]
struct Known<K, V> {
    tree: Weak<Accel>,
    parameters: K,
    value: Arc<V>,
}

impl<K, V> Default for Study<K, V> {
    fn default() -> Self {
        Self { known: None, before: None, cancelled: None }
    }
}

impl<K: PartialEq, V> Study<K, V> {
    /// The value derived from this tree, whatever the parameters: while a view waits for others, it shows what it has.
    pub fn of_tree(&self, accel: &Arc<Accel>) -> Option<&Arc<V>> {
        self.known_of(accel).map(|known| &known.value)
    }

    /// The same with its parameters.
    pub fn with_parameters(&self, accel: &Arc<Accel>) -> Option<(&K, &Arc<V>)> {
        self.known_of(accel).map(|known| (&known.parameters, &known.value))
    }

    fn known_of(&self, accel: &Arc<Accel>) -> Option<&Known<K, V>> {
        [&self.known, &self.before].into_iter().flatten().find(|known| is_same(&known.tree, accel))
    }

    /// The value derived from this tree with these parameters.
    pub fn get(&self, accel: &Arc<Accel>, parameters: &K) -> Option<&Arc<V>> {
        let known = self.known_of(accel)?;
        (known.parameters == *parameters).then_some(&known.value)
    }

    /// Stores a value that was derived.
    pub fn set(&mut self, accel: &Arc<Accel>, parameters: K, value: V) {
        let known = Known { tree: Arc::downgrade(accel), parameters, value: Arc::new(value) };
        self.before = self.known.replace(known).filter(|before| !is_same(&before.tree, accel)).or(self.before.take());
    }

    /// Notes that the value of this tree with these parameters is not to be derived until [`Study::resume`].
    pub fn cancel(&mut self, accel: &Arc<Accel>, parameters: K) {
        self.cancelled = Some((Arc::downgrade(accel), parameters));
    }

    /// Allows what was cancelled again.
    pub fn resume(&mut self) {
        self.cancelled = None;
    }

    /// Whether the user cancelled the value of this tree with these parameters.
    pub fn is_cancelled(&self, accel: &Arc<Accel>, parameters: &K) -> bool {
        self.cancelled.as_ref().is_some_and(|(tree, cancelled)| is_same(tree, accel) && cancelled == parameters)
    }

    /// Gives up a value of a tree that is gone, so that its memory goes with the tree.
    pub fn forget_gone(&mut self) {
        for known in [&mut self.known, &mut self.before] {
            drop(known.take_if(|known| known.tree.strong_count() == 0));
        }
    }
}

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
