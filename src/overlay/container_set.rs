//! A set of kinds of containers.

use bvhscope_engine::tree::ContainerKind;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Some of the kinds of containers, as a bit for each; [`ContainerKind::WITH_ORIENTED`] is the order in which they are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ContainerSet(u8);

impl ContainerSet {
    /// No kind.
    pub const NONE: Self = Self(0);

    /// One kind.
    pub const fn of(kind: ContainerKind) -> Self {
        Self(1 << kind as u8)
    }

    /// The set with a kind in it.
    #[must_use]
    pub const fn with(self, kind: ContainerKind) -> Self {
        Self(self.0 | Self::of(kind).0)
    }

    /// The set without a kind.
    #[must_use]
    pub const fn without(self, kind: ContainerKind) -> Self {
        Self(self.0 & !Self::of(kind).0)
    }

    /// The kind is in the set.
    pub const fn contains(self, kind: ContainerKind) -> bool {
        self.0 & Self::of(kind).0 != 0
    }

    /// No kind is in the set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The kinds in the set.
    pub fn iter(self) -> impl Iterator<Item = ContainerKind> {
        ContainerKind::WITH_ORIENTED.into_iter().filter(move |kind| self.contains(*kind))
    }
}

impl FromIterator<ContainerKind> for ContainerSet {
    fn from_iter<I: IntoIterator<Item = ContainerKind>>(kinds: I) -> Self {
        kinds.into_iter().fold(Self::NONE, Self::with)
    }
}

/// The member `containers` as a list of names, or one switch for each kind as earlier versions saved them; boxes where all are absent.
#[derive(Serialize, Deserialize)]
struct Saved {
    containers: Option<Vec<ContainerKind>>,
    #[serde(skip_serializing)]
    show_boxes: Option<bool>,
    #[serde(skip_serializing)]
    show_spheres: Option<bool>,
    #[serde(skip_serializing)]
    show_dops: Option<bool>,
    #[serde(skip_serializing)]
    show_oriented: Option<bool>,
}

impl Serialize for ContainerSet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let containers = Some(self.iter().collect());
        Saved { containers, show_boxes: None, show_spheres: None, show_dops: None, show_oriented: None }
            .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ContainerSet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved = Saved::deserialize(deserializer)?;
        let switches = [saved.show_boxes.or(Some(true)), saved.show_spheres, saved.show_dops, saved.show_oriented];
        let switched = ContainerKind::WITH_ORIENTED.into_iter().zip(switches).filter(|(_, on)| *on == Some(true));
        Ok(saved.containers.map_or_else(|| switched.map(|(kind, _)| kind).collect(), Self::from_iter))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_what_is_put_in() {
        let set = ContainerSet::of(ContainerKind::Oriented).with(ContainerKind::Sphere).with(ContainerKind::Aabb);
        assert_eq!(set.iter().map(ContainerKind::name).collect::<Vec<_>>(), ["box", "sphere", "oriented"]);
        assert_eq!(set.without(ContainerKind::Sphere).without(ContainerKind::Dop14).iter().count(), 2);
        assert!(set.contains(ContainerKind::Sphere) && !set.contains(ContainerKind::Dop14));
        assert!(ContainerSet::NONE.is_empty() && !set.is_empty());
    }

    #[test]
    fn every_set_is_read_as_it_is_saved() {
        for bits in 0..16 {
            let text = serde_json::to_string(&ContainerSet(bits)).unwrap();
            assert_eq!(serde_json::from_str::<ContainerSet>(&text).unwrap(), ContainerSet(bits), "{text}");
        }
    }
}
