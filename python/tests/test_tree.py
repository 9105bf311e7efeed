"""The tree as arrays, its cost and counts, refitting, files and pickles."""

import copy
import os
import pickle

import numpy as np
import pytest

import bvhscope

from . import brute

TRIANGLES = brute.soup(300)
RAYS = brute.rays(200)


def parents(tree):
    """Number of the parent of each node; -1 for the root."""
    found = np.full(len(tree.children), -1)
    for node, children in enumerate(tree.children):
        found[children[children >= 0]] = node
    return found


def is_same(tree, other):
    names = ("bounds", "children", "leaves", "order")
    return all(np.array_equal(getattr(tree, name), getattr(other, name)) for name in names)


@pytest.fixture(params=["fast", "best", "finest"])
def tree(request):
    return bvhscope.build(TRIANGLES, preset=request.param, rounds=2)


def test_the_arrays_are_a_tree_whose_boxes_enclose_its_triangles(tree):
    nodes = len(tree.bounds)
    assert tree.bounds.dtype == np.float32 and tree.bounds.shape == (nodes, 6)
    assert tree.children.shape == (nodes, 2) and tree.leaves.shape == (nodes, 2)
    is_leaf = tree.leaves[:, 1] > 0
    assert (tree.children[is_leaf] == -1).all() and (tree.children[~is_leaf] > 0).all()
    above = parents(tree)
    assert (above[1:] >= 0).all() and (above[1:] < np.arange(1, nodes)).all()
    low, high = tree.bounds[:, :3], tree.bounds[:, 3:]
    assert (low[above[1:]] <= low[1:]).all() and (high[above[1:]] >= high[1:]).all()
    assert set(tree.order) == set(range(300))
    splits = "split" in tree.stats()["settings"]["optimize"]
    assert splits or len(tree.order) == 300
    for node in np.flatnonzero(is_leaf):
        first, count = tree.leaves[node]
        corners = TRIANGLES[tree.order[first : first + count]]
        if not splits:
            assert (corners >= low[node]).all() and (corners <= high[node]).all()


def test_cost_and_statistics_are_those_of_the_arrays(tree):
    size = tree.bounds[:, 3:].astype(float) - tree.bounds[:, :3]
    area = (size * size[:, [1, 2, 0]]).sum(axis=1)
    tests = np.where(tree.leaves[:, 1] > 0, tree.leaves[:, 1], 1)
    assert tree.sah_cost == pytest.approx((area * tests).sum() / area[0], rel=1e-5)
    stats = tree.stats()
    assert stats["nodes"] == len(tree.bounds) and stats["leaves"] == (tree.leaves[:, 1] > 0).sum()
    assert stats["max_leaf_size"] == tree.leaves[:, 1].max() and stats["triangles"] == tree.triangle_count == 300
    assert stats["container"] == tree.container == "box" and stats["builder"] == "aac"
    assert stats["settings"]["threshold"] == 6 and stats["settings"]["epsilon"] == 0.2
    assert f"{stats['nodes']} nodes" in repr(tree) and stats["build_ms"] > 0
    assert stats["tree_bytes"] == 32 * stats["nodes"] + 4 * len(tree.order)
    assert 0 < tree.epo < tree.sah_cost * 2


def test_settings_are_those_that_were_given():
    tree = bvhscope.build(
        TRIANGLES, builder="lbvh", threshold=9, epsilon=0.3, curve="hilbert", passes=["reinsert", "collapse"], rounds=7
    )
    expected = {"curve": "hilbert", "epsilon": 0.3, "optimize": ["collapse", "reinsert"], "rounds": 7, "threshold": 9}
    assert (tree.stats()["builder"], tree.stats()["settings"]) == ("lbvh", expected)
    widths = {"box": 6, "sphere": 4, "dop": 14, "oriented": 21}
    for container, width in widths.items():
        built = bvhscope.build(TRIANGLES, container=container)
        assert built.container == container and built.bounds.shape[1] == width


def test_the_arrays_are_kept_and_cannot_be_written(tree):
    for name in ("bounds", "children", "leaves", "order"):
        assert getattr(tree, name) is getattr(tree, name)
        with pytest.raises(ValueError, match="read-only"):
            getattr(tree, name)[0] = 0


def entered(tree, origins, directions):
    """(rays, nodes): whether each ray meets the box of each node, in double precision."""
    with np.errstate(divide="ignore"):
        inverse = 1.0 / directions.astype(float)[:, None]
    sides = tree.bounds.astype(float).reshape(1, -1, 2, 3)
    t = (sides - origins.astype(float)[:, None, None]) * inverse[:, :, None]
    return np.maximum(t.min(axis=2).max(axis=-1), 0) <= t.max(axis=2).min(axis=-1)


def test_tests_and_visits_are_those_of_the_boxes_that_a_ray_meets():
    tree = bvhscope.build(TRIANGLES)
    meets = entered(tree, *RAYS)
    # The paper's traversal goes into every box that the ray meets, but for rounding.
    visits = tree.visits(*RAYS, traversal="paper").astype(int)
    assert visits[0] > 100 and np.abs(visits - meets.sum(axis=0)).sum() <= 3
    containers, triangles = tree.tests(*RAYS, traversal="paper")
    assert containers.sum() == len(RAYS[0]) + 2 * visits[tree.leaves[:, 1] == 0].sum()
    assert triangles.sum() == (visits * tree.leaves[:, 1]).sum()
    ordered, shadow = tree.tests(*RAYS), tree.tests(*RAYS, query="any")
    assert (ordered.containers <= containers).all() and ordered.containers.sum() < containers.sum()
    assert (shadow.triangles <= triangles).all() and shadow.triangles.sum() < ordered.triangles.sum()
    assert tree.visits(*RAYS, query="any").sum() < tree.visits(*RAYS).sum() < meets.sum()


@pytest.mark.parametrize("container", ["box", "sphere", "dop", "oriented"])
def test_a_refitted_tree_finds_the_moved_triangles(container):
    vertices, faces = brute.sphere(3)
    tree = bvhscope.build(vertices, faces, container=container)
    before, children = tree.bounds, tree.children
    for scale in (2.0, 0.5):
        moved = vertices * np.float32(scale) * [1, 1, 3] + 5
        tree.refit(moved)
        fresh = bvhscope.build(moved, faces, container=container)
        rays = brute.rays(500)[0] * 4 + 3, brute.rays(500, seed=9)[1]
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(tree.closest_hit(*rays), fresh.closest_hit(*rays)))
        assert all(np.array_equal(a, b) for a, b in zip(tree.all_hits(*rays), fresh.all_hits(*rays)))
        assert not np.array_equal(tree.bounds, before)
        np.testing.assert_array_equal(tree.children, children)
    tree.refit(moved[faces])
    tree.refit(moved, faces)
    bounds = tree.bounds
    with pytest.raises(ValueError, match="faces: row 0 names vertex"):
        tree.refit(moved[:5])
    with pytest.raises(ValueError, match="vertices: vertex 0 of triangle"):
        tree.refit(np.where(np.arange(len(moved))[:, None] == 0, np.nan, moved))
    assert tree.bounds is bounds


@pytest.mark.parametrize("container", ["box", "sphere", "dop", "oriented"])
def test_files_and_pickles_bring_the_same_tree_back(container, tmp_path):
    vertices, faces = brute.sphere(2)
    tree = bvhscope.build(vertices + np.array([4e6 / 3, 0, 1e-3]), faces, container=container, preset="best")
    path = tmp_path / "tree.bvh"
    tree.save(path)
    for again in (bvhscope.load(path), pickle.loads(pickle.dumps(tree)), copy.deepcopy(tree)):
        assert is_same(again, tree) and again.stats() == tree.stats() | {"build_ms": pytest.approx(tree.stats()["build_ms"])}
        np.testing.assert_array_equal(again.offset, tree.offset)
        points = vertices[:50] * 2 + [4e6 / 3, 0, 1e-3]
        assert all(np.array_equal(a, b) for a, b in zip(again.closest_point(points), tree.closest_point(points)))
    pickle.loads(pickle.dumps(tree)).refit(vertices)
    size = os.path.getsize(path)
    tree.save(path, triangles=False)
    assert os.path.getsize(path) < size and os.listdir(tmp_path) == ["tree.bvh"]
    with pytest.raises(ValueError, match="vertices: the tree file is without its triangles: give vertices and faces"):
        bvhscope.load(path)
    assert is_same(bvhscope.load(path, vertices + np.array([4e6 / 3, 0, 1e-3]), faces), tree)


def test_a_file_of_another_program_is_read_with_a_warning_for_each_fault(tmp_path):
    layers = np.array([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in range(3)], dtype="<f4")
    header = (
        '{"container": "box", "arity": 3, "nodes": 4, "indices": 3, "triangles": 3, "builder": "mine", '
        '"arrays": {"bounds": 0, "children": 96, "leaves": 144, "indices": 176, "corners": 188}}'
    )
    bounds = np.array([[0, 0, 0, 1, 1, 1.5]] + [[0, 0, z, 1, 1, z] for z in range(3)], dtype="<f4")
    none = 2**32 - 1
    children = np.array([[1, 2, 3], *[[none] * 3] * 3], dtype="<u4")
    leaves = np.array([[0, 0], [0, 1], [1, 1], [2, 1]], dtype="<u4")
    arrays = [bounds, children, leaves, np.arange(3, dtype="<u4"), layers]
    path = tmp_path / "mine.bvh"
    path.write_bytes(b"bvhscope tree 1\n" + header.encode() + b"\n" + b"".join(array.tobytes() for array in arrays))
    with pytest.warns(UserWarning, match=r"mine.bvh: 1 node sticks out of its parent by up to 0.5, first node 3"):
        tree = bvhscope.load(path)
    assert "mine" in repr(tree) and tree.stats()["build_ms"] is None
    np.testing.assert_array_equal(tree.children, [[1, 2, 3], [-1, -1, -1], [-1, -1, -1], [-1, -1, -1]])
    assert tree.closest_hit([0.2, 0.2, -5], [0, 0, 1]).triangle == 0
    tree.refit(layers)
    assert tree.bounds[0, 5] == 2 and tree.closest_hit([0.2, 0.2, 5], [0, 0, -1]).triangle == 2


def test_a_file_that_is_none_is_refused_and_a_failed_save_leaves_the_old_one(tmp_path):
    path = tmp_path / "tree.bvh"
    path.write_text("solid cube")
    with pytest.raises(ValueError, match="the tree file does not begin with the line 'bvhscope tree 1': write"):
        bvhscope.load(path)
    with pytest.raises(ValueError, match="vertices: missing: give them with faces"):
        bvhscope.load(path, faces=[[0, 1, 2]])
    with pytest.raises(FileNotFoundError):
        bvhscope.load(tmp_path / "none.bvh")
    tree = bvhscope.build(TRIANGLES)
    with pytest.raises(FileNotFoundError):
        tree.save(tmp_path / "none" / "tree.bvh")
    folder = tmp_path / "folder"
    (folder / "inside").mkdir(parents=True)
    with pytest.raises(OSError, match="folder"):
        tree.save(folder)
    assert sorted(os.listdir(tmp_path)) == ["folder", "tree.bvh"] and path.read_text() == "solid cube"
