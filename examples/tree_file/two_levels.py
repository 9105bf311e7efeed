"""A scene of copies with trees in two levels: the mesh of a file a hundred times on a grid, each copy turned and of another size, with a
tree of the mesh and one over the copies by `median_split.py`. The file holds triangles, copies and trees, and is opened as it is.

    bvhscope info --triangles mesh.f32 mesh.obj
    PYTHONPATH=assets python3 examples/tree_file/two_levels.py mesh.f32 mine.bvh
    bvhscope mine.bvh
"""

import math
import struct
import sys

import bvhscope_tree
import median_split

SIDE = 10


def single(number):
    """`number` rounded to single precision, in which bvhscope places corners."""
    return struct.unpack("f", struct.pack("f", number))[0]


def matrix_of(x, z, spacing):
    """The rows of a copy's matrix: turned around y, and larger the farther it is."""
    turn, scale = 0.7 * x + 1.9 * z, 0.6 + 0.04 * (x + z)
    cos, sin = scale * math.cos(turn), scale * math.sin(turn)
    rows = [[cos, 0.0, sin, x * spacing], [0.0, scale, 0.0, 0.0], [-sin, 0.0, cos, z * spacing]]
    return [[single(number) for number in row] for row in rows]


def place(matrix, point):
    """A point of the mesh in the world: each product and each sum, from left to right, is rounded to single precision."""
    placed = []
    for a, b, c, translation in matrix:
        total = single(single(point[0] * a) + single(point[1] * b))
        total = single(total + single(point[2] * c))
        placed.append(single(total + translation))
    return placed


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: two_levels.py TRIANGLES OUT, with the file that bvhscope info --triangles writes")
    triangles = [tuple(map(float, triangle)) for triangle in bvhscope_tree.read_triangles(sys.argv[1])]
    points = {triangle[corner:corner + 3] for triangle in triangles for corner in (0, 3, 6)}
    size = max(max(map(abs, point)) for point in points)
    matrices = [matrix_of(x, z, 2.5 * size) for z in range(SIDE) for x in range(SIDE)]

    boxes = []
    for matrix in matrices:
        axes = list(zip(*(place(matrix, point) for point in points)))
        low, high = tuple(map(min, axes)), tuple(map(max, axes))
        # A triangle across the box of a copy, for the builder.
        boxes.append(low + high + low)

    names = ("bounds", "children", "leaves", "indices")
    mesh = dict(zip(names, median_split.build(triangles)), corners=triangles)
    top = dict(zip(names, median_split.build(boxes)))
    bvhscope_tree.write_two_levels(sys.argv[2], [mesh], top, [0] * len(matrices), matrices, builder="median split")


if __name__ == "__main__":
    main()
