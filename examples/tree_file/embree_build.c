/* Builds a tree with Embree's own builder and writes it as a file for bvhscope.
 *
 *     bvhscope info --triangles mesh.f32 mesh.obj
 *     cc -O2 -I assets examples/tree_file/embree_build.c -lembree3 -o embree_build      (or -lembree4)
 *     ./embree_build mesh.f32 high 4 embree.bvh
 *     bvhscope mesh.obj --tree embree.bvh
 *
 * Needs Embree 3 or 4: Debian's package libembree-dev. The tree inside an Embree scene cannot be read; this one comes from the
 * same builder through rtcBuildBVH, which hands its nodes to callbacks. Qualities: low (Morton codes), medium (binned SAH) and
 * high (SAH with spatial splits, for which it calls `split` below). */
#if defined(__has_include)
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#else
#include <embree3/rtcore.h>
#endif

#include "bvhscope_tree.h"

#include <time.h>

enum { MOST_CHILDREN = 8, MAX_LEAF_SIZE = 4 };

typedef float triangle[3][3];

/* A node as the callbacks build it; a leaf has primitives, any other node children. */
typedef struct node {
    float bounds[6];
    uint32_t child_count, primitive_count;
    union {
        struct node *children[MOST_CHILDREN];
        uint32_t primitives[MAX_LEAF_SIZE];
    } below;
} node;

static void extend(float *box, const float *low, const float *high) {
    for (int axis = 0; axis < 3; axis++) {
        if (low[axis] < box[axis]) box[axis] = low[axis];
        if (high[axis] > box[axis + 3]) box[axis + 3] = high[axis];
    }
}

static void make_empty(float *box) {
    for (int axis = 0; axis < 3; axis++) {
        box[axis] = 1e30f;
        box[axis + 3] = -1e30f;
    }
}

static node *new_node(RTCThreadLocalAllocator allocator) {
    node *made = rtcThreadLocalAlloc(allocator, sizeof(node), 16);
    memset(made, 0, sizeof *made);
    make_empty(made->bounds);
    return made;
}

static void *create_node(RTCThreadLocalAllocator allocator, unsigned int child_count, void *user) {
    (void)user;
    node *made = new_node(allocator);
    made->child_count = child_count;
    return made;
}

static void set_children(void *parent, void **children, unsigned int child_count, void *user) {
    (void)user;
    for (unsigned int i = 0; i < child_count; i++) ((node *)parent)->below.children[i] = children[i];
}

/* Bounds of children may be larger than what is below them; those of the parent are around all of them. */
static void set_bounds(void *parent, const struct RTCBounds **bounds, unsigned int child_count, void *user) {
    (void)user;
    for (unsigned int i = 0; i < child_count; i++) {
        extend(((node *)parent)->bounds, &bounds[i]->lower_x, &bounds[i]->upper_x);
    }
}

static void *create_leaf(RTCThreadLocalAllocator allocator, const struct RTCBuildPrimitive *primitives, size_t count,
                         void *user) {
    (void)user;
    node *made = new_node(allocator);
    made->primitive_count = (uint32_t)count;
    for (size_t i = 0; i < count; i++) {
        extend(made->bounds, &primitives[i].lower_x, &primitives[i].upper_x);
        made->below.primitives[i] = primitives[i].primID;
    }
    return made;
}

static float clamp(float x, float low, float high) {
    return x < low ? low : x > high ? high : x;
}

/* Bounds of the part of a triangle on either side of a plane, within those that it has already. */
static void split(const struct RTCBuildPrimitive *primitive, unsigned int axis, float position, struct RTCBounds *left,
                  struct RTCBounds *right, void *user) {
    float(*corners)[3] = ((triangle *)user)[primitive->primID];
    float boxes[2][6];
    make_empty(boxes[0]);
    make_empty(boxes[1]);
    for (int i = 0; i < 3; i++) {
        const float *a = corners[i], *b = corners[(i + 1) % 3];
        if (a[axis] <= position) extend(boxes[0], a, a);
        if (a[axis] >= position) extend(boxes[1], a, a);
        if ((a[axis] < position && position < b[axis]) || (b[axis] < position && position < a[axis])) {
            const float s = (position - a[axis]) / (b[axis] - a[axis]);
            float cut[3];
            for (int k = 0; k < 3; k++) cut[k] = a[k] + s * (b[k] - a[k]);
            cut[axis] = position;
            extend(boxes[0], cut, cut);
            extend(boxes[1], cut, cut);
        }
    }
    const float *low = &primitive->lower_x, *high = &primitive->upper_x;
    for (int side = 0; side < 2; side++) {
        float *out_low = side == 0 ? &left->lower_x : &right->lower_x;
        float *out_high = side == 0 ? &left->upper_x : &right->upper_x;
        for (int k = 0; k < 3; k++) {
            /* Clamped at both ends, so that no rounding turns a flat box inside out. */
            out_low[k] = clamp(boxes[side][k], low[k], high[k]);
            out_high[k] = clamp(boxes[side][k + 3], low[k], high[k]);
        }
    }
}

/* The arrays of a file for the tree below `root`, level by level. Returns what went wrong, or NULL. */
static const char *write_tree(const char *path, const node *root, size_t capacity, bvhscope_tree tree) {
    const node **nodes = malloc(capacity * sizeof *nodes);
    float(*bounds)[6] = malloc(capacity * sizeof *bounds);
    uint32_t *children = malloc(capacity * tree.arity * sizeof *children);
    uint32_t(*leaves)[2] = calloc(capacity, sizeof *leaves);
    uint32_t *indices = malloc(capacity * sizeof *indices);
    if (!nodes || !bounds || !children || !leaves || !indices) return "no memory";

    if (root) nodes[tree.node_count++] = root;
    for (uint32_t at = 0; at < tree.node_count; at++) {
        const node *from = nodes[at];
        memcpy(bounds[at], from->bounds, sizeof *bounds);
        for (uint32_t slot = 0; slot < tree.arity; slot++) {
            const int used = slot < from->child_count;
            children[(size_t)at * tree.arity + slot] = used ? tree.node_count : BVHSCOPE_EMPTY;
            if (used) nodes[tree.node_count++] = from->below.children[slot];
        }
        leaves[at][0] = from->primitive_count > 0 ? tree.index_count : 0;
        leaves[at][1] = from->primitive_count;
        for (uint32_t i = 0; i < from->primitive_count; i++) indices[tree.index_count++] = from->below.primitives[i];
    }
    tree.bounds = bounds[0];
    tree.children = children;
    tree.leaves = leaves[0];
    tree.indices = indices;
    return bvhscope_tree_write(path, &tree);
}

static double now_ms(void) {
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

int main(int argc, char **argv) {
    static const char *const names[] = {"low", "medium", "high"};
    int quality = 0;
    while (argc == 5 && quality < 3 && strcmp(argv[2], names[quality]) != 0) quality++;
    const int arity = argc == 5 ? atoi(argv[3]) : 0;
    FILE *file = argc == 5 ? fopen(argv[1], "rb") : NULL;
    if (!file || quality > 2 || arity < 2 || arity > MOST_CHILDREN) {
        fprintf(stderr, "usage: embree_build TRIANGLES low|medium|high ARITY OUT, with the file that bvhscope info --triangles "
                        "writes and an arity of 2 to %d\n", MOST_CHILDREN);
        return 2;
    }
    fseek(file, 0, SEEK_END);
    const uint32_t count = (uint32_t)((size_t)ftell(file) / sizeof(triangle));
    rewind(file);
    /* Embree's high quality splits as long as there is room for the parts. */
    const uint32_t capacity = quality == 2 ? 2 * count : count;
    triangle *triangles = malloc((count + 1) * sizeof *triangles);
    struct RTCBuildPrimitive *primitives = aligned_alloc(32, ((size_t)capacity + 1) * sizeof *primitives);
    if (!triangles || !primitives || fread(triangles, sizeof *triangles, count, file) != count) return 1;
    fclose(file);
    for (uint32_t i = 0; i < count; i++) {
        float box[6];
        make_empty(box);
        for (int corner = 0; corner < 3; corner++) extend(box, triangles[i][corner], triangles[i][corner]);
        memcpy(&primitives[i].lower_x, box, 3 * sizeof *box);
        memcpy(&primitives[i].upper_x, box + 3, 3 * sizeof *box);
        primitives[i].geomID = 0;
        primitives[i].primID = i;
    }

    RTCDevice device = rtcNewDevice(NULL);
    RTCBVH bvh = rtcNewBVH(device);
    struct RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.buildQuality = (enum RTCBuildQuality)quality;
    arguments.maxBranchingFactor = (unsigned int)arity;
    arguments.maxDepth = 1024;
    arguments.maxLeafSize = MAX_LEAF_SIZE;
    arguments.bvh = bvh;
    arguments.primitives = primitives;
    arguments.primitiveCount = count;
    arguments.primitiveArrayCapacity = capacity;
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.splitPrimitive = quality == 2 ? split : NULL;
    arguments.userPtr = triangles;
    const double start = now_ms();
    const node *root = count > 0 ? rtcBuildBVH(&arguments) : NULL;
    const double end = now_ms();
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) {
        fprintf(stderr, "Embree reports an error\n");
        return 1;
    }

    char settings[64];
    snprintf(settings, sizeof settings, "%s quality, leaves of %d", names[quality], MAX_LEAF_SIZE);
    bvhscope_tree tree = {0};
    tree.arity = (uint32_t)arity;
    tree.triangle_count = count;
    tree.builder = "Embree " RTC_VERSION_STRING;
    tree.settings = settings;
    tree.build_ms = end - start;
    /* Every leaf has a primitive, every other node at least two children. */
    const char *fault = write_tree(argv[4], root, 2 * (size_t)capacity + 1, tree);
    if (fault) fprintf(stderr, "%s: %s\n", argv[4], fault);
    rtcReleaseBVH(bvh);
    rtcReleaseDevice(device);
    return fault != NULL;
}
