"""Queries by a test of every triangle, in double precision, and meshes to test with."""

import numpy as np


def soup(count, seed=1, size=0.2):
    """(count, 3, 3) float32: random triangles in the unit cube."""
    random = np.random.default_rng(seed)
    return (random.random((count, 1, 3)) + size * random.standard_normal((count, 3, 3))).astype(np.float32)


def rays(count, seed=2):
    """Two (count, 3) float32: origins around the unit cube, and directions to points in it."""
    random = np.random.default_rng(seed)
    origins = random.uniform(-1.0, 2.0, (count, 3)).astype(np.float32)
    return origins, (random.random((count, 3)) - origins).astype(np.float32)


def sphere(subdivisions):
    """Vertices and faces of a closed sphere: an octahedron whose faces are divided into four, again and again."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, place = np.unique(edges, axis=0, return_inverse=True)
        middle = vertices[unique].mean(axis=1)
        a, b, c = faces.T
        ab, bc, ca = (len(vertices) + place.reshape(-1, 3)).T
        vertices = np.vstack([vertices, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        faces = np.stack([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]).transpose(0, 2, 1).reshape(-1, 3)
    return vertices.astype(np.float32), faces.astype(np.int32)


def distances(triangles, origins, directions):
    """(rays, triangles): distance of every triangle on every ray, infinite where it is missed (Möller and Trumbore)."""
    a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
    origins, directions = origins.astype(np.float64)[:, None], directions.astype(np.float64)[:, None]
    ab, ac = b - a, c - a
    p = np.cross(directions, ac)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / (ab * p).sum(-1)
        s = origins - a
        q = np.cross(s, ab)
        u, v, t = (s * p).sum(-1) * inverse, (directions * q).sum(-1) * inverse, (ac * q).sum(-1) * inverse
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
    return np.where(hit, t, np.inf)


def nearest(triangles, points):
    """(points, triangles): distance of every triangle to every point: to its plane above the inside, otherwise to its edges."""
    a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
    points = points.astype(np.float64)[:, None]

    def to_segment(start, end):
        along = end - start
        at = np.clip(((points - start) * along).sum(-1) / (along * along).sum(-1), 0, 1)
        return np.linalg.norm(points - start - at[..., None] * along, axis=-1)

    edges = np.minimum(np.minimum(to_segment(a, b), to_segment(b, c)), to_segment(c, a))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = ((points - a) * normal).sum(-1)
    foot = points - height[..., None] * normal
    sides = [(np.cross(end - start, foot - start) * normal).sum(-1) for start, end in ((a, b), (b, c), (c, a))]
    return np.where(np.min(sides, axis=0) >= 0, np.abs(height), edges)
