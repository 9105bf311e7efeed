"""Arrays of every kind go in, without copies where none are needed, and wrong ones are named."""

import threading
import tracemalloc

import numpy as np
import pytest

import bvhscope

from . import brute

TRIANGLES = brute.soup(300)
ORIGINS, DIRECTIONS = brute.rays(3000)
TREE = bvhscope.build(TRIANGLES)
HITS = TREE.closest_hit(ORIGINS, DIRECTIONS)


def allocated(call):
    """Largest number of bytes of NumPy's and Python's memory during a call; the engine's own is not counted."""
    call()
    tracemalloc.start()
    call()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_arrays_in_c_order_are_not_copied(kind):
    origins, directions = ORIGINS.astype(kind), DIRECTIONS.astype(kind)
    limits, points = np.ones(len(origins), dtype=kind), origins
    corners = np.tile(TRIANGLES, (10, 1, 1)).astype(kind)
    calls = [
        lambda: TREE.closest_hit(origins, directions, t_max=limits),
        lambda: TREE.any_hit(origins, directions),
        lambda: TREE.all_hits(origins, directions),
        lambda: TREE.tests(origins, directions),
        lambda: TREE.visits(origins, directions),
        lambda: TREE.closest_point(points),
        lambda: TREE.contains(points, check=False),
        lambda: bvhscope.build(corners),
    ]
    assert [allocated(call) < 12_000 for call in calls] == [True] * len(calls)
    # What the same measure says of a copy.
    assert allocated(lambda: TREE.any_hit(origins[::2], directions[::2])) > 36_000


@pytest.mark.parametrize(
    "change",
    [
        lambda array: array.astype(np.float64),
        lambda array: np.asfortranarray(array),
        lambda array: np.repeat(array, 2, axis=0)[::2],
        lambda array: array.astype(">f4"),
        lambda array: array[::-1].copy()[::-1],
        lambda array: np.frombuffer(b"x" + array.tobytes(), dtype=np.uint8)[1:].view(np.float32).reshape(array.shape),
        lambda array: array.tolist(),
    ],
    ids=["float64", "fortran", "strided", "big-endian", "reversed", "unaligned", "list"],
)
def test_the_same_numbers_give_the_same_hits(change):
    hits = TREE.closest_hit(change(ORIGINS), change(DIRECTIONS))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(hits, HITS))
    again = bvhscope.build(change(TRIANGLES.reshape(-1, 3)), np.arange(900).reshape(300, 3))
    np.testing.assert_array_equal(again.bounds, TREE.bounds)


@pytest.mark.parametrize("kind", ["int8", "uint16", "int32", "uint32", "int64", "uint64", ">i4"])
def test_faces_may_be_whole_numbers_of_any_type(kind):
    corners = TRIANGLES[:40].reshape(-1, 3)
    tree = bvhscope.build(corners, np.arange(120).reshape(40, 3).astype(kind))
    np.testing.assert_array_equal(tree.bounds, bvhscope.build(TRIANGLES[:40]).bounds)


def test_half_precision_and_whole_numbers_are_taken():
    tree = bvhscope.build(np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0]]], dtype=np.float16))
    assert tree.closest_hit(np.array([1, 1, 3]), np.array([0, 0, -1])).t == 3


def test_results_have_the_shape_of_the_rays():
    origins, directions = ORIGINS.reshape(30, 100, 3), DIRECTIONS.reshape(30, 100, 3)
    hits = TREE.closest_hit(origins, directions)
    assert all(numbers.shape == (30, 100) for numbers in hits)
    np.testing.assert_array_equal(hits.t.ravel(), HITS.t)
    assert TREE.closest_point(origins).point.shape == (30, 100, 3)
    assert TREE.closest_point(origins).feature.shape == TREE.contains(origins, check=False).shape == (30, 100)
    assert TREE.tests(origins, directions).containers.shape == TREE.all_hits(origins, directions).has_more.shape == (30, 100)
    assert TREE.closest_hit(ORIGINS[0], DIRECTIONS[0]).t.shape == ()
    assert TREE.closest_point(ORIGINS[0]).point.shape == (3,)
    assert TREE.closest_hit(ORIGINS[:0], DIRECTIONS[:0]).t.shape == (0,)


def test_one_origin_or_direction_goes_with_many():
    one = TREE.closest_hit(ORIGINS[7], DIRECTIONS)
    many = TREE.closest_hit(np.repeat(ORIGINS[7:8], 3000, axis=0), DIRECTIONS)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, many))
    one = TREE.closest_hit(ORIGINS, DIRECTIONS[7])
    many = TREE.closest_hit(ORIGINS, np.repeat(DIRECTIONS[7:8], 3000, axis=0))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, many))


def test_coordinates_far_from_the_origin_keep_their_decimals():
    place = np.array([408_204.0, 4_080_928.0, 12.0])
    vertices, faces = brute.sphere(3)
    near, far = bvhscope.build(vertices, faces), bvhscope.build(vertices + place, faces)
    assert (near.offset == 0).all() and np.abs(far.offset - place).max() < 2
    origins, directions = brute.rays(500)
    is_hit = near.any_hit(origins, directions)
    np.testing.assert_array_equal(far.any_hit(origins + place, directions), is_hit)
    hits = far.closest_hit(origins + place, directions)
    np.testing.assert_allclose(hits.t[is_hit], near.closest_hit(origins, directions).t[is_hit], atol=1e-5)
    found = far.closest_point(origins + place)
    np.testing.assert_allclose(found.point - place, near.closest_point(origins).point, atol=1e-6)
    far.refit(2 * vertices + place)
    np.testing.assert_allclose(far.signed_distance(place[None]), near.signed_distance([[0, 0, 0]]) * 2, atol=1e-5)
    # float32 vertices have lost their decimals already.
    assert (bvhscope.build((vertices + place).astype(np.float32), faces).offset == 0).all()


VERTICES = TRIANGLES.reshape(-1, 3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bvhscope.build(VERTICES), r"vertices: shape \(900, 3\): give triangles as \(m, 3, 3\), or faces beside \(n, 3\)"),
        (lambda: bvhscope.build(TRIANGLES, [[0, 1, 2]]), r"vertices: shape \(300, 3, 3\): give \(n, 3\) with faces"),
        (lambda: bvhscope.build(VERTICES, [[0, 1, 2, 3]]), r"faces: shape \(1, 4\): give three vertices each, as \(m, 3\)"),
        (lambda: bvhscope.build(VERTICES, [[0, 1, 2], [3, 900, 1]]), "faces: row 1 names vertex 900: there are 900 vertices"),
        (lambda: bvhscope.build(VERTICES, [[0, 1, 2], [3, 2, -1]]), "faces: row 1 names vertex -1: there are 900 vertices"),
        (lambda: bvhscope.build(VERTICES, [[0, 1, 2**40]]), "faces: row 0 names vertex 1099511627776: there are 900"),
        (lambda: bvhscope.build(VERTICES, [[0.0, 1.0, 2.0]]), "faces: an array of float64: give whole numbers"),
        (
            lambda: bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, np.nan, 0]]]),
            r"vertices: vertex 2 of triangle 0 is \(0, NaN, 0\): give",
        ),
        (lambda: bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1e30, 0]]]), "vertices: vertex 2 of triangle 0 is .*finite"),
        (lambda: bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1j, 0]]]), "vertices: an array of complex128: give real numbers"),
        (lambda: bvhscope.build([[1, 2], [3]]), "vertices: cannot become an array: "),
        (lambda: bvhscope.build("mesh.obj"), "vertices: an array of <U8: give real numbers"),
        (lambda: bvhscope.build(TRIANGLES, preset="better"), "preset: 'better' is none of 'swift', 'fast',"),
        (lambda: bvhscope.build(TRIANGLES, container="cube"), "container: 'cube' is none of 'box', 'sphere', 'dop', 'oriented'"),
        (lambda: bvhscope.build(TRIANGLES, passes=["trim"]), "passes: 'trim' is none of 'split',"),
        (lambda: bvhscope.build(TRIANGLES, epsilon=0.6), "epsilon: 0.6: give 0.0 to 0.5"),
        (lambda: bvhscope.build(TRIANGLES, rounds=0), "rounds: 0: give 1 to 4096"),
        (lambda: bvhscope.build(TRIANGLES, threads=-1), "threads: -1: give 0 for all cores"),
        (lambda: bvhscope.build(TRIANGLES, builder="binned-sah", container="sphere"), "makes no spheres: choose boxes"),
        (lambda: TREE.any_hit([[0, 0]], [[0, 0, 1]]), r"origins: shape \(1, 2\): give x, y, z along the last axis"),
        (lambda: TREE.any_hit(ORIGINS, 1.0), r"directions: shape \(\): give x, y, z along the last axis"),
        (
            lambda: TREE.any_hit(ORIGINS, DIRECTIONS[:5]),
            r"directions: shape \(5, 3\) with origins of shape \(3000, 3\): give as many",
        ),
        (
            lambda: TREE.any_hit(ORIGINS, DIRECTIONS, t_max=[1, 2]),
            r"t_max: shape \(2,\): give one number, or an array of .*\(3000,\)",
        ),
        (lambda: TREE.all_hits(ORIGINS, DIRECTIONS, max_hits=0), "max_hits: 0: give at least 1, or None for all"),
        (lambda: TREE.tests(ORIGINS, DIRECTIONS, query="first"), "query: 'first' is none of 'closest', 'any'"),
        (lambda: TREE.visits(ORIGINS, DIRECTIONS, traversal="x"), "traversal: 'x' is none of 'ordered', 'paper'"),
        (lambda: TREE.closest_point(ORIGINS, max_distance=-1), "max_distance: -1: give 0 or more"),
        (lambda: TREE.contains(ORIGINS), "the mesh has 900 open edges, so that nothing is inside: close it, or take check=False"),
        (lambda: TREE.refit(VERTICES), r"faces: the tree was made without: give them, or triangles of shape \(m, 3, 3\)"),
        (lambda: TREE.refit(TRIANGLES[1:]), "vertices: 299 triangles: give all 300 of the tree, in their order"),
    ],
)
def test_a_wrong_argument_is_named_with_what_to_do(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_memory_of_an_array_stays_while_a_call_reads_it():
    for view in (lambda array: array, lambda array: array[1:]):
        # Not a view of what was tiled, which NumPy does not resize anyway.
        origins = np.tile(ORIGINS, (100, 1)).copy()
        call = threading.Thread(target=TREE.all_hits, args=(view(origins), [1, 1, 1]))
        call.start()
        refused = None
        while call.is_alive() and refused is None:
            try:
                origins.resize((len(origins) - 1, 3), refcheck=False)
                # The call may not have begun.
            except ValueError as error:
                refused = str(error)
        call.join()
        assert "cannot resize" in refused


def test_arrays_that_change_during_a_call_do_no_harm():
    vertices, faces = brute.sphere(5)
    expected = bvhscope.build(vertices, faces)
    wild, stop = faces.copy(), threading.Event()

    def change():
        random = np.random.default_rng(5)
        while not stop.is_set():
            wild[random.integers(0, len(wild), 50)] = random.integers(-(2**31), 2**31 - 1, (50, 3), dtype=np.int32)
            wild[:] = faces

    writer = threading.Thread(target=change)
    writer.start()
    built = refused = 0
    for _ in range(60):
        try:
            # Without the copy of the faces that the package makes.
            keywords = dict.fromkeys(["builder", "threshold", "epsilon", "curve", "passes", "rounds"])
            core = bvhscope._engine.build(vertices, wild, {"preset": "fast", "container": "box", **keywords}, 0)
            assert core.triangle_count() == len(faces)
            built += 1
        except ValueError as error:
            assert "names vertex" in str(error)
            refused += 1
    stop.set()
    writer.join()
    assert built + refused == 60
    np.testing.assert_array_equal(bvhscope.build(vertices, wild).bounds, expected.bounds)
