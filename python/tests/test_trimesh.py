"""The drop-in for trimesh: by trimesh's own ray tests, and against the engine's answers."""

import copy
import os
import pickle
import sys
import tarfile
import types

import numpy as np
import pytest

from . import brute

trimesh = pytest.importorskip("trimesh")

from bvhscope.trimesh import RayMeshIntersector

# A source package of the version that is installed, which has the tests.
SOURCE = os.environ.get("BVHSCOPE_TRIMESH_SOURCE")


def own_tests():
    """The text of trimesh's test_ray.py and the names of its tests."""
    if SOURCE is None:
        return "", []
    with tarfile.open(SOURCE) as files:
        text = files.extractfile(f"trimesh-{trimesh.__version__}/tests/test_ray.py").read().decode()
    return text, [line[4 : line.index("(")] for line in text.splitlines() if line.startswith("def test_")]


TEXT, NAMES = own_tests()


@pytest.fixture
def drop_in(monkeypatch):
    """trimesh with both of its intersectors replaced, as where embreex is installed."""
    from . import generic

    made = []

    class Counted(RayMeshIntersector):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            made.append(self)

    module = types.SimpleNamespace(RayMeshIntersector=Counted)
    monkeypatch.setattr(trimesh.ray, "has_embree", True)
    for name in ("ray_pyembree", "ray_triangle"):
        monkeypatch.setattr(trimesh.ray, name, module)
        monkeypatch.setitem(sys.modules, f"trimesh.ray.{name}", module)
    # Asked for its version by a test of intersectors that come with it.
    monkeypatch.setitem(sys.modules, "embreex", types.SimpleNamespace(__version__="4.4.0"))
    monkeypatch.setitem(sys.modules, "generic", generic)
    return made


@pytest.mark.skipif(SOURCE is None, reason="BVHSCOPE_TRIMESH_SOURCE names no source package of trimesh")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_own_tests_of_trimesh_pass(name, drop_in):
    names = {"__name__": "test_ray"}
    exec(compile(TEXT, "test_ray.py", "exec"), names)
    names[name]()
    assert drop_in, "the test ran without the drop-in"


@pytest.mark.skipif(SOURCE is None, reason="BVHSCOPE_TRIMESH_SOURCE names no source package of trimesh")
def test_all_own_tests_were_found():
    assert len(NAMES) >= 11 and "test_multiple_hits" in NAMES


@pytest.fixture
def mesh():
    mesh = trimesh.Trimesh(*brute.sphere(3))
    mesh.ray = RayMeshIntersector(mesh)
    return mesh


def test_hits_are_in_the_order_of_rays_and_distances(mesh):
    origins, directions = (array.astype(float) for array in brute.rays(500))
    locations, index_ray, index_tri = mesh.ray.intersects_location(origins, directions)
    assert len(locations) == len(index_ray) == len(index_tri) > 300
    assert locations.dtype == np.float64 and index_ray.dtype == index_tri.dtype == np.int64
    away = np.linalg.norm(locations - origins[index_ray], axis=1)
    assert (np.diff(index_ray) >= 0).all() and (np.diff(away)[np.diff(index_ray) == 0] > 0).all()
    # On the plane of the triangle and on the ray, in double precision.
    plane = ((locations - mesh.triangles[index_tri, 0]) * mesh.face_normals[index_tri]).sum(axis=1)
    assert np.abs(plane).max() < 1e-12
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(origins[index_ray] + away[:, None] * unit[index_ray], locations, atol=1e-12)
    first_tri, first_ray = mesh.ray.intersects_id(origins, directions, multiple_hits=False)
    first = np.unique(index_ray, return_index=True)[1]
    np.testing.assert_array_equal(first_ray, index_ray[first])
    np.testing.assert_array_equal(first_tri, index_tri[first])
    all_first = mesh.ray.intersects_first(origins, directions)
    np.testing.assert_array_equal(np.flatnonzero(all_first >= 0), first_ray)
    np.testing.assert_array_equal(mesh.ray.intersects_any(origins, directions), all_first >= 0)
    one_each = mesh.ray.intersects_id(origins, directions, max_hits=1)
    np.testing.assert_array_equal(one_each[0], first_tri)


def test_a_ray_through_an_edge_or_a_vertex_has_one_hit_there(mesh):
    directions = np.concatenate([mesh.vertices, mesh.vertices[mesh.edges_unique].sum(axis=1)])
    origins = np.zeros_like(directions)
    index_ray = mesh.ray.intersects_location(origins, directions)[1]
    np.testing.assert_array_equal(index_ray, np.arange(len(directions)))
    assert (np.bincount(mesh.ray.intersects_location(-3 * directions, directions)[1]) == 2).all()


def test_the_tree_is_made_again_when_the_mesh_has_changed(mesh):
    tree = mesh.ray.tree
    assert mesh.ray.tree is tree
    mesh.apply_translation([10, 0, 0])
    assert mesh.ray.contains_points([[10, 0, 0], [0, 0, 0]]).tolist() == [True, False]
    assert mesh.ray.tree is not tree


def test_copies_and_pickles_work(mesh):
    mesh.ray = RayMeshIntersector(mesh, preset="best", threads=1)
    for again in (copy.copy(mesh.ray), copy.deepcopy(mesh.ray), pickle.loads(pickle.dumps(mesh.ray))):
        assert again.intersects_any([[0, 0, 5]], [[0, 0, -1]]).all()
        assert again.tree.stats()["settings"]["optimize"] == ["collapse", "restructure", "reinsert"]


def test_rays_of_other_shapes_are_refused(mesh):
    with pytest.raises(ValueError, match="ray_directions: shape"):
        mesh.ray.intersects_first([[0, 0, 5]], [[0, 0, -1], [0, 0, 1]])
    for empty in (mesh.ray.intersects_id, mesh.ray.intersects_location):
        assert all(len(array) == 0 for array in empty(np.zeros((0, 3)), np.zeros((0, 3))))
