//! The tree of a scene, or both levels of trees, as a file.

use std::borrow::Cow;
use std::io::{self, Write};

use super::Accel;
use bvhscope_engine::tree_file::{Header, Instance, TwoLevelTrees, write_tree, write_two_levels};
use bvhscope_engine::{AnyTree, CancelToken, Cancelled, WideBvh};

/// The trees that a file gets: of a flat scene one.
#[derive(Debug)]
pub struct FileTrees<'a> {
    accel: &'a Accel,
    is_wide: bool,
    top: Cow<'a, AnyTree>,
    /// Those of the meshes of a scene of copies.
    meshes: Vec<Cow<'a, AnyTree>>,
}

impl Accel {
    /// The trees as they are, or the wide trees that are made from them.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn file_trees(&self, is_wide: bool, token: &CancelToken) -> Result<FileTrees<'_>, Cancelled> {
        let meshes = self.levels.iter().flat_map(|levels| levels.wide().copies().meshes());
        let top = self.levels.as_ref().map_or(&self.tree, |levels| levels.top(&self.tree));
        if !is_wide {
            let meshes = meshes.map(|mesh| Cow::Borrowed(mesh.tree())).collect();
            return Ok(FileTrees { accel: self, is_wide, top: Cow::Borrowed(top), meshes });
        }
        let top = widened(self.widen(token)?, top, token)?;
        let meshes = meshes.map(|mesh| widened(mesh.wide(), mesh.tree(), token)).collect::<Result<_, _>>()?;
        Ok(FileTrees { accel: self, is_wide, top, meshes })
    }
}

/// `wide` as a tree of nodes with up to eight children; `tree`, which it was made from, where it has other containers.
fn widened<'a>(wide: &WideBvh, tree: &'a AnyTree, token: &CancelToken) -> Result<Cow<'a, AnyTree>, Cancelled> {
    Ok(wide.tree.to_tree(tree, token)?.map_or(Cow::Borrowed(tree), Cow::Owned))
}

impl FileTrees<'_> {
    /// The header for a file of them.
    pub fn header(&self) -> Header {
        self.accel.file_header(self.is_wide)
    }

    /// The tree over the triangles, or over the copies.
    pub fn top(&self) -> &AnyTree {
        &self.top
    }

    /// Both levels of a scene of copies; `None` for a flat scene.
    pub fn levels(&self) -> Option<TwoLevelTrees<'_>> {
        let scene = self.accel.scene.copies.as_ref()?;
        let copies = scene.copies();
        let instance = |copy: u32| Instance { mesh: copies.mesh(copy), matrix: *copies.place(copy).rows() };
        let mesh = |(number, tree)| (AsRef::<AnyTree>::as_ref(tree), scene.mesh(number));
        Some(TwoLevelTrees {
            meshes: (0_u32..).zip(&self.meshes).map(mesh).collect(),
            top: &self.top,
            instances: (0..copies.len() as u32).map(instance).collect(),
            ids: self.accel.file.as_ref().and_then(|file| file.ids.as_deref()),
        })
    }

    /// Writes a tree file, with the triangles if `with_triangles`.
    ///
    /// # Errors
    ///
    /// Those of `writer`; [`Cancelled`] as the inner error of one, once `token` is cancelled.
    pub fn write(
        &self,
        with_triangles: bool,
        writer: &mut (impl Write + ?Sized),
        token: &CancelToken,
    ) -> io::Result<()> {
        let header = self.header();
        if let Some(levels) = self.levels() {
            return write_two_levels(&levels, &header, with_triangles, writer, token);
        }
        let corners = with_triangles.then_some(&self.accel.scene.triangles[..]);
        write_tree(&self.top, &header, corners, writer, token)
    }
}
