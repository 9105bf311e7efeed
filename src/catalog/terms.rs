//! The glossary: every term that the window uses, in one or two sentences, with its source.

#![expect(missing_docs, reason = "each term explains itself")]

use super::is_same;

/// A term of the glossary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Term {
    /// Its name in the glossary.
    pub name: &'static str,
    /// Its meaning, in one or two sentences.
    pub text: &'static str,
    /// Authors and year of its source; empty for words of this program.
    pub source: &'static str,
}

impl Term {
    /// Name, text or source contain `filter`, in whatever case.
    pub fn matches(&self, filter: &str) -> bool {
        let filter = filter.trim().to_lowercase();
        [self.name, self.text, self.source].iter().any(|part| part.to_lowercase().contains(&filter))
    }
}

/// The terms of trees, in the order of the glossary: the tree, its numbers, how it is built, improved and traced.
pub const TERMS: &[Term] = &[
    Term {
        name: "BVH",
        text: "Bounding volume hierarchy: a tree of containers around triangles. A ray that misses a container skips everything inside it.",
        source: "Rubin and Whitted 1980",
    },
    Term {
        name: "Node",
        text: "A container of the tree with what it holds: its children, two in the trees that are built here, or triangles. The root holds the whole model.",
        source: "",
    },
    Term { name: "Leaf", text: "A node that holds triangles instead of children.", source: "" },
    Term {
        name: "Container",
        text: "The box, sphere, polytope or oriented box around everything below a node, also called its bounding volume. Boxes fit more tightly than spheres, which are smaller to store.",
        source: "",
    },
    Term {
        name: "14-DOP",
        text: "A box whose corners are cut off: the space between seven pairs of parallel planes, across the axes and the four diagonals of a cube. Fits slanted and thin things better than a box; a test takes longer.",
        source: "Klosowski et al. 1998",
    },
    Term {
        name: "Oriented box",
        text: "A box whose directions are its own: turned to fit around what it holds. The pass Orient gives each node of a finished tree the smallest of its plain, a turned and a skewed box.",
        source: "Larsson and Källberg 2011",
    },
    Term {
        name: "Skewed box",
        text: "The space between three of the seven pairs of planes of the 14-DOP, which need not meet at right angles. A ray test costs as much as that of a turned box.",
        source: "Káčerik and Bittner 2025",
    },
    Term { name: "Depth", text: "Levels between a node and the root, whose depth is 0.", source: "" },
    Term {
        name: "Build time",
        text: "Wall-clock time from the triangles to the finished binary tree, as in the paper. Ready to trace adds the wide tree, which is what other engines' build times include.",
        source: "",
    },
    Term {
        name: "SAH cost",
        text: "Surface area heuristic: the expected cost of a ray that hits the root, if a node is hit as often as its surface is large. Lower is better; trees of different containers do not compare.",
        source: "Goldsmith and Salmon 1987",
    },
    Term {
        name: "Tests per ray",
        text: "How many containers and triangles a ray is tested against that enters the box around the scene. Always counted at 1024×1024 pixels from the model's default camera, so that numbers of different windows, trees and containers compare.",
        source: "",
    },
    Term {
        name: "Mray/s",
        text: "Millions of primary rays per second by all threads: the speed of tracing them through a tree, measured without shading in the view that counts tests.",
        source: "",
    },
    Term {
        name: "EPO",
        text: "End-point overlap: surface that lies inside nodes which do not hold it, where rays end and must visit both. Together with the SAH cost it predicts the speed better than that alone.",
        source: "Aila, Karras and Laine 2013",
    },
    Term {
        name: "Measured cost",
        text: "What the tests of a ray that enters the root cost on average, counted node by node in the unit of the SAH cost. Random lines, which nothing stops, cost what that predicts.",
        source: "",
    },
    Term {
        name: "Area share",
        text: "Surface of a node relative to the root's: how likely a ray that hits the root hits the node as well.",
        source: "Goldsmith and Salmon 1987",
    },
    Term {
        name: "Regret",
        text: "How much cheaper the tree would be with a subtree rebuilt, counted where that is the largest part of the subtree's cost; elsewhere what a node's own split costs. Unlike cost, it is greatest where a tree is bad.",
        source: "",
    },
    Term {
        name: "Overlap",
        text: "Surface of what a node's two children have in common, over the node's own: how many of the rays that hit the node must visit both. Of more children, the sum over all pairs.",
        source: "",
    },
    Term {
        name: "AAC",
        text: "Approximate agglomerative clustering: sorts triangles along a curve, splits them into small groups, and on the way up merges the closest clusters of each group.",
        source: "Gu, He, Fatahalian and Blelloch 2013",
    },
    Term {
        name: "Cluster",
        text: "A subtree under construction. The two whose common container has the smallest surface are merged first.",
        source: "Walter, Bala, Kulkarni and Pingali 2008",
    },
    Term {
        name: "Threshold δ",
        text: "Groups of fewer triangles are clustered rather than split. Higher: slower build, fewer tests per ray.",
        source: "Gu et al. 2013",
    },
    Term {
        name: "Reduction ε",
        text: "How strongly clusters are reduced before they are handed up: of n remain about n to the power of ½ − ε. Smaller: slower build, better tree.",
        source: "Gu et al. 2013",
    },
    Term {
        name: "Morton code",
        text: "The bits of x, y and z of a triangle's centre in turn. Sorted by it, neighbours in space are mostly neighbours in the list.",
        source: "Morton 1966",
    },
    Term {
        name: "Stages",
        text: "Steps of a build, each with its time: bounds, codes, sort, tree, flatten, and a pass each that improves the tree.",
        source: "",
    },
    Term {
        name: "LBVH",
        text: "Splits where the highest differing bit of the Morton codes flips. Fastest to build, worst tree.",
        source: "Lauterbach et al. 2009",
    },
    Term {
        name: "Binned SAH",
        text: "Splits from the top where the SAH cost is lowest, tried at a few planes on each axis. Makes trees of boxes and of 14-DOPs.",
        source: "Wald 2007",
    },
    Term {
        name: "Sweep SAH",
        text: "Splits from the top where the SAH cost is lowest, tried between all triangles along each axis. The reference of builders by the \
           SAH. Makes trees of boxes and of 14-DOPs.",
        source: "Wald 2007",
    },
    Term {
        name: "SBVH",
        text: "Spatial splits: a node is divided by its list of triangles, as by sweep SAH, or by a plane that cuts triangles, whichever costs \
           less. Several leaves can then hold one triangle, each within a smaller box; there are at most twice as many references as \
           triangles.",
        source: "Stich et al. 2009",
    },
    Term {
        name: "PLOC",
        text: "Parallel locally-ordered clustering. In each round all clusters that are each other's nearest among 8 neighbours on both sides \
           along the curve merge. The nearest relative of AAC.",
        source: "Meister and Bittner 2018",
    },
    Term {
        name: "H-PLOC",
        text: "Hierarchical PLOC: bottom-up along the nodes of an LBVH, each merges the at most 32 clusters of its children by rounds of PLOC \
           until 16 are left.",
        source: "Benthin et al. 2024",
    },
    Term {
        name: "Exact agglomerative",
        text: "Always merges the closest pair of all clusters. The tree that AAC approximates; small scenes only.",
        source: "Walter et al. 2008",
    },
    Term {
        name: "Split (presplit)",
        text: "Before the build, puts large triangles into several smaller boxes. Helps walls and beams that are not axis-aligned, and takes more memory.",
        source: "Ernst and Greiner 2007; Karras and Aila 2013",
    },
    Term {
        name: "Restructure",
        text: "Takes small subtrees apart and builds them again where that lowers the SAH cost.",
        source: "Karras and Aila 2013",
    },
    Term {
        name: "Reinsert",
        text: "Takes subtrees out of the finished tree and puts them where they cost least.",
        source: "Meister and Bittner 2018",
    },
    Term {
        name: "Collapse",
        text: "Turns subtrees into leaves of several triangles where that is cheaper: fewer nodes, less memory.",
        source: "Goldsmith and Salmon 1987",
    },
    Term {
        name: "Ordered traversal",
        text: "A ray visits the nearer child first and skips what lies behind the hit it has. How rays are traced today.",
        source: "",
    },
    Term {
        name: "Paper traversal",
        text: "Children in stored order, and nothing skipped behind a hit, as the paper prints it. Many more tests.",
        source: "Mahmuda, Yuniarti, Nurul K., figure 2",
    },
    Term {
        name: "Wide tree",
        text: "The same hierarchy with up to eight children a node, so that one SIMD instruction tests all of them. Pictures are traced through it.",
        source: "Ylitie, Karras and Laine 2017",
    },
    Term {
        name: "SIMD level",
        text: "The processor's instructions that work on several numbers at once, as AVX2 or AVX-512. It changes the speed, not the picture.",
        source: "",
    },
    Term {
        name: "Primary ray",
        text: "A ray from the camera through a pixel. Shadow rays start where it hits.",
        source: "",
    },
    Term {
        name: "Pass",
        text: "Once around all pixels with one sample each. While anything moves there is one coarse pass; at rest, passes add up to a smooth picture.",
        source: "",
    },
    Term {
        name: "Heat map",
        text: "A picture whose colours count the tests of each pixel's ray, or the memory that it reads: where the tree is expensive.",
        source: "",
    },
    Term {
        name: "The paper",
        text: "The study of box and sphere trees whose tables and figures the view Paper measures on your own model.",
        source: "Mahmuda, Yuniarti and Nurul K.",
    },
];

pub const CACHE_LINE: &Term = &Term {
    name: "Cache line",
    text: "Memory is read in lines of 64 bytes. A ray costs each line of the wide tree that it touches, once, whatever part of it is used.",
    source: "Haydel, Kensler, Brunvand and Yuksel 2026",
};

/// The term of a name, for those that code names; a name without a term does not compile.
const fn named(name: &str) -> &'static Term {
    let mut index = 0;
    while index < TERMS.len() {
        if is_same(TERMS[index].name, name) {
            return &TERMS[index];
        }
        index += 1;
    }
    panic!("no term has this name")
}

pub const NODE: &Term = named("Node");
pub const LEAF: &Term = named("Leaf");
pub const DEPTH: &Term = named("Depth");
pub const BUILD_TIME: &Term = named("Build time");
pub const SAH_COST: &Term = named("SAH cost");
pub const TESTS_PER_RAY: &Term = named("Tests per ray");
pub const MRAYS_PER_SECOND: &Term = named("Mray/s");
pub const EPO: &Term = named("EPO");
pub const AREA_SHARE: &Term = named("Area share");
pub const REGRET: &Term = named("Regret");
pub const OVERLAP: &Term = named("Overlap");
pub const PLOC: &Term = named("PLOC");
pub const REINSERTION: &Term = named("Reinsert");
pub const PRIMARY_RAY: &Term = named("Primary ray");
pub const PASS: &Term = named("Pass");
