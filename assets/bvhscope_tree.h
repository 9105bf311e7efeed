/* bvhscope_tree.h: writes a bounding volume hierarchy as a file that bvhscope shows, traces and measures:
 *
 *     bvhscope mesh.obj --tree mine.bvh
 *
 * One header of C99 or C++11 without dependencies. Copy it into your program, fill in a `bvhscope_tree` and call
 * `bvhscope_tree_write`; for trees of meshes below one over copies of them a `bvhscope_two_levels` and call
 * `bvhscope_two_levels_write`. The format is described in docs/tree-file.md; examples are in examples/tree_file/.
 *
 * The header is part of bvhscope and licensed like it, under MIT or Apache-2.0, at your option. */
#ifndef BVHSCOPE_TREE_H
#define BVHSCOPE_TREE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An empty slot among the children of a node. */
#define BVHSCOPE_EMPTY UINT32_MAX

/* Meaning of a node's numbers in `bounds`. */
enum bvhscope_container {
    BVHSCOPE_BOX = 0, /* min x, y, z, max x, y, z */
    BVHSCOPE_SPHERE = 1, /* center x, y, z, radius */
    BVHSCOPE_DOP = 2, /* min x, y, z, max x, y, z, then low and high of x+y+z, x+y-z, x-y+z, x-y-z: four low, four high */
    BVHSCOPE_ORIENTED = 3 /* min x, y, z, max x, y, z, three normals x, y, z, then low and high along each: three low, three high */
};

/* A tree: counts, and pointers to arrays that stay yours. Begin with `bvhscope_tree tree = {0};` (in C++: `{}`), so that
 * fields that are not set are left out. */
typedef struct bvhscope_tree {
    uint32_t arity;           /* most children of a node, 2 to 32 */
    enum bvhscope_container container;
    uint32_t node_count;      /* leaves included; node 0 is the root */
    uint32_t index_count;     /* primitives in all leaves; more than triangles where these are split */
    uint32_t triangle_count;  /* triangles of the mesh */
    const float *bounds;      /* node_count x 6 (boxes), x 4 (spheres), x 14 (DOPs) or x 21 (oriented): of every node, in world space */
    const uint32_t *children; /* node_count x arity: the children of an interior node, BVHSCOPE_EMPTY for none */
    const uint32_t *leaves;   /* node_count x 2: first index and number of indices of a leaf, 0 and 0 of an interior node */
    const uint32_t *indices;  /* index_count: numbers of triangles, from 0 */
    const float *corners;     /* optional, triangle_count x 9: the triangles, so that the file is model and tree in one */
    const char *builder;      /* optional: name of the builder, UTF-8 */
    const char *settings;     /* optional: its settings, UTF-8 */
    double build_ms;          /* optional: milliseconds that the build took */
} bvhscope_tree;

/* Writes `tree` to the file `path`, through the file `path` + ".part", so that an existing file stays whole until its
 * successor is complete. Returns NULL, or the error in one line. Works on machines of either byte order. */
static inline const char *bvhscope_tree_write(const char *path, const bvhscope_tree *tree);

/* Trees in two levels: one for each mesh, in its own coordinates, and one over copies of the meshes, the instances. Begin with `{0}` as
 * well. All trees are of boxes and have the same arity; either all meshes have corners or none has. `builder`, `settings` and `build_ms` of
 * single trees are not written. */
typedef struct bvhscope_two_levels {
    uint32_t mesh_count;
    const bvhscope_tree *meshes; /* mesh_count */
    bvhscope_tree top;           /* over the instances, in world space; its indices are theirs, each in one leaf, and triangle_count is not read */
    uint32_t instance_count;
    const uint32_t *instances;   /* instance_count: the mesh of each, from 0 */
    const float *matrices;       /* instance_count x 12: three rows of four, the last of each row being the translation */
    const uint32_t *ids;         /* optional, instance_count: numbers of your own */
    const char *builder;         /* optional: name of the builder, UTF-8 */
    const char *settings;        /* optional: its settings, UTF-8 */
    double build_ms;             /* optional: milliseconds that the build of all trees took */
} bvhscope_two_levels;

/* Writes `trees` as `bvhscope_tree_write` does. */
static inline const char *bvhscope_two_levels_write(const char *path, const bvhscope_two_levels *trees);

/* Everything below is private. */

/* Most bytes of a name in the header, which may take 1 MiB; a byte takes up to 6 when it is escaped. */
#define BVHSCOPE_LONGEST_TEXT 65536

/* Writes `count` numbers of 32 bits in little-endian order. */
static inline int bvhscope_private_words(FILE *file, const void *words, uint64_t count) {
    const unsigned char *source = (const unsigned char *)words;
    unsigned char bytes[4096];
    while (count > 0) {
        const size_t now = count < sizeof bytes / 4 ? (size_t)count : sizeof bytes / 4;
        for (size_t i = 0; i < now; i++) {
            uint32_t word;
            memcpy(&word, source + 4 * i, 4);
            bytes[4 * i] = (unsigned char)(word & 255);
            bytes[4 * i + 1] = (unsigned char)(word >> 8 & 255);
            bytes[4 * i + 2] = (unsigned char)(word >> 16 & 255);
            bytes[4 * i + 3] = (unsigned char)(word >> 24);
        }
        if (fwrite(bytes, 4, now, file) != now) return 0;
        source += 4 * now;
        count -= now;
    }
    return 1;
}

/* Writes `,"name":"text"` as JSON; nothing where there is no text. */
static inline void bvhscope_private_text(FILE *file, const char *name, const char *text) {
    if (!text) return;
    fprintf(file, ",\"%s\":\"", name);
    for (; *text; text++) {
        const unsigned char byte = (unsigned char)*text;
        if (byte == '"' || byte == '\\') fputc('\\', file);
        if (byte < 32) {
            fprintf(file, "\\u%04x", byte);
        } else {
            fputc(byte, file);
        }
    }
    fputc('"', file);
}

/* Numbers in the bounds of a node; 0 for an unknown container. */
static inline uint64_t bvhscope_private_width(const bvhscope_tree *tree) {
    switch (tree->container) {
        case BVHSCOPE_BOX: return 6;
        case BVHSCOPE_SPHERE: return 4;
        case BVHSCOPE_DOP: return 14;
        case BVHSCOPE_ORIENTED: return 21;
    }
    return 0;
}

static inline const char *bvhscope_private_texts_fault(const char *builder, const char *settings) {
    if (builder && strlen(builder) > BVHSCOPE_LONGEST_TEXT) return "builder is longer than 65536 bytes";
    if (settings && strlen(settings) > BVHSCOPE_LONGEST_TEXT) return "settings are longer than 65536 bytes";
    return NULL;
}

static inline const char *bvhscope_private_fault(const bvhscope_tree *tree) {
    if (sizeof(float) != 4) return "float has not 32 bits on this machine";
    if (!bvhscope_private_width(tree)) return "container is neither box, sphere, DOP nor oriented";
    if (tree->arity < 2 || tree->arity > 32) return "arity is not 2 to 32";
    if (tree->node_count > 0 && !(tree->bounds && tree->children && tree->leaves)) return "an array of the nodes is missing";
    if (tree->index_count > 0 && !tree->indices) return "the indices are missing";
    return bvhscope_private_texts_fault(tree->builder, tree->settings);
}

/* Writes builder, settings and time where they are given. */
static inline void bvhscope_private_origin(FILE *file, const char *builder, const char *settings, double build_ms) {
    bvhscope_private_text(file, "builder", builder);
    bvhscope_private_text(file, "settings", settings);
    if (build_ms > 0 && build_ms < 1e12) {
        /* As whole numbers, because the decimal point of fprintf depends on the locale. */
        const unsigned long long micros = (unsigned long long)(build_ms * 1000 + 0.5);
        fprintf(file, ",\"build_ms\":%llu.%03llu", micros / 1000, micros % 1000);
    }
}

static inline int bvhscope_private_all(FILE *file, const void *from) {
    const bvhscope_tree *tree = (const bvhscope_tree *)from;
    const uint64_t nodes = tree->node_count;
    const uint64_t bounds = nodes * bvhscope_private_width(tree);
    const uint64_t children = nodes * tree->arity, leaves = nodes * 2, indices = tree->index_count;
    const uint64_t corners = tree->corners ? (uint64_t)tree->triangle_count * 9 : 0;

    static const char *const names[] = {"box", "sphere", "dop", "oriented"};
    fprintf(file, "bvhscope tree 1\n{\"container\":\"%s\"", names[tree->container]);
    fprintf(file, ",\"arity\":%lu,\"nodes\":%lu", (unsigned long)tree->arity, (unsigned long)nodes);
    fprintf(file, ",\"indices\":%lu,\"triangles\":%lu", (unsigned long)indices, (unsigned long)tree->triangle_count);
    bvhscope_private_origin(file, tree->builder, tree->settings, tree->build_ms);
    fprintf(file, ",\"arrays\":{\"bounds\":0,\"children\":%llu", (unsigned long long)(4 * bounds));
    fprintf(file, ",\"leaves\":%llu", (unsigned long long)(4 * (bounds + children)));
    fprintf(file, ",\"indices\":%llu", (unsigned long long)(4 * (bounds + children + leaves)));
    if (corners > 0) fprintf(file, ",\"corners\":%llu", (unsigned long long)(4 * (bounds + children + leaves + indices)));
    fputs("}}\n", file);

    return bvhscope_private_words(file, tree->bounds, bounds) && bvhscope_private_words(file, tree->children, children) &&
           bvhscope_private_words(file, tree->leaves, leaves) && bvhscope_private_words(file, tree->indices, indices) &&
           bvhscope_private_words(file, tree->corners, corners) && !ferror(file);
}

/* The tree of a mesh, and for the number of meshes the one over the instances. */
static inline const bvhscope_tree *bvhscope_private_of(const bvhscope_two_levels *trees, uint32_t number) {
    return number < trees->mesh_count ? &trees->meshes[number] : &trees->top;
}

static inline const char *bvhscope_private_levels_fault(const bvhscope_two_levels *trees) {
    uint64_t nodes = 0, indices = 0, triangles = 0;
    if (trees->mesh_count == 0 || !trees->meshes) return "there are no meshes";
    if (trees->instance_count == 0 || !trees->instances || !trees->matrices) return "there are no instances";
    for (uint32_t i = 0; i <= trees->mesh_count; i++) {
        const bvhscope_tree *tree = bvhscope_private_of(trees, i);
        const char *fault = bvhscope_private_fault(tree);
        if (fault) return fault;
        if (tree->container != BVHSCOPE_BOX) return "trees in two levels are of boxes";
        if (tree->arity != trees->top.arity) return "the trees have different arities";
        if (i < trees->mesh_count && !tree->corners != !trees->meshes[0].corners) return "some meshes have corners and some have none";
        nodes += tree->node_count;
        indices += tree->index_count;
        triangles += i < trees->mesh_count ? tree->triangle_count : 0;
    }
    if (nodes > UINT32_MAX || indices > UINT32_MAX || triangles > UINT32_MAX) return "there are more than 4294967295 nodes, indices or triangles";
    return bvhscope_private_texts_fault(trees->builder, trees->settings);
}

static inline int bvhscope_private_all_levels(FILE *file, const void *from) {
    const bvhscope_two_levels *trees = (const bvhscope_two_levels *)from;
    const uint64_t meshes = trees->mesh_count, instances = trees->instance_count;
    const int has_corners = trees->meshes[0].corners != NULL;
    uint64_t nodes = 0, indices = 0, triangles = 0;
    for (uint32_t i = 0; i <= meshes; i++) {
        const bvhscope_tree *tree = bvhscope_private_of(trees, i);
        nodes += tree->node_count;
        indices += tree->index_count;
        triangles += i < meshes ? tree->triangle_count : 0;
    }
    fprintf(file, "bvhscope tree 2\n{\"container\":\"box\",\"arity\":%lu", (unsigned long)trees->top.arity);
    fprintf(file, ",\"nodes\":%lu,\"indices\":%lu", (unsigned long)nodes, (unsigned long)indices);
    fprintf(file, ",\"triangles\":%lu,\"trees\":%lu", (unsigned long)triangles, (unsigned long)(meshes + 1));
    fprintf(file, ",\"instances\":%lu", (unsigned long)instances);
    bvhscope_private_origin(file, trees->builder, trees->settings, trees->build_ms);
    uint64_t end = 4 * 6 * nodes;
    fprintf(file, ",\"arrays\":{\"bounds\":0,\"children\":%llu", (unsigned long long)end);
    fprintf(file, ",\"leaves\":%llu", (unsigned long long)(end += 4 * nodes * trees->top.arity));
    fprintf(file, ",\"indices\":%llu", (unsigned long long)(end += 8 * nodes));
    end += 4 * indices;
    if (has_corners) fprintf(file, ",\"corners\":%llu", (unsigned long long)end);
    end += has_corners ? 36 * triangles : 0;
    fprintf(file, ",\"trees\":%llu", (unsigned long long)end);
    fprintf(file, ",\"instances\":%llu", (unsigned long long)(end += 12 * (meshes + 1)));
    fprintf(file, ",\"matrices\":%llu", (unsigned long long)(end += 4 * instances));
    if (trees->ids) fprintf(file, ",\"ids\":%llu", (unsigned long long)(end + 48 * instances));
    fputs("}}\n", file);

    int written = 1;
    /* Each array of all trees, one tree after the other. */
    for (int part = 0; part < 6; part++) {
        for (uint32_t i = 0; written && i <= meshes; i++) {
            const bvhscope_tree *tree = bvhscope_private_of(trees, i);
            const uint64_t count = tree->node_count;
            const uint32_t row[3] = {tree->node_count, tree->index_count, i < meshes ? tree->triangle_count : trees->instance_count};
            switch (part) {
                case 0: written = bvhscope_private_words(file, tree->bounds, 6 * count); break;
                case 1: written = bvhscope_private_words(file, tree->children, count * tree->arity); break;
                case 2: written = bvhscope_private_words(file, tree->leaves, 2 * count); break;
                case 3: written = bvhscope_private_words(file, tree->indices, tree->index_count); break;
                case 4:
                    if (has_corners && i < meshes) written = bvhscope_private_words(file, tree->corners, 9 * (uint64_t)tree->triangle_count);
                    break;
                default: written = bvhscope_private_words(file, row, 3);
            }
        }
    }
    return written && bvhscope_private_words(file, trees->instances, instances) &&
           bvhscope_private_words(file, trees->matrices, 12 * instances) &&
           (!trees->ids || bvhscope_private_words(file, trees->ids, instances)) && !ferror(file);
}

/* Writes the file `path` with `all`, which takes `from`. */
static inline const char *bvhscope_private_file(const char *path, int (*all)(FILE *, const void *), const void *from) {
    const char *fault = NULL;
    const size_t length = strlen(path);
    char *part = (char *)malloc(length + 6);
    if (!part) return "no memory";
    memcpy(part, path, length);
    memcpy(part + length, ".part", 6);

    FILE *file = fopen(part, "wb");
    if (!file) {
        fault = "the file cannot be created";
    } else {
        const int written = all(file, from);
        const int closed = fclose(file) == 0;
        if (!written || !closed) {
            fault = "the file cannot be written; is the disk full?";
        } else {
#ifdef _WIN32
            /* Windows does not rename onto an existing file. */
            remove(path);
#endif
            if (rename(part, path) != 0) fault = "the file cannot be given its name; is there a folder of that name?";
        }
        if (fault) remove(part);
    }
    free(part);
    return fault;
}

static inline const char *bvhscope_tree_write(const char *path, const bvhscope_tree *tree) {
    const char *fault = bvhscope_private_fault(tree);
    return fault ? fault : bvhscope_private_file(path, bvhscope_private_all, tree);
}

static inline const char *bvhscope_two_levels_write(const char *path, const bvhscope_two_levels *trees) {
    const char *fault = bvhscope_private_levels_fault(trees);
    return fault ? fault : bvhscope_private_file(path, bvhscope_private_all_levels, trees);
}

#ifdef __cplusplus
}
#endif

#endif
