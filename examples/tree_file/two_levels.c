/* A scene of copies with trees in two levels: the mesh of a file a hundred times on a grid, every second copy mirrored and lying on its side,
 * with a tree of the mesh and one over the copies. The file holds triangles, copies and trees, and is opened as it is.
 *
 *     bvhscope info --triangles mesh.f32 mesh.obj
 *     cc -O2 -I assets examples/tree_file/two_levels.c -o two_levels
 *     ./two_levels mesh.f32 mine.bvh
 *     bvhscope mine.bvh
 */
#include "bvhscope_tree.h"

enum { LEAF_SIZE = 4, SIDE = 10, COPIES = SIDE * SIDE };

/* A tree over boxes: min x, y, z, max x, y, z. */
struct builder {
    float (*boxes)[6];
    uint32_t *indices;
    float (*bounds)[6];
    uint32_t (*children)[2];
    uint32_t (*leaves)[2];
    uint32_t node_count;
};

static float (*sorted_boxes)[6];
static int sort_axis;

static int by_center(const void *a, const void *b) {
    const float *x = sorted_boxes[*(const uint32_t *)a], *y = sorted_boxes[*(const uint32_t *)b];
    const float first = x[sort_axis] + x[sort_axis + 3], second = y[sort_axis] + y[sort_axis + 3];
    return (first > second) - (first < second);
}

static void enlarge(float *box, const float *by) {
    for (int axis = 0; axis < 3; axis++) {
        if (by[axis] < box[axis]) box[axis] = by[axis];
        if (by[axis + 3] > box[axis + 3]) box[axis + 3] = by[axis + 3];
    }
}

/* Makes the node above indices[first..first + count] and everything below it; returns its number. */
static uint32_t build(struct builder *tree, uint32_t first, uint32_t count) {
    const uint32_t node = tree->node_count++;
    float *box = tree->bounds[node];
    memcpy(box, tree->boxes[tree->indices[first]], sizeof *tree->bounds);
    for (uint32_t i = first; i < first + count; i++) enlarge(box, tree->boxes[tree->indices[i]]);
    if (count <= LEAF_SIZE) {
        tree->leaves[node][0] = first;
        tree->leaves[node][1] = count;
        return node;
    }
    sorted_boxes = tree->boxes;
    sort_axis = 0;
    for (int axis = 1; axis < 3; axis++) {
        if (box[axis + 3] - box[axis] > box[sort_axis + 3] - box[sort_axis]) sort_axis = axis;
    }
    qsort(tree->indices + first, count, sizeof *tree->indices, by_center);
    const uint32_t left = build(tree, first, count / 2);
    const uint32_t right = build(tree, first + count / 2, count - count / 2);
    tree->children[node][0] = left;
    tree->children[node][1] = right;
    return node;
}

/* A tree over `count` boxes, at least one. */
static bvhscope_tree tree_over(float (*boxes)[6], uint32_t count) {
    struct builder tree = {boxes, NULL, NULL, NULL, NULL, 0};
    const size_t room = 2 * (size_t)count;
    tree.indices = malloc(room * sizeof *tree.indices);
    tree.bounds = malloc(room * sizeof *tree.bounds);
    tree.children = calloc(room, sizeof *tree.children);
    tree.leaves = calloc(room, sizeof *tree.leaves);
    if (!tree.indices || !tree.bounds || !tree.children || !tree.leaves) exit(1);
    for (uint32_t i = 0; i < count; i++) tree.indices[i] = i;
    build(&tree, 0, count);
    bvhscope_tree made = {0};
    made.arity = 2;
    made.node_count = tree.node_count;
    made.index_count = count;
    made.bounds = tree.bounds[0];
    made.children = tree.children[0];
    made.leaves = tree.leaves[0];
    made.indices = tree.indices;
    return made;
}

int main(int argc, char **argv) {
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "usage: two_levels TRIANGLES OUT, with the file that bvhscope info --triangles writes\n");
        return 2;
    }
    fseek(file, 0, SEEK_END);
    const uint32_t count = (uint32_t)((size_t)ftell(file) / 36);
    rewind(file);
    float (*corners)[3][3] = malloc((count + 1) * sizeof *corners);
    float (*boxes)[6] = malloc((count + 1) * sizeof *boxes);
    if (!corners || !boxes || count == 0 || fread(corners, sizeof *corners, count, file) != count) return 1;
    fclose(file);
    float size = 0;
    for (uint32_t i = 0; i < count; i++) {
        for (int corner = 0; corner < 3; corner++) {
            float point[6];
            for (int axis = 0; axis < 6; axis++) {
                point[axis] = corners[i][corner][axis % 3];
                if (point[axis] > size) size = point[axis];
                if (-point[axis] > size) size = -point[axis];
            }
            if (corner == 0) memcpy(boxes[i], point, sizeof point);
            enlarge(boxes[i], point);
        }
    }
    bvhscope_tree mesh = tree_over(boxes, count);
    mesh.triangle_count = count;
    mesh.corners = corners[0][0];

    /* The rows of the matrices only move, swap and mirror axes, so that the box of a copy is that of the mesh, moved. */
    static float matrices[COPIES][3][4], places[COPIES][6];
    static uint32_t instances[COPIES];
    for (int i = 0; i < COPIES; i++) {
        for (int row = 0; row < 3; row++) {
            const int from = i % 2 ? (row + 1) % 3 : row;
            const float factor = i % 2 && row == 1 ? -1.0f : 1.0f;
            const float move = row == 0 ? 2.5f * size * (float)(i % SIDE) : row == 2 ? 2.5f * size * (float)(i / SIDE) : 0.0f;
            const float low = factor * mesh.bounds[factor < 0 ? from + 3 : from];
            const float high = factor * mesh.bounds[factor < 0 ? from : from + 3];
            matrices[i][row][from] = factor;
            matrices[i][row][3] = move;
            places[i][row] = low + move;
            places[i][row + 3] = high + move;
        }
    }

    bvhscope_two_levels trees = {0};
    trees.mesh_count = 1;
    trees.meshes = &mesh;
    trees.top = tree_over(places, COPIES);
    trees.instance_count = COPIES;
    trees.instances = instances;
    trees.matrices = matrices[0][0];
    trees.builder = "median split";
    const char *fault = bvhscope_two_levels_write(argv[2], &trees);
    if (fault) fprintf(stderr, "%s: %s\n", argv[2], fault);
    return fault != NULL;
}
