/* A small builder that writes its tree as a file for bvhscope: halves the triangles at the median of their centers along the
 * longest axis, until at most four are left.
 *
 *     bvhscope info --triangles mesh.f32 mesh.obj
 *     cc -O2 -I assets examples/tree_file/median_split.c -o median_split
 *     ./median_split mesh.f32 mine.bvh
 *     bvhscope mesh.obj --tree mine.bvh
 */
#include "bvhscope_tree.h"

enum { LEAF_SIZE = 4 };

static float (*triangles)[3][3];
static uint32_t *indices;
static float (*bounds)[6];
static uint32_t (*children)[2];
static uint32_t (*leaves)[2];
static uint32_t node_count;
static int sort_axis;

/* Three times the coordinate of a triangle's center. */
static float center(uint32_t triangle, int axis) {
    float(*t)[3] = triangles[triangle];
    return t[0][axis] + t[1][axis] + t[2][axis];
}

static int by_center(const void *a, const void *b) {
    const float x = center(*(const uint32_t *)a, sort_axis), y = center(*(const uint32_t *)b, sort_axis);
    return (x > y) - (x < y);
}

/* Makes the node above indices[first..first + count] and everything below it; returns its number. */
static uint32_t build(uint32_t first, uint32_t count) {
    const uint32_t node = node_count++;
    float *box = bounds[node];
    for (int axis = 0; axis < 3; axis++) {
        box[axis] = box[axis + 3] = triangles[indices[first]][0][axis];
        for (uint32_t i = first; i < first + count; i++) {
            for (int corner = 0; corner < 3; corner++) {
                const float x = triangles[indices[i]][corner][axis];
                if (x < box[axis]) box[axis] = x;
                if (x > box[axis + 3]) box[axis + 3] = x;
            }
        }
    }
    if (count <= LEAF_SIZE) {
        leaves[node][0] = first;
        leaves[node][1] = count;
        return node;
    }
    sort_axis = 0;
    for (int axis = 1; axis < 3; axis++) {
        if (box[axis + 3] - box[axis] > box[sort_axis + 3] - box[sort_axis]) sort_axis = axis;
    }
    qsort(indices + first, count, sizeof *indices, by_center);
    children[node][0] = build(first, count / 2);
    children[node][1] = build(first + count / 2, count - count / 2);
    return node;
}

int main(int argc, char **argv) {
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "usage: median_split TRIANGLES OUT, with the file that bvhscope info --triangles writes\n");
        return 2;
    }
    fseek(file, 0, SEEK_END);
    const uint32_t count = (uint32_t)((size_t)ftell(file) / sizeof *triangles);
    rewind(file);
    /* One more than needed, so that nothing is a request of no memory. */
    const size_t room = 2 * (size_t)count + 1;
    triangles = malloc(room * sizeof *triangles);
    indices = malloc(room * sizeof *indices);
    bounds = malloc(room * sizeof *bounds);
    children = calloc(room, sizeof *children);
    leaves = calloc(room, sizeof *leaves);
    if (!triangles || !indices || !bounds || !children || !leaves) return 1;
    if (fread(triangles, sizeof *triangles, count, file) != count) return 1;
    fclose(file);

    for (uint32_t i = 0; i < count; i++) indices[i] = i;
    if (count > 0) build(0, count);

    bvhscope_tree tree = {0};
    tree.arity = 2;
    tree.node_count = node_count;
    tree.index_count = tree.triangle_count = count;
    tree.bounds = bounds[0];
    tree.children = children[0];
    tree.leaves = leaves[0];
    tree.indices = indices;
    tree.builder = "median split";
    const char *fault = bvhscope_tree_write(argv[2], &tree);
    if (fault) fprintf(stderr, "%s: %s\n", argv[2], fault);
    return fault != NULL;
}
