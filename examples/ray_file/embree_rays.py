"""Writes the rays of a picture as a ray file (docs/ray-file.md), with what Embree hits along them.

    pip install embreex trimesh
    python3 embree_rays.py MODEL.obj OUT.rays [SIDE]

Of a mesh with one material: triangles then have the order in which bvhscope counts them.
"""

import json
import sys

import numpy
import trimesh

MISS = 0xFFFFFFFF


def main(model, out, side=256):
    mesh = trimesh.load(model, force="mesh", process=False)
    low, high = mesh.bounds
    # From in front, so far away that all of the model is in view.
    size = numpy.linalg.norm(high - low)
    eye = (low + high) / 2 + [0, 0, 1.5 * size]
    y, x = numpy.mgrid[0:side, 0:side]
    across = (numpy.stack([x, -y], axis=-1).reshape(-1, 2) - numpy.array([side, -side]) / 2) / side
    origins = numpy.broadcast_to(eye, (side * side, 3))
    directions = numpy.column_stack([across * 0.9, numpy.full(side * side, -1.0)])

    # As the file has them, so that both programs trace the same rays.
    rays = numpy.zeros((side * side, 8), "<f4")
    rays[:, 0:3], rays[:, 4:7], rays[:, 7] = origins, directions, numpy.inf
    triangles = mesh.ray.intersects_first(rays[:, 0:3].astype(float), rays[:, 4:7].astype(float))
    expected = numpy.where(triangles < 0, MISS, triangles).astype("<u4")

    n = len(rays)
    arrays = {"rays": 0, "expected_triangle": 32 * n, "pixel": 36 * n}
    header = {"rays": n, "name": "Embree", "mesh": model, "kind": "primary", "source": "embreex", "arrays": arrays}
    with open(out, "wb") as file:
        file.write(b"bvhscope rays 1\n" + json.dumps(header).encode() + b"\n")
        file.write(rays.tobytes())
        file.write(expected.tobytes())
        file.write(numpy.column_stack([x.ravel(), y.ravel()]).astype("<u4").tobytes())


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:4]))
