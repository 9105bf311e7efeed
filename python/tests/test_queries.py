"""Every query finds what a test of every triangle finds."""

import numpy as np
import pytest

import bvhscope

from . import brute

CONTAINERS = ["box", "sphere", "dop", "oriented"]
TRIANGLES = brute.soup(300)
RAYS = brute.rays(400)


@pytest.fixture(params=CONTAINERS)
def tree(request):
    return bvhscope.build(TRIANGLES, container=request.param, preset="best")


def test_the_nearest_hit_is_that_of_all_triangles(tree):
    hits, expected = tree.closest_hit(*RAYS), brute.distances(TRIANGLES, *RAYS)
    is_hit = np.isfinite(expected.min(axis=1))
    assert 100 < is_hit.sum() < 400
    np.testing.assert_array_equal(hits.triangle >= 0, is_hit)
    np.testing.assert_allclose(hits.t[is_hit], expected.min(axis=1)[is_hit], rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(hits.triangle[is_hit], expected.argmin(axis=1)[is_hit])
    assert np.isinf(hits.t[~is_hit]).all() and np.isnan(hits.u[~is_hit]).all() and np.isnan(hits.v[~is_hit]).all()
    a, b, c = np.moveaxis(TRIANGLES[hits.triangle[is_hit]], 1, 0)
    u, v = hits.u[is_hit, None], hits.v[is_hit, None]
    on_ray = RAYS[0][is_hit] + hits.t[is_hit, None] * RAYS[1][is_hit]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, on_ray, atol=1e-4)
    np.testing.assert_array_equal(tree.any_hit(*RAYS), is_hit)


def test_all_hits_are_those_of_all_triangles_by_distance(tree):
    hits, expected = tree.all_hits(*RAYS), brute.distances(TRIANGLES, *RAYS)
    counts = np.isfinite(expected).sum(axis=1)
    assert counts.max() > 5
    np.testing.assert_array_equal(np.diff(hits.starts), counts)
    np.testing.assert_array_equal(hits.ray, np.repeat(np.arange(len(counts)), counts))
    assert not hits.has_more.any()
    for ray, (first, end) in enumerate(zip(hits.starts[:-1], hits.starts[1:])):
        order = np.argsort(expected[ray], kind="stable")[: counts[ray]]
        np.testing.assert_array_equal(hits.triangle[first:end], order)
    np.testing.assert_allclose(hits.t, expected[hits.ray, hits.triangle], rtol=1e-4, atol=1e-5)
    first_two = tree.all_hits(*RAYS, max_hits=2)
    np.testing.assert_array_equal(np.diff(first_two.starts), np.minimum(counts, 2))
    np.testing.assert_array_equal(first_two.has_more, counts > 2)


def test_limits_hold_for_all_rays_or_for_each(tree):
    t = tree.closest_hit(*RAYS).t
    is_hit = np.isfinite(t)
    below = np.nextafter(t, np.float32(0))
    assert not tree.any_hit(*RAYS, t_max=np.where(is_hit, below, 1)).any()
    assert tree.any_hit(*RAYS, t_max=np.where(is_hit, t, 1))[is_hit].all()
    beyond = tree.closest_hit(*RAYS, t_min=np.where(is_hit, np.nextafter(t, np.float32(9e9)), 0))
    assert (beyond.t[is_hit] > t[is_hit]).all()
    np.testing.assert_array_equal(tree.any_hit(*RAYS, t_max=0.5), t <= 0.5)


def test_the_nearest_point_is_that_of_all_triangles(tree):
    points = np.random.default_rng(3).uniform(-1, 2, (400, 3)).astype(np.float32)
    found, expected = tree.closest_point(points), brute.nearest(TRIANGLES, points)
    np.testing.assert_allclose(found.distance, expected.min(axis=1), rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.point - points, axis=1), found.distance, rtol=1e-12)
    np.testing.assert_allclose(expected[np.arange(400), found.triangle], found.distance, rtol=1e-12)
    a, b, c = np.moveaxis(TRIANGLES[found.triangle].astype(float), 1, 0)
    u, v = found.u[:, None], found.v[:, None]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, found.point, atol=1e-12)
    weights = np.stack([1 - found.u - found.v, found.u, found.v]).round(12)
    np.testing.assert_array_equal((weights == 0).sum(axis=0), np.array([0, 1, 1, 1, 2, 2, 2])[found.feature])
    radius = np.float32(np.median(found.distance))
    near = tree.closest_point(points, max_distance=radius)
    np.testing.assert_array_equal(near.triangle, np.where(found.distance <= radius, found.triangle, -1))
    assert np.isinf(near.distance[near.triangle < 0]).all() and np.isnan(near.point[near.triangle < 0]).all()


@pytest.mark.parametrize("container", CONTAINERS)
def test_a_sphere_is_inside_where_it_is_nearer_to_the_center(container):
    vertices, faces = brute.sphere(4)
    tree = bvhscope.build(vertices, faces, container=container)
    assert tree.open_edges == 0
    points = np.random.default_rng(4).uniform(-1.2, 1.2, (2000, 3))
    radius = np.linalg.norm(points, axis=1)
    points, radius = points[np.abs(radius - 1) > 0.01], radius[np.abs(radius - 1) > 0.01]
    np.testing.assert_array_equal(tree.contains(points), radius < 1)
    np.testing.assert_allclose(tree.signed_distance(points), radius - 1, atol=0.01)


@pytest.mark.parametrize("container", CONTAINERS)
def test_no_ray_passes_through_an_edge_or_a_vertex_of_a_closed_sphere(container):
    vertices, faces = brute.sphere(5)
    tree = bvhscope.build(vertices, faces, container=container)
    edges = vertices[faces[:, [0, 1, 2]]] + vertices[faces[:, [1, 2, 0]]]
    directions = np.concatenate([vertices, edges.reshape(-1, 3)])
    assert tree.any_hit([0, 0, 0], directions).all()
    assert (tree.closest_hit([0, 0, 0], directions).triangle >= 0).all()
    assert tree.any_hit(-3 * directions, directions).all()


def test_a_mesh_without_triangles_is_missed():
    tree = bvhscope.build(np.zeros((0, 3, 3), dtype=np.float32))
    assert tree.closest_hit([0, 0, 0], [0, 0, 1]).triangle == -1
    assert tree.closest_point([0, 0, 0]).triangle == -1
    assert tree.signed_distance([0, 0, 0]) == np.inf and not tree.contains([0, 0, 0])
    assert tree.bounds.shape == (0, 6) and tree.children.shape == (0, 2) and tree.order.shape == (0,)
    assert "0 triangles" in repr(tree) and tree.epo == 0 and tree.sah_cost == 0
    assert bvhscope.build(np.zeros((4, 3)), []).triangle_count == 0


def test_rays_and_points_that_are_none_hit_nothing():
    tree = bvhscope.build(TRIANGLES)
    none = [[np.nan, 0, 0], [np.inf, 0, 0]]
    assert (tree.closest_hit(none, [1, 1, 1]).triangle == -1).all()
    assert (tree.closest_hit([0, 0, 0], none + [[0, 0, 0]]).triangle == -1).all()
    assert (tree.closest_point(none).triangle == -1).all()
    assert np.isnan(tree.signed_distance(none, check=False)).all()


def test_results_are_the_same_on_any_number_of_threads(tree):
    origins, directions = brute.rays(5000)
    few = [tree.all_hits(origins, directions, threads=threads) for threads in (1, 3)]
    assert all(np.array_equal(a, b) for a, b in zip(*few))
    one_by_one = [tree.closest_hit(o, d).triangle for o, d in zip(origins[:200], directions[:200])]
    np.testing.assert_array_equal(tree.closest_hit(origins, directions).triangle[:200], one_by_one)
