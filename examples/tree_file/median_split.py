"""A small builder that writes its tree as a file for bvhscope: halves the triangles at the median of their centers along the
longest axis, until at most four are left.

    bvhscope info --triangles mesh.f32 mesh.obj
    PYTHONPATH=assets python3 examples/tree_file/median_split.py mesh.f32 mine.bvh
    bvhscope mesh.obj --tree mine.bvh
"""

import sys
import time

import bvhscope_tree

LEAF_SIZE = 4


def box_around(triangles):
    """Min x, y, z, max x, y, z."""
    low = [min(min(t[axis::3]) for t in triangles) for axis in range(3)]
    high = [max(max(t[axis::3]) for t in triangles) for axis in range(3)]
    return low + high


def build(triangles):
    """The arrays of the tree: bounds, children, leaves, indices."""
    bounds, children, leaves, indices = [], [], [], []

    def make_node(members):
        node = len(bounds)
        box = box_around([triangles[i] for i in members])
        bounds.append(box)
        children.append((bvhscope_tree.EMPTY, bvhscope_tree.EMPTY))
        leaves.append((0, 0))
        if len(members) <= LEAF_SIZE:
            leaves[node] = (len(indices), len(members))
            indices.extend(members)
            return node
        axis = max(range(3), key=lambda axis: box[axis + 3] - box[axis])
        members = sorted(members, key=lambda i: sum(triangles[i][axis::3]))
        half = len(members) // 2
        children[node] = (make_node(members[:half]), make_node(members[half:]))
        return node

    if triangles:
        make_node(range(len(triangles)))
    return bounds, children, leaves, indices


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: median_split.py TRIANGLES OUT, with the file that bvhscope info --triangles writes")
    # As plain tuples, which Python's own loops are fastest on.
    triangles = [tuple(map(float, triangle)) for triangle in bvhscope_tree.read_triangles(sys.argv[1])]
    start = time.perf_counter()
    arrays = build(triangles)
    build_ms = 1e3 * (time.perf_counter() - start)
    bvhscope_tree.write(sys.argv[2], *arrays, triangles=len(triangles), builder="median split", build_ms=build_ms)


if __name__ == "__main__":
    main()
