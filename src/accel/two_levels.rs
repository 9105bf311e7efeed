//! The trees of a scene of copies: one of each mesh below the one over the copies.

use std::sync::Arc;

use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::{
    AnyTree, BuildError, BuildSettings, Bvh, CancelToken, Cancelled, InstanceHit, Instances, MeshCopies, Unfolded,
    UnfoldedCopy, WideBvh, build,
};

use crate::scene::{SceneCopies, SceneMeshes};

/// Both levels of a scene of copies.
#[derive(Debug)]
pub struct TwoLevels {
    pub(super) scene: Arc<SceneCopies>,
    /// With wide trees.
    pub(super) wide: Instances,
    /// The tree over the copies, where trees of meshes are unfolded below it in the tree that is shown.
    pub(super) above: Option<Above>,
}

/// The tree over the copies, which is not the one that is shown.
#[derive(Debug)]
pub(super) struct Above {
    pub(super) tree: AnyTree,
    /// The place of each node of the tree that is shown in its level.
    pub(super) unfolded: Unfolded,
}

/// The trees of the meshes of the last scene of copies, which all its moments share.
#[derive(Debug, Default)]
pub struct MeshTrees {
    of: Option<(Arc<SceneMeshes>, BuildSettings)>,
    trees: Vec<Arc<Bvh>>,
}

impl MeshTrees {
    /// The tree of each mesh of `scene` with `settings`: those of the scene before, where they are the same, or new ones.
    pub(super) fn of(
        &mut self,
        scene: &SceneCopies,
        settings: &BuildSettings,
        token: &CancelToken,
    ) -> Result<Vec<Arc<Bvh>>, BuildError> {
        let is_known =
            self.of.as_ref().is_some_and(|(meshes, known)| Arc::ptr_eq(meshes, scene.meshes()) && known == settings);
        if !is_known {
            *self = Self::default();
            let build = |mesh: u32| Ok(Arc::new(build(scene.mesh(mesh), settings, token)?));
            self.trees = (0..scene.mesh_count() as u32).map(build).collect::<Result<_, BuildError>>()?;
            self.of = Some((Arc::clone(scene.meshes()), *settings));
        }
        Ok(self.trees.clone())
    }
}

impl TwoLevels {
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

    /// The trees of the `meshes` below `top`, the wide tree over the copies.
    pub(super) fn over(
        scene: &Arc<SceneCopies>,
        meshes: Vec<Arc<Bvh>>,
        top: &Arc<WideBvh>,
    ) -> Result<Self, BuildError> {
        let copies = MeshCopies::new(meshes, Arc::clone(scene.copies()))?;
        let wide = Instances::over(Arc::new(copies), Arc::clone(top));
        Ok(Self { scene: Arc::clone(scene), wide, above: None })
    }

    /// The same with the tree above built anew over parts of the copies, up to `open` for each.
    pub(super) fn opened(&self, settings: &BuildSettings, open: f32, token: &CancelToken) -> Result<Self, BuildError> {
        let wide = Instances::of(Arc::clone(self.wide.copies()), settings, open, token)?;
        Ok(Self { scene: Arc::clone(&self.scene), wide, above: None })
    }

    /// The tree to be shown: `tree`, which is that over the copies, with the trees of the meshes of `copies` unfolded below it, if any.
    pub(super) fn unfold(
        &mut self,
        tree: AnyTree,
        copies: &[UnfoldedCopy],
        token: &CancelToken,
    ) -> Result<AnyTree, Cancelled> {
        if copies.is_empty() {
            return Ok(tree);
        }
        let (shown, unfolded) = Unfolded::new(self.wide.copies(), boxes(&tree), copies, token)?;
        self.above = Some(Above { tree, unfolded });
        Ok(AnyTree::Oriented(shown))
    }

    /// The tree over the copies, where it is not `shown`, the one that is shown.
    pub(super) fn top<'a>(&'a self, shown: &'a AnyTree) -> &'a AnyTree {
        self.above.as_ref().map_or(shown, |above| &above.tree)
    }

    /// The place of each node of the tree that is shown in its level, where trees of meshes are unfolded in it.
    pub fn unfolded(&self) -> Option<&Unfolded> {
        self.above.as_ref().map(|above| &above.unfolded)
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

/// The tree over copies, which has boxes.
pub(super) fn boxes(tree: &AnyTree) -> &Tree<Aabb> {
    match tree {
        AnyTree::Aabb(tree) => tree,
        _ => unreachable!("copies have trees of boxes"),
    }
}
