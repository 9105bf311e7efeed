/* Writes two files with every field of bvhscope_tree between them: compiled as C99 and as C++11 by the test. */
#include "bvhscope_tree.h"

/* Three triangles across the x axis, at 1, 2 and 11. */
static const float corners[27] = {1, 0, 0, 1, 1, 0, 1, 0, 1, 2, 0, 0, 2, 1, 0, 2, 0, 1, 11, 0, 0, 11, 1, 0, 11, 0, 1};

static int report(const char *fault) {
    if (fault) puts(fault);
    return fault != NULL;
}

static int boxes(const char *path) {
    static const float bounds[30] = {1, 0, 0, 11, 1, 1, 11, 0, 0, 11, 1, 1, 1, 0, 0,
                                     2, 1, 1, 1,  0, 0, 1,  1, 1, 2,  0, 0, 2, 1, 1};
    static const uint32_t none = BVHSCOPE_EMPTY;
    const uint32_t children[15] = {2, none, 1, 0, 0, 0, 3, 4, none, 0, 0, 0, 0, 0, 0};
    static const uint32_t leaves[10] = {0, 0, 2, 1, 0, 0, 0, 1, 1, 1};
    static const uint32_t indices[3] = {0, 1, 2};
    bvhscope_tree tree;
    memset(&tree, 0, sizeof tree);
    tree.arity = 3;
    tree.container = BVHSCOPE_BOX;
    tree.node_count = 5;
    tree.index_count = 3;
    tree.triangle_count = 3;
    tree.bounds = bounds;
    tree.children = children;
    tree.leaves = leaves;
    tree.indices = indices;
    tree.corners = corners;
    tree.builder = "by \"hand\"\\\n\xc3\xa9";
    tree.settings = "none";
    tree.build_ms = 12.3456;
    return report(bvhscope_tree_write(path, &tree));
}

static int spheres(const char *path) {
    static const float bounds[4] = {6, 0.5f, 0.5f, 6};
    static const uint32_t children[2] = {0, 0}, leaves[2] = {0, 3}, indices[3] = {2, 1, 0};
    bvhscope_tree tree;
    memset(&tree, 0, sizeof tree);
    tree.arity = 2;
    tree.container = BVHSCOPE_SPHERE;
    tree.node_count = 1;
    tree.index_count = tree.triangle_count = 3;
    tree.bounds = bounds;
    tree.children = children;
    tree.leaves = leaves;
    tree.indices = indices;
    return report(bvhscope_tree_write(path, &tree));
}

/* Each line that is printed is what is wrong with a call. */
static void refusals(const char *path) {
    bvhscope_tree tree;
    memset(&tree, 0, sizeof tree);
    report(bvhscope_tree_write(path, &tree));
    tree.arity = 2;
    tree.node_count = 1;
    report(bvhscope_tree_write(path, &tree));
    tree.node_count = 0;
    report(bvhscope_tree_write("no/such/folder/x.bvh", &tree));
    report(bvhscope_tree_write(".", &tree));
}

int main(int argc, char **argv) {
    if (argc != 4) return 2;
    refusals(argv[3]);
    return boxes(argv[1]) | spheres(argv[2]);
}
