"""Meshes and data for trimesh's own ray tests, whose module `generic` reads them from files that its packages are without."""

import logging
import time
from types import SimpleNamespace

import numpy as np
import trimesh

__all__ = ["data", "get_mesh", "log", "np", "random", "time", "trimesh"]

log = logging.getLogger("trimesh")


def random(*shape):
    """Random numbers that are the same each time."""
    return np.random.RandomState(seed=1).random_sample(*shape)


def _cube_less_an_octant():
    vertices = [[20, 20, -20], [20, -20, -20], [-20, -20, -20], [-20, 20, -20], [0, 20, 0], [20, 20, 0], [-20, 20, 20], [0, 20, 20]]
    vertices += [[20, 0, 0], [20, 0, 20], [20, -20, 20], [-20, -20, 20], [0, 0, 20], [0, 0, 0]]
    faces = [[0, 1, 2], [2, 3, 0], [4, 5, 0], [3, 6, 7], [4, 0, 3], [3, 7, 4], [1, 0, 5], [8, 9, 10], [1, 5, 8], [8, 10, 1]]
    faces += [[1, 10, 11], [11, 2, 1], [2, 11, 6], [6, 3, 2], [12, 7, 6], [6, 11, 10], [10, 9, 12], [6, 10, 12], [4, 7, 12]]
    faces += [[12, 13, 4], [13, 8, 5], [5, 4, 13], [12, 9, 8], [8, 13, 12]]
    return trimesh.Trimesh(vertices, faces)


def _open_pot():
    mesh = trimesh.creation.icosphere(radius=20)
    mesh.update_faces(mesh.triangles_center[:, 2] < 10)
    return mesh


_MODELS = {
    "unit_cube.STL": trimesh.creation.box,
    "unit_sphere.STL": trimesh.creation.icosphere,
    "7_8ths_cube.stl": _cube_less_an_octant,
    "teapot.stl": _open_pot,
    "cylinder.stl": lambda: trimesh.creation.cylinder(radius=1, height=3),
    "angle_block.STL": lambda: trimesh.creation.box([3, 2, 1]).subdivide(),
}


def get_mesh(file_name, use_embree=True):
    """The mesh for the name of a model: a shape with the properties that the tests need."""
    mesh = _MODELS[file_name]()
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, use_embree=use_embree)
    mesh._source = SimpleNamespace(file_name=file_name)
    return mesh


def _ray_data():
    state = np.random.RandomState(seed=2)
    rays = {"ray_origins": state.uniform(-4, 4, (1200, 3)), "ray_directions": state.standard_normal((1200, 3))}
    names = ["cylinder.stl", "angle_block.STL"]
    loads = [{"file_name": name, "use_embree": way} for name in names for way in (True, False)]
    return {"load_kwargs": loads, "rays": dict.fromkeys(names, rays)}


data = {"ray_data": _ray_data()}
