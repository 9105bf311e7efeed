//! The state of each view of the dock, of a type that is private to the view, and its part of a shared state.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::accel::Accel;
use crate::app::state::json::{difference, merge, plain_value};
use crate::app::state::model::Presented;

/// The state of a view of the dock: choices of the user, and what was derived for it. Nothing of it outlives the run.
pub trait ViewState: Default + 'static {
    /// The name on its tab, by which saved settings and shared states name it too.
    const NAME: &'static str;
    /// Its part of a shared state: every choice of the user.
    type Shared: Default + Serialize + DeserializeOwned;

    /// Its part of a shared state, of which nodes are those of `tree`, the presented one.
    fn shared(&self, tree: Option<&Arc<Accel>>) -> Self::Shared;

    /// Shows what another window showed.
    fn show_shared(&mut self, shared: Self::Shared);

    /// Shows the nodes that another window showed, once their tree is presented.
    fn show_shared_nodes(&mut self, _: &Presented) {}

    /// A state in which each choice differs from the default, for the test that all are shared.
    #[cfg(test)]
    fn changed() -> Self;
}

/// A view's state of any type.
trait AnyState: Any {
    fn shared(&self, tree: Option<&Arc<Accel>>) -> Option<Value>;
    fn show_shared(&mut self, part: Option<Value>) -> serde_json::Result<()>;
    fn show_shared_nodes(&mut self, shown: &Presented);
    #[cfg(test)]
    fn unchanged(&self) -> Vec<String>;
}

impl<V: ViewState> AnyState for V {
    fn shared(&self, tree: Option<&Arc<Accel>>) -> Option<Value> {
        difference(&plain_value(&V::Shared::default()), plain_value(&ViewState::shared(self, tree)))
    }

    fn show_shared(&mut self, part: Option<Value>) -> serde_json::Result<()> {
        let mut whole = plain_value(&V::Shared::default());
        if let Some(part) = part {
            merge(&mut whole, part);
        }
        ViewState::show_shared(self, serde_json::from_value(whole)?);
        Ok(())
    }

    fn show_shared_nodes(&mut self, shown: &Presented) {
        ViewState::show_shared_nodes(self, shown);
    }

    #[cfg(test)]
    fn unchanged(&self) -> Vec<String> {
        let default = plain_value(&V::Shared::default());
        let shared = plain_value(&ViewState::shared(self, None));
        // A view without choices shares nothing.
        if shared.is_null() { Vec::new() } else { crate::app::state::json::unchanged(&default, &shared, V::NAME) }
    }
}

/// The parts of views in a shared state, by the views' names: what differs from the defaults.
pub type SharedViews = BTreeMap<String, Value>;

/// The states of all views.
#[derive(Default)]
pub struct ViewStates(Vec<(&'static str, Box<dyn AnyState>)>);

impl ViewStates {
    /// Adds a view.
    pub fn add<V: ViewState>(&mut self, state: V) {
        self.0.push((V::NAME, Box::new(state)));
    }

    /// The state of a view.
    pub fn get<V: ViewState>(&self) -> &V {
        let mut states = self.0.iter().map(|(_, state)| &**state as &dyn Any);
        states.find_map(|state| state.downcast_ref()).expect("a view of the list")
    }

    /// [`ViewStates::get`], to change it.
    pub fn get_mut<V: ViewState>(&mut self) -> &mut V {
        let mut states = self.0.iter_mut().map(|(_, state)| &mut **state as &mut dyn Any);
        states.find_map(|state| state.downcast_mut()).expect("a view of the list")
    }

    /// The parts of a shared state.
    pub fn shared(&self, tree: Option<&Arc<Accel>>) -> SharedViews {
        self.0.iter().filter_map(|(name, state)| Some(((*name).to_owned(), state.shared(tree)?))).collect()
    }

    /// Shows what the views of another window showed. An error names a part that cannot be read, whose view stays as it is.
    pub fn show_shared(&mut self, mut shared: SharedViews) -> Result<(), String> {
        self.0.iter_mut().try_for_each(|(name, state)| {
            state
                .show_shared(shared.remove(*name))
                .map_err(|error| format!("its part of the view {name} is damaged: {error}"))
        })
    }

    /// The choices that are as at the start.
    #[cfg(test)]
    pub(in crate::app) fn unchanged(&self) -> Vec<String> {
        self.0.iter().flat_map(|(_, state)| state.unchanged()).collect()
    }

    /// Shows the nodes of a pasted state, whose tree is presented.
    pub fn show_shared_nodes(&mut self, shown: &Presented) {
        for (_, state) in &mut self.0 {
            state.show_shared_nodes(shown);
        }
    }
}
