/* bvhscope_tree.h: writes a bounding volume hierarchy as a file that bvhscope shows, traces and measures:
 *
 *     bvhscope mesh.obj --tree mine.bvh
 *
 * One header of C99 or C++11 without dependencies. Copy it into your program, fill in a `bvhscope_tree` and call
 * `bvhscope_tree_write`. The format is described in docs/tree-file.md; examples are in examples/tree_file/.
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

static inline const char *bvhscope_private_fault(const bvhscope_tree *tree) {
    if (sizeof(float) != 4) return "float has not 32 bits on this machine";
    if (!bvhscope_private_width(tree)) return "container is neither box, sphere, DOP nor oriented";
    if (tree->arity < 2 || tree->arity > 32) return "arity is not 2 to 32";
    if (tree->node_count > 0 && !(tree->bounds && tree->children && tree->leaves)) return "an array of the nodes is missing";
    if (tree->index_count > 0 && !tree->indices) return "the indices are missing";
    if (tree->builder && strlen(tree->builder) > BVHSCOPE_LONGEST_TEXT) return "builder is longer than 65536 bytes";
    if (tree->settings && strlen(tree->settings) > BVHSCOPE_LONGEST_TEXT) return "settings are longer than 65536 bytes";
    return NULL;
}

static inline int bvhscope_private_all(FILE *file, const bvhscope_tree *tree) {
    const uint64_t nodes = tree->node_count;
    const uint64_t bounds = nodes * bvhscope_private_width(tree);
    const uint64_t children = nodes * tree->arity, leaves = nodes * 2, indices = tree->index_count;
    const uint64_t corners = tree->corners ? (uint64_t)tree->triangle_count * 9 : 0;

    static const char *const names[] = {"box", "sphere", "dop", "oriented"};
    fprintf(file, "bvhscope tree 1\n{\"container\":\"%s\"", names[tree->container]);
    fprintf(file, ",\"arity\":%lu,\"nodes\":%lu", (unsigned long)tree->arity, (unsigned long)nodes);
    fprintf(file, ",\"indices\":%lu,\"triangles\":%lu", (unsigned long)indices, (unsigned long)tree->triangle_count);
    bvhscope_private_text(file, "builder", tree->builder);
    bvhscope_private_text(file, "settings", tree->settings);
    if (tree->build_ms > 0 && tree->build_ms < 1e12) {
        /* As whole numbers, because the decimal point of fprintf depends on the locale. */
        const unsigned long long micros = (unsigned long long)(tree->build_ms * 1000 + 0.5);
        fprintf(file, ",\"build_ms\":%llu.%03llu", micros / 1000, micros % 1000);
    }
    fprintf(file, ",\"arrays\":{\"bounds\":0,\"children\":%llu", (unsigned long long)(4 * bounds));
    fprintf(file, ",\"leaves\":%llu", (unsigned long long)(4 * (bounds + children)));
    fprintf(file, ",\"indices\":%llu", (unsigned long long)(4 * (bounds + children + leaves)));
    if (corners > 0) fprintf(file, ",\"corners\":%llu", (unsigned long long)(4 * (bounds + children + leaves + indices)));
    fputs("}}\n", file);

    return bvhscope_private_words(file, tree->bounds, bounds) && bvhscope_private_words(file, tree->children, children) &&
           bvhscope_private_words(file, tree->leaves, leaves) && bvhscope_private_words(file, tree->indices, indices) &&
           bvhscope_private_words(file, tree->corners, corners) && !ferror(file);
}

static inline const char *bvhscope_tree_write(const char *path, const bvhscope_tree *tree) {
    const char *fault = bvhscope_private_fault(tree);
    if (fault) return fault;
    const size_t length = strlen(path);
    char *part = (char *)malloc(length + 6);
    if (!part) return "no memory";
    memcpy(part, path, length);
    memcpy(part + length, ".part", 6);

    FILE *file = fopen(part, "wb");
    if (!file) {
        fault = "the file cannot be created";
    } else {
        const int written = bvhscope_private_all(file, tree);
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

#ifdef __cplusplus
}
#endif

#endif
