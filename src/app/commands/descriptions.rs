//! Descriptions of builders and shading modes, shared by the entries and the panels.

use bvhscope_engine::settings::BuilderKind;

use crate::app::state::CompareView;
use crate::render::{HeatKind, Shading};

/// Description of a shading mode.
pub(crate) fn shading_description(shading: Shading) -> &'static str {
    match shading {
        Shading::Lit => "Light, materials and textures",
        Shading::Normals => "The direction of the surface as a colour",
        Shading::Depth => "Distance along the view direction",
        Shading::AmbientOcclusion => "How open the surface is to its surroundings",
        Shading::Clusters => "Each surface in the colour of the container, at the cluster depth, that holds it",
        Shading::Heat(HeatKind::Both) => "Container and triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Containers) => "Container tests that each pixel cost",
        Shading::Heat(HeatKind::Primitives) => "Triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Steps) => {
            "Nodes and blocks of the eight-wide tree, which makes the pictures, that each pixel cost"
        }
        Shading::Heat(HeatKind::WholeRay) => {
            "Containers that the ray of each pixel enters from one end to the other, as if no surface stopped it: how much they overlap"
        }
    }
}

/// Description of a builder.
pub(crate) fn builder_description(builder: BuilderKind) -> &'static str {
    match builder {
        BuilderKind::Aac => "Approximate agglomerative clustering (Gu et al. 2013)",
        BuilderKind::Lbvh => "Median split by Morton code (Lauterbach et al. 2009): fastest build, worst tree",
        BuilderKind::BinnedSah => "Top-down splits by the surface area heuristic (Wald 2007), boxes only",
        BuilderKind::Exact => "Always merges the closest pair (Walter et al. 2008); small scenes only",
        BuilderKind::None => "No tree: every ray tests every triangle",
    }
}

/// One sentence about a view of two trees.
pub(crate) const fn compare_description(view: CompareView) -> &'static str {
    match view {
        CompareView::A => "The picture and the containers of tree A",
        CompareView::B => "The picture and the containers of tree B",
        CompareView::Split => "Tree A left of the seam, tree B right of it: drag the seam",
        CompareView::Difference => {
            "Tests of B minus tests of A in each pixel: blue where B takes fewer, orange where it takes more"
        }
    }
}
