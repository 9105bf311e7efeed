//! The trees of a scene of copies: one of each mesh below the one over the copies.

use std::sync::Arc;

use bvhscope_engine::{
    AnyTree, BuildError, BuildSettings, Bvh, CancelToken, InstanceHit, Instances, MeshCopies, WideBvh, build,
};

use crate::scene::SceneCopies;

/// Both levels of a scene of copies.
#[derive(Debug)]
pub struct TwoLevels {
    pub(super) scene: Arc<SceneCopies>,
    /// With wide trees.
    pub(super) wide: Instances,
}

impl TwoLevels {
    /// Builds the trees of the meshes below `top`, the wide tree over the copies, with the settings of that.
    pub(super) fn build(
        scene: &Arc<SceneCopies>,
        top: &Arc<WideBvh>,
        settings: &BuildSettings,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let build = |mesh: u32| Ok(Arc::new(build(scene.mesh(mesh), settings, token)?));
        let meshes = (0..scene.mesh_count() as u32).map(build).collect::<Result<_, BuildError>>()?;
        Self::over(scene, meshes, top)
    }

    /// `trees` of the meshes that were made elsewhere below `top`.
    pub(super) fn of_trees(
        scene: &Arc<SceneCopies>,
        top: &Arc<WideBvh>,
        trees: Vec<AnyTree>,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let mesh = |(number, tree)| Ok(Arc::new(Bvh::of_tree(tree, scene.mesh(number), token)?));
        let meshes = (0_u32..).zip(trees).map(mesh).collect::<Result<_, BuildError>>()?;
        Self::over(scene, meshes, top)
    }

    fn over(scene: &Arc<SceneCopies>, meshes: Vec<Arc<Bvh>>, top: &Arc<WideBvh>) -> Result<Self, BuildError> {
        let copies = MeshCopies::new(meshes, Arc::clone(scene.copies()))?;
        Ok(Self { scene: Arc::clone(scene), wide: Instances::over(Arc::new(copies), Arc::clone(top)) })
    }

    /// The number of the triangle that is hit in the flat scene.
    pub fn number(&self, hit: &InstanceHit) -> u32 {
        self.scene.number(hit.instance, hit.primitive_index)
    }

    /// The wide trees.
    pub fn wide(&self) -> &Instances {
        &self.wide
    }
}
