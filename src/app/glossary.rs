//! The glossary: every term that the window uses, in one or two sentences, with its source.

/// A term of the glossary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each is explained in its text")]
pub enum Term {
    Bvh,
    Node,
    Leaf,
    Container,
    Depth,
    BuildTime,
    SahCost,
    TestsPerRay,
    MraysPerSecond,
    Epo,
    MeasuredCost,
    AreaShare,
    Overlap,
    Aac,
    Cluster,
    Threshold,
    Epsilon,
    MortonCode,
    Stages,
    Lbvh,
    BinnedSah,
    ExactAgglomerative,
    Presplit,
    Restructure,
    Reinsertion,
    Collapse,
    OrderedTraversal,
    PaperTraversal,
    WideTree,
    Simd,
    PrimaryRay,
    Pass,
    HeatMap,
    Paper,
}

impl Term {
    /// All, in the order of the glossary: the tree, its numbers, how it is built, improved and traced.
    pub const ALL: [Self; 34] = [
        Self::Bvh,
        Self::Node,
        Self::Leaf,
        Self::Container,
        Self::Depth,
        Self::BuildTime,
        Self::SahCost,
        Self::TestsPerRay,
        Self::MraysPerSecond,
        Self::Epo,
        Self::MeasuredCost,
        Self::AreaShare,
        Self::Overlap,
        Self::Aac,
        Self::Cluster,
        Self::Threshold,
        Self::Epsilon,
        Self::MortonCode,
        Self::Stages,
        Self::Lbvh,
        Self::BinnedSah,
        Self::ExactAgglomerative,
        Self::Presplit,
        Self::Restructure,
        Self::Reinsertion,
        Self::Collapse,
        Self::OrderedTraversal,
        Self::PaperTraversal,
        Self::WideTree,
        Self::Simd,
        Self::PrimaryRay,
        Self::Pass,
        Self::HeatMap,
        Self::Paper,
    ];

    /// Its name in the glossary.
    pub const fn name(self) -> &'static str {
        self.entry().0
    }

    /// What it means, in one or two sentences.
    pub const fn text(self) -> &'static str {
        self.entry().1
    }

    /// Authors and year of where it comes from; empty for words of this program.
    pub const fn source(self) -> &'static str {
        self.entry().2
    }

    /// Whether name, text or source contain `filter`, in whatever case.
    pub fn matches(self, filter: &str) -> bool {
        let filter = filter.trim().to_lowercase();
        let (name, text, source) = self.entry();
        [name, text, source].iter().any(|part| part.to_lowercase().contains(&filter))
    }

    /// Name, text and source.
    const fn entry(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::Bvh => (
                "BVH",
                "Bounding volume hierarchy: a tree of containers around triangles. A ray that misses a container skips everything inside it.",
                "Rubin and Whitted 1980",
            ),
            Self::Node => (
                "Node",
                "A container of the tree with what it holds: its children, two in the trees that are built here, or triangles. The root holds the whole model.",
                "",
            ),
            Self::Leaf => ("Leaf", "A node that holds triangles instead of children.", ""),
            Self::Container => (
                "Container",
                "The box or sphere around everything below a node, also called its bounding volume. Boxes fit more tightly, spheres are smaller to store.",
                "",
            ),
            Self::Depth => ("Depth", "Levels between a node and the root, whose depth is 0.", ""),
            Self::BuildTime => (
                "Build time",
                "Wall-clock time from the triangles to the finished binary tree, as in the paper. Ready to trace adds the wide tree, which is what other engines' build times include.",
                "",
            ),
            Self::SahCost => (
                "SAH cost",
                "Surface area heuristic: the expected cost of a ray that hits the root, if a node is hit as often as its surface is large. Lower is better; boxes and spheres do not compare.",
                "Goldsmith and Salmon 1987",
            ),
            Self::TestsPerRay => (
                "Tests per ray",
                "How many containers and triangles a primary ray is tested against, on average over the picture. It depends on the view.",
                "",
            ),
            Self::MraysPerSecond => {
                ("Mray/s", "Millions of primary rays per second, with the shading of the picture and all threads.", "")
            }
            Self::Epo => (
                "EPO",
                "End-point overlap: surface that lies inside nodes which do not hold it, where rays end and must visit both. Together with the SAH cost it predicts the speed better than that alone.",
                "Aila, Karras and Laine 2013",
            ),
            Self::MeasuredCost => (
                "Measured cost",
                "What the tests of a ray that enters the root cost on average, counted node by node in the unit of the SAH cost. Random lines, which nothing stops, cost what that predicts.",
                "",
            ),
            Self::AreaShare => (
                "Area share",
                "Surface of a node relative to the root's: how likely a ray that hits the root hits the node as well.",
                "Goldsmith and Salmon 1987",
            ),
            Self::Overlap => (
                "Overlap",
                "Surface of what a node's two children have in common, over the node's own: how many of the rays that hit the node must visit both. Of more children, the sum over all pairs.",
                "",
            ),
            Self::Aac => (
                "AAC",
                "Approximate agglomerative clustering: sorts triangles along a curve, splits them into small groups, and on the way up merges the closest clusters of each group.",
                "Gu, He, Fatahalian and Blelloch 2013",
            ),
            Self::Cluster => (
                "Cluster",
                "A subtree under construction. The two whose common container has the smallest surface are merged first.",
                "Walter, Bala, Kulkarni and Pingali 2008",
            ),
            Self::Threshold => (
                "Threshold δ",
                "Groups of fewer triangles are clustered rather than split. Higher: slower build, fewer tests per ray.",
                "Gu et al. 2013",
            ),
            Self::Epsilon => (
                "Reduction ε",
                "How strongly clusters are reduced before they are handed up: of n remain about n to the power of ½ − ε. Smaller: slower build, better tree.",
                "Gu et al. 2013",
            ),
            Self::MortonCode => (
                "Morton code",
                "The bits of x, y and z of a triangle's centre in turn. Sorted by it, neighbours in space are mostly neighbours in the list.",
                "Morton 1966",
            ),
            Self::Stages => (
                "Stages",
                "Steps of a build, each with its time: bounds, codes, sort, tree, flatten, and a pass each that improves the tree.",
                "",
            ),
            Self::Lbvh => (
                "LBVH",
                "Splits where the highest differing bit of the Morton codes flips. Fastest to build, worst tree.",
                "Lauterbach et al. 2009",
            ),
            Self::BinnedSah => (
                "Binned SAH",
                "Splits from the top where the SAH cost is lowest, tried at a few planes on each axis. Boxes only.",
                "Wald 2007",
            ),
            Self::ExactAgglomerative => (
                "Exact agglomerative",
                "Always merges the closest pair of all clusters. The tree that AAC approximates; small scenes only.",
                "Walter et al. 2008",
            ),
            Self::Presplit => (
                "Split (presplit)",
                "Before the build, puts large triangles into several smaller boxes. Helps walls and beams that are not axis-aligned, and takes more memory.",
                "Ernst and Greiner 2007; Karras and Aila 2013",
            ),
            Self::Restructure => (
                "Restructure",
                "Takes small subtrees apart and builds them again where that lowers the SAH cost.",
                "Karras and Aila 2013",
            ),
            Self::Reinsertion => (
                "Reinsert",
                "Takes subtrees out of the finished tree and puts them where they cost least.",
                "Meister and Bittner 2018",
            ),
            Self::Collapse => (
                "Collapse",
                "Turns subtrees into leaves of several triangles where that is cheaper: fewer nodes, less memory.",
                "Goldsmith and Salmon 1987",
            ),
            Self::OrderedTraversal => (
                "Ordered traversal",
                "A ray visits the nearer child first and skips what lies behind the hit it has. How rays are traced today.",
                "",
            ),
            Self::PaperTraversal => (
                "Paper traversal",
                "Children in stored order, and nothing skipped behind a hit, as the paper prints it. Many more tests.",
                "Mahmuda, Yuniarti, Nurul K., figure 2",
            ),
            Self::WideTree => (
                "Wide tree",
                "The same hierarchy with up to eight children a node, so that one SIMD instruction tests all of them. Pictures are traced through it.",
                "Ylitie, Karras and Laine 2017",
            ),
            Self::Simd => (
                "SIMD level",
                "The processor's instructions that work on several numbers at once, as AVX2 or AVX-512. It changes the speed, not the picture.",
                "",
            ),
            Self::PrimaryRay => {
                ("Primary ray", "A ray from the camera through a pixel. Shadow rays start where it hits.", "")
            }
            Self::Pass => (
                "Pass",
                "Once around all pixels with one sample each. While anything moves there is one coarse pass; at rest, passes add up to a smooth picture.",
                "",
            ),
            Self::HeatMap => (
                "Heat map",
                "A picture whose colours count the tests of each pixel's ray: where the tree is expensive.",
                "",
            ),
            Self::Paper => (
                "The paper",
                "The study of box and sphere trees whose tables and figures the view Paper measures on your own model.",
                "Mahmuda, Yuniarti and Nurul K.",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_term_is_listed_once_and_explained_in_at_most_two_sentences() {
        let names: HashSet<&str> = Term::ALL.iter().map(|term| term.name()).collect();
        assert_eq!(names.len(), Term::ALL.len());
        for term in Term::ALL {
            let sentences = term.text().matches(". ").count() + 1;
            assert!(term.text().ends_with('.') && sentences <= 3, "{}: {}", term.name(), term.text());
        }
    }

    #[test]
    fn a_filter_finds_names_texts_and_authors() {
        let found = |filter: &str| Term::ALL.into_iter().filter(|term| term.matches(filter)).collect::<Vec<_>>();
        assert_eq!(found("sah COST ")[..1], [Term::SahCost]);
        assert_eq!(found("Meister"), [Term::Reinsertion]);
        assert_eq!(found("").len(), Term::ALL.len());
        assert!(found("xyzzy").is_empty());
    }
}
