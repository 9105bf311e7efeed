"""Trees: built, read and queried."""

from __future__ import annotations

import atexit
import base64
import html
import json
import os
import secrets
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine, _picture
from ._program import program


class Hits(NamedTuple):
    """The nearest hit of each ray. All arrays have the shape of the rays."""

    triangle: NDArray[np.int32]
    """Number of the triangle, from 0; -1 where the ray misses."""
    t: NDArray[np.float32]
    """Distance in multiples of the length of the direction; infinite where the ray misses."""
    u: NDArray[np.float32]
    """Weight of the triangle's second corner: the hit is ``(1 - u - v) * a + u * b + v * c``; NaN where the ray misses."""
    v: NDArray[np.float32]
    """Weight of the triangle's third corner; NaN where the ray misses."""


class AllHits(NamedTuple):
    """All hits of n rays, ray by ray, by distance, at equal distances by triangle. Most arrays have one number for each of h hits."""

    ray: NDArray[np.int64]
    """(h,): number of the ray, from 0; with several axes, counted in C order."""
    triangle: NDArray[np.int32]
    """(h,): number of the triangle."""
    t: NDArray[np.float32]
    """(h,): distance in multiples of the length of the direction."""
    u: NDArray[np.float32]
    """(h,): weight of the triangle's second corner."""
    v: NDArray[np.float32]
    """(h,): weight of the triangle's third corner."""
    starts: NDArray[np.int64]
    """(n + 1,): ray i has the hits from ``starts[i]`` to ``starts[i + 1]``, the latter excluded."""
    has_more: NDArray[np.bool_]
    """Shape of the rays: True where a ray has more hits than ``max_hits``, of which these are the nearest."""


class ClosestPoints(NamedTuple):
    """The nearest point of the mesh for each of many points. All arrays but the first have the shape of the points."""

    point: NDArray[np.float64]
    """The point of the mesh, with its coordinates along one more axis; NaN where none is near enough."""
    distance: NDArray[np.float64]
    """Its distance; infinite where none is near enough."""
    triangle: NDArray[np.int32]
    """Number of its triangle, the lowest of those at the same distance; -1 where none is near enough."""
    u: NDArray[np.float64]
    """Weight of the triangle's second corner."""
    v: NDArray[np.float64]
    """Weight of the triangle's third corner."""
    feature: NDArray[np.uint8]
    """Part of the triangle: 0 is the face, 1 to 3 are its edges ab, bc and ca, 4 to 6 its corners a, b and c."""


class Counts(NamedTuple):
    """Number of tests that each ray takes in the tree. Both arrays have the shape of the rays."""

    containers: NDArray[np.int64]
    """Tests of containers."""
    triangles: NDArray[np.int64]
    """Tests of triangles."""


def build(
    vertices: ArrayLike,
    faces: ArrayLike | None = None,
    *,
    preset: str = "fast",
    container: str = "box",
    builder: str | None = None,
    threshold: int | None = None,
    epsilon: float | None = None,
    curve: str | None = None,
    passes: Iterable[str] | None = None,
    rounds: int | None = None,
    threads: int = 0,
) -> Tree:
    """Build a tree over triangles.

    Equal triangles and settings give the identical tree on any number of threads.

    Parameters
    ----------
    vertices : (n, 3) or (m, 3, 3) float
        Vertices of `faces`; without `faces` the three corners of each triangle. Finite, up to 1e18.
    faces : (m, 3) int, optional
        Numbers of the vertices of each triangle, from 0.
    preset : str
        "swift", "fast", "hq", "aac-fast", "aac-hq", "best" or "finest": from the fastest build to the best tree. "best" takes about
        three times as long as "fast", "finest" a thousand times.
    container : str
        "box", "sphere", "dop" (polytopes of 14 planes) or "oriented" (boxes, each turned to fit).
    builder : str, optional
        "aac", "swift", "lbvh", "ploc", "hploc", "binned-sah", "sweep", "sbvh", "exact" or "none", instead of the preset's.
    threshold : int, optional
        Traversal stopping threshold of AAC, 2 to 64: higher ones give better trees and slower builds.
    epsilon : float, optional
        Exponent of AAC's reduction function, 0 to 0.5: lower ones give better trees and slower builds.
    curve : str, optional
        "morton", "hilbert" or "extended": the curve along which triangles are sorted.
    passes : iterable of str, optional
        Any of "split", "collapse", "restructure", "reinsert", "anneal" and "orient", instead of the preset's.
    rounds : int, optional
        Rounds of the pass "anneal", 1 to 4096.
    threads : int
        Number of threads, 0 for all cores.

    Returns
    -------
    Tree

    Raises
    ------
    ValueError
        Where an argument is wrong, or the settings cannot build such triangles; names the argument and what to do.
    KeyboardInterrupt
        After Ctrl-C.

    Examples
    --------
    >>> import numpy as np, bvhscope
    >>> corners = np.random.default_rng(1).random((1000, 3, 3), dtype=np.float32)
    >>> bvhscope.build(corners, preset="best")
    <bvhscope.Tree: 1,000 triangles, box, aac, 583 nodes, SAH cost 572.9>
    >>> bvhscope.build(corners, threshold=1)
    Traceback (most recent call last):
    ValueError: threshold: 1: give 2 to 64
    """
    owned = _own_faces(faces)
    keywords = _keywords(preset, container, builder, threshold, epsilon, curve, passes, rounds)
    return Tree(_engine.build(vertices, owned, keywords, threads), owned)


def _keywords(
    preset: str,
    container: str,
    builder: str | None,
    threshold: int | None,
    epsilon: float | None,
    curve: str | None,
    passes: Iterable[str] | None,
    rounds: int | None,
) -> _engine._Keywords:
    """The settings of a build."""
    return {
        "preset": preset,
        "container": container,
        "builder": builder,
        "threshold": threshold,
        "epsilon": epsilon,
        "curve": curve,
        "passes": None if passes is None else list(passes),
        "rounds": rounds,
    }


def from_file(
    path: str | os.PathLike[str],
    *,
    allow_outside: bool = False,
    preset: str = "fast",
    container: str = "box",
    builder: str | None = None,
    threshold: int | None = None,
    epsilon: float | None = None,
    curve: str | None = None,
    passes: Iterable[str] | None = None,
    rounds: int | None = None,
    threads: int = 0,
) -> Tree:
    """Read a model and build a tree over its triangles.

    Parameters
    ----------
    path : path
        A file of glTF, OBJ, PLY, STL or PBRT, also packed by gzip, or a tree file, whose triangles are taken; or
        "builtin:NAME[:SIZE]", such as "builtin:teapot" and "builtin:terrain:100000".
    allow_outside : bool
        Let a model read files outside of its own folder.
    preset, container, builder, threshold, epsilon, curve, passes, rounds, threads
        As for :func:`build`.

    Returns
    -------
    Tree
        Over the triangles in the order of the file, with polygons divided; a model that moves is taken in its pose at rest.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where the file cannot be used: names the place and what to do.

    Warns
    -----
    UserWarning
        For each kind of fault that was skipped or repaired.

    Examples
    --------
    >>> import bvhscope
    >>> bvhscope.from_file("builtin:cornell")
    <bvhscope.Tree: 36 triangles, box, aac, 71 nodes, SAH cost 14.2>
    """
    keywords = _keywords(preset, container, builder, threshold, epsilon, curve, passes, rounds)
    path = os.fspath(path)
    if not path.startswith("builtin:") and not os.path.exists(path) and "#" not in path:
        # Raises the error of Python for a file that is missing. In the name of a row of files, # stands for a digit.
        os.stat(path)
    core, found = _engine.read_model(path, allow_outside, keywords, threads)
    for warning in found:
        warnings.warn(f"{path}: {warning}", UserWarning, stacklevel=2)
    return Tree(core)


def load(
    path: str | os.PathLike[str],
    vertices: ArrayLike | None = None,
    faces: ArrayLike | None = None,
    *,
    threads: int = 0,
) -> Tree:
    """Read a tree file of any builder, over its own triangles or over those that are given.

    The format is described in ``docs/tree-file.md`` of the repository: two lines of text, then arrays.

    Parameters
    ----------
    path : path
        The file.
    vertices, faces : arrays, optional
        The mesh that the tree was built from, as for :func:`build`; needed where the file is without its triangles.
    threads : int
        Number of threads, 0 for all cores.

    Returns
    -------
    Tree
        With the nodes of the file, of 2 to 32 children.

    Raises
    ------
    OSError
        Where the file cannot be read.
    ValueError
        Where it holds no tree of this mesh: names the place and what to do.

    Warns
    -----
    UserWarning
        For each kind of fault of a tree that can be used all the same, such as nodes outside of their parents, which rays may miss.

    Examples
    --------
    >>> import bvhscope, os, tempfile
    >>> tree = bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tree.save(os.path.join(folder, "one.bvh"))
    ...     bvhscope.load(os.path.join(folder, "one.bvh"))
    <bvhscope.Tree: 1 triangle, box, aac, 1 node, SAH cost 1.0>
    """
    with open(path, "rb") as file:
        content = file.read()
    owned = _own_faces(faces)
    core, faults = _engine.read(content, vertices, owned, threads)
    for fault in faults:
        warnings.warn(f"{os.fspath(path)}: {fault}", UserWarning, stacklevel=2)
    return Tree(core, owned)


class Tree:
    """A bounding volume hierarchy over triangles. Made by :func:`build`, :func:`from_file` and :func:`load`; can be
    pickled.

    Any number of threads may query a tree at once, also while :meth:`refit` runs: each call sees the triangles from before or after.
    """

    __slots__ = ("__weakref__", "_arrays", "_core", "_faces")

    _core: _engine.Core
    _faces: NDArray[np.int32] | None
    _arrays: dict[str, NDArray[Any]]

    def __init__(self, core: _engine.Core, faces: NDArray[np.int32] | None = None) -> None:
        self._core = core
        self._faces = faces
        self._arrays = {}

    # Rays

    def closest_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        threads: int = 0,
    ) -> Hits:
        """Find the nearest hit of each ray: exactly that of a test of every triangle, the lower triangle at equal distances.

        Parameters
        ----------
        origins, directions : (..., 3) float
            Rays; directions of any length. One of either, of shape (3,), goes with any number of the other.
        t_min, t_max : float or (...) float
            Range in which hits count, both ends included, in multiples of the length of the direction.
        threads : int
            Number of threads, 0 for all cores.

        Returns
        -------
        Hits
            ``triangle``, ``t``, ``u`` and ``v``, each of the shape of the rays. Rays with NaN or a zero direction miss.

        Raises
        ------
        ValueError
            Where an array has another shape or type; names it and what to do.

        Examples
        --------
        >>> import numpy as np, bvhscope
        >>> tree = bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
        >>> pixels = np.stack(np.meshgrid([0.25, 2.0], [0.25, 0.5], [3.0]), axis=-1)[:, :, 0]
        >>> tree.closest_hit(pixels, [0, 0, -1]).triangle
        array([[ 0, -1],
               [ 0, -1]], dtype=int32)
        """
        return Hits(*self._core.closest_hit((origins, directions, t_min, t_max, threads)))

    def any_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        threads: int = 0,
    ) -> NDArray[np.bool_]:
        """Find out whether anything lies on each ray: faster than the nearest hit, for shadow rays and lines of sight.

        Parameters are those of :meth:`closest_hit`.

        Returns
        -------
        (...) bool

        Examples
        --------
        >>> import bvhscope
        >>> tree = bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
        >>> eye, lamp = [0.25, 0.25, 1.0], [0.25, 0.25, -1.0]
        >>> bool(tree.any_hit(eye, [b - a for a, b in zip(eye, lamp)], t_max=1.0))
        True
        """
        return self._core.any_hit((origins, directions, t_min, t_max, threads))

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        max_hits: int | None = None,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        threads: int = 0,
    ) -> AllHits:
        """Find all hits of each ray, by distance: each triangle that a test of every triangle finds, once.

        Parameters
        ----------
        max_hits : int, optional
            Most hits of each ray, the nearest ones; ``has_more`` is True where there are more.
        origins, directions, t_min, t_max, threads
            As for :meth:`closest_hit`.

        Returns
        -------
        AllHits
            ``ray``, ``triangle``, ``t``, ``u`` and ``v`` of each hit, and ``starts`` and ``has_more`` of each ray.

        Examples
        --------
        >>> import numpy as np, bvhscope
        >>> layers = np.array([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in range(3)], dtype=np.float32)
        >>> hits = bvhscope.build(layers).all_hits([[0.2, 0.2, 5], [3, 3, 5]], [0, 0, -1], max_hits=2)
        >>> hits.triangle, hits.starts, hits.has_more
        (array([2, 1], dtype=int32), array([0, 2, 2]), array([ True, False]))
        """
        return AllHits(*self._core.all_hits((origins, directions, t_min, t_max, threads), max_hits))

    def tests(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        query: str = "closest",
        traversal: str = "ordered",
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        threads: int = 0,
    ) -> Counts:
        """Count the tests of containers and triangles that each ray takes in the tree: a measure of cost that no machine changes.

        Parameters
        ----------
        query : str
            "closest" for the nearest hit, "any" for whether there is one.
        traversal : str
            "ordered": the nearer child first, without what lies behind the nearest hit so far; "paper": all that the ray meets.
        origins, directions, t_min, t_max, threads
            As for :meth:`closest_hit`.

        Returns
        -------
        Counts
            ``containers`` and ``triangles``, each of the shape of the rays.

        Examples
        --------
        >>> import bvhscope
        >>> tree = bvhscope.build([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in range(2)])
        >>> containers, triangles = tree.tests([0.2, 0.2, 5], [0, 0, -1])
        >>> int(containers), int(triangles)
        (3, 1)
        """
        rays = (origins, directions, t_min, t_max, threads)
        return Counts(*self._core.tests(rays, _stops_at_any(query), traversal))

    def visits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        query: str = "closest",
        traversal: str = "ordered",
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        threads: int = 0,
    ) -> NDArray[np.uint32]:
        """Count how often the rays visit each node of the tree.

        Parameters are those of :meth:`tests`.

        Returns
        -------
        (nodes,) uint32
            In the order of :attr:`bounds`.

        Examples
        --------
        >>> import bvhscope
        >>> tree = bvhscope.build([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in range(2)])
        >>> tree.visits([[0.2, 0.2, 5], [3, 3, 5]], [0, 0, -1])
        array([1, 0, 1], dtype=uint32)
        """
        rays = (origins, directions, t_min, t_max, threads)
        return self._core.visits(rays, _stops_at_any(query), traversal)

    # Points

    def closest_point(self, points: ArrayLike, *, max_distance: float = np.inf, threads: int = 0) -> ClosestPoints:
        """Find the point of the mesh that is nearest to each of `points`.

        Parameters
        ----------
        points : (..., 3) float
            Points; rounded to single precision after :attr:`offset` was subtracted. What follows is in double precision.
        max_distance : float
            Distance up to which points of the mesh count.
        threads : int
            Number of threads, 0 for all cores.

        Returns
        -------
        ClosestPoints
            ``point``, ``distance``, ``triangle``, ``u``, ``v`` and ``feature``.

        Raises
        ------
        ValueError
            Where an argument is wrong; names it and what to do.

        Examples
        --------
        >>> import bvhscope
        >>> tree = bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
        >>> nearest = tree.closest_point([[0.25, 0.5, 2], [-3, 0, 4]])
        >>> nearest.point, nearest.distance, nearest.feature
        (array([[0.25, 0.5 , 0.  ],
               [0.  , 0.  , 0.  ]]), array([2., 5.]), array([0, 4], dtype=uint8))
        """
        return ClosestPoints(*self._core.closest_point(points, max_distance, threads))

    def contains(self, points: ArrayLike, *, check: bool = True, threads: int = 0) -> NDArray[np.bool_]:
        """Find out whether each of `points` lies inside of the mesh.

        Parameters
        ----------
        points : (..., 3) float
            Points. One on the surface, but for rounding, may count as either.
        check : bool
            Refuse a mesh that is not closed, for which the answer means nothing; the first time takes about as long as a build.
        threads : int
            Number of threads, 0 for all cores.

        Returns
        -------
        (...) bool

        Raises
        ------
        ValueError
            Where the mesh is not closed, or an argument wrong.

        Examples
        --------
        >>> import bvhscope
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> tree = bvhscope.build(corners, [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
        >>> tree.contains([[0.1, 0.1, 0.1], [1, 1, 1]])
        array([ True, False])
        >>> bvhscope.build(corners, [[0, 2, 1], [0, 3, 2], [0, 1, 3]]).contains([0.1, 0.1, 0.1])
        Traceback (most recent call last):
        ValueError: the mesh has 3 open edges, so that nothing is inside: close it, or take check=False
        """
        self._check_closed(check)
        return self._core.contains(points, threads)

    def signed_distance(self, points: ArrayLike, *, check: bool = True, threads: int = 0) -> NDArray[np.float64]:
        """Measure the distance of each of `points` to the mesh, negative inside.

        Parameters and errors are those of :meth:`contains`.

        Returns
        -------
        (...) float64
            Infinite where the mesh has no triangles, NaN for a point that is not finite.

        Examples
        --------
        >>> import bvhscope
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> tree = bvhscope.build(corners, [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
        >>> tree.signed_distance([[0.25, 0.25, 0.125], [0, 0, 3]])
        array([-0.125,  2.   ])
        """
        self._check_closed(check)
        return self._core.signed_distance(points, threads)

    @property
    def open_edges(self) -> int:
        """Number of edges with an odd number of triangles: 0 for a closed mesh. Corners at equal coordinates are one."""
        return self._core.edges()[0]

    def _check_closed(self, check: bool) -> None:
        if check and (count := self.open_edges):
            edges = "1 open edge" if count == 1 else f"{count:,} open edges"
            raise ValueError(f"the mesh has {edges}, so that nothing is inside: close it, or take check=False")

    # The tree

    @property
    def triangle_count(self) -> int:
        """Number of triangles."""
        return self._core.triangle_count()

    @property
    def container(self) -> str:
        """Kind of the containers: "box", "sphere", "dop" or "oriented"."""
        return self._core.container()

    @property
    def offset(self) -> NDArray[np.float64]:
        """(3,): what is subtracted from all coordinates, in double precision. Not zero where float64 vertices are far from the origin."""
        return np.array(self._core.offset())

    @property
    def sah_cost(self) -> float:
        """Surface area heuristic: cost of a random ray that meets the root, in tests of a box or triangle."""
        return float(self.stats()["sah_cost"])

    @property
    def epo(self) -> float:
        """End-point overlap (Aila, Karras, Laine 2013): cost of the surface inside of nodes that do not hold it.

        Computed when first asked for, with all triangles: some microseconds for each.
        """
        return self._core.epo(0)

    def stats(self) -> dict[str, Any]:
        """Statistics of the tree and of its build.

        Returns
        -------
        dict
            ``triangles``, ``container``, ``builder``, ``settings``, ``build_ms`` (None where the file of a tree does not say), ``nodes``,
            ``leaves``, depths, numbers of triangles in leaves, numbers of children, ``sah_cost``, ``tree_bytes``, and
            ``wide_bytes`` for the tree that rays are traced through, with its triangles.

        Examples
        --------
        >>> import bvhscope
        >>> stats = bvhscope.build([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in range(2)]).stats()
        >>> stats["nodes"], stats["max_depth"], stats["nodes_per_depth"]
        (3, 1, [1, 2])
        """
        tree_bytes, wide_bytes = self._core.sizes()
        return {
            "triangles": self.triangle_count,
            "container": self.container,
            **json.loads(self._core.header()),
            **json.loads(self._core.stats()),
            "tree_bytes": tree_bytes,
            "wide_bytes": wide_bytes,
        }

    @property
    def bounds(self) -> NDArray[np.float32]:
        """(nodes, k): the container of each node, the root first, parents before their children. Less :attr:`offset`; read-only.

        Boxes have k = 6: min x, y, z, max x, y, z; spheres 4: center x, y, z, radius; 14-DOPs 14: a box, four low, four high; oriented
        boxes 21: a box, three normals x, y, z, three low, three high.
        """
        return self._array("bounds", self._core.bounds)

    @property
    def children(self) -> NDArray[np.int32]:
        """(nodes, arity): the children of each node; -1 where there is none, as in all columns of a leaf. Read-only."""
        return self._array("children", self._core.children)

    @property
    def leaves(self) -> NDArray[np.int32]:
        """(nodes, 2): for a leaf the place in :attr:`order` of its first triangle and their number; 0, 0 for others. Read-only."""
        return self._array("leaves", self._core.leaves)

    @property
    def order(self) -> NDArray[np.int32]:
        """Numbers of the triangles in the order of the leaves; a split triangle has several places. Read-only."""
        return self._array("order", self._core.order)

    def _array(self, name: str, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        arrays = self._arrays
        if name not in arrays:
            array = make()
            array.flags.writeable = False
            arrays[name] = array
        return arrays[name]

    @property
    def triangles(self) -> NDArray[np.float32]:
        """(m, 3, 3): the corners of the triangles. Less :attr:`offset`; read-only."""
        return self._array("triangles", self._core.triangles)

    # Pictures

    def render(
        self,
        size: tuple[int, int] = (640, 480),
        *,
        color: str = "lit",
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike = (0.0, 1.0, 0.0),
        threads: int = 0,
    ) -> NDArray[np.uint8]:
        """Draw the triangles, with one ray for each pixel.

        Parameters
        ----------
        size : (int, int)
            Width and height in pixels.
        color : str
            "lit": by a lamp at the eye; "tests": by the tests that each pixel takes in the tree, white for the most.
        eye, target : (3,) float, optional
            The observer, and the point in the middle of the picture; without them the whole mesh is seen.
        up : (3,) float
            Direction that points upwards in the picture.
        threads : int
            Number of threads, 0 for all cores.

        Returns
        -------
        (height, width, 3) uint8
            Red, green and blue of each pixel, the upper rows first.

        Raises
        ------
        ValueError
            Where an argument is wrong; names it and what to do.

        Examples
        --------
        >>> import bvhscope
        >>> tree = bvhscope.build([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
        >>> picture = tree.render((32, 24))
        >>> picture.shape, picture.dtype, bool((picture[0, 0] == 255).all()), bool((picture < 255).any())
        ((24, 32, 3), dtype('uint8'), True, True)
        """
        draw = {"lit": _picture.lit, "tests": _picture.counted}.get(color)
        if draw is None:
            raise ValueError(f"color: '{color}' is none of 'lit', 'tests'")
        if min(size) < 1:
            raise ValueError(f"size: {size[0]} x {size[1]}: give at least 1 x 1")
        bounds = self.triangles.reshape(-1, 3) if self.triangle_count else np.zeros((1, 3))
        box = np.stack([bounds.min(axis=0), bounds.max(axis=0)]).astype(np.float64) + self.offset
        return draw(self, *_picture.camera_rays(box, size, eye, target, up), threads)

    def show(self) -> subprocess.Popen[bytes]:
        """Open the window of the program bvhscope on mesh and tree, without waiting for it.

        The program must be in the path, or named by the environment variable ``BVHSCOPE_PROGRAM``.

        Returns
        -------
        subprocess.Popen
            The program. The file that it opens, in the folder for temporary files, stays until this process ends.

        Raises
        ------
        FileNotFoundError
            Where the program is not found.
        """
        name = program()
        folder = tempfile.mkdtemp(prefix="bvhscope-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        path = os.path.join(folder, "tree.bvh")
        self.save(path)
        return subprocess.Popen([name, path], stdin=subprocess.DEVNULL)

    def _repr_png_(self) -> bytes:
        return _picture.png(self.render((320, 240)))

    def _repr_html_(self) -> str:
        stats = self.stats()
        rows = [
            ("Triangles", f"{stats['triangles']:,}"),
            ("Containers", stats["container"]),
            ("Builder", html.escape(stats["builder"] or "unknown")),
            ("Nodes", f"{stats['nodes']:,}"),
            ("Leaves", f"{stats['leaves']:,} of {stats['mean_leaf_size']:.2f} triangles"),
            ("Depth", f"{stats['max_depth']}"),
            ("SAH cost", f"{stats['sah_cost']:.2f}"),
            ("Memory", f"{(stats['tree_bytes'] + stats['wide_bytes']) / 1e6:,.1f} MB"),
        ]
        if stats["build_ms"] is not None:
            rows.insert(3, ("Build", f"{stats['build_ms']:,.1f} ms"))
        table = "".join(f"<tr><th style='text-align: left'>{name}</th><td>{value}</td></tr>" for name, value in rows)
        picture = base64.b64encode(self._repr_png_()).decode()
        image = f"<img width='320' height='240' alt='The triangles' src='data:image/png;base64,{picture}'>"
        return f"<div style='display: flex; gap: 1em'><table>{table}</table>{image}</div>"

    # Triangles that move, files

    def refit(self, vertices: ArrayLike, faces: ArrayLike | None = None, *, threads: int = 0) -> None:
        """Fit the tree to where its vertices are now: the same nodes with other containers, in a fraction of the time of a build.

        Parameters
        ----------
        vertices : (n, 3) or (m, 3, 3) float
            All vertices in their order, or all triangles.
        faces : (m, 3) int, optional
            Where the tree was made without faces, and `vertices` are vertices.
        threads : int
            Number of threads, 0 for all cores.

        Raises
        ------
        ValueError
            Where the number of triangles is another, or an argument wrong. The tree is unchanged then, as after Ctrl-C.

        Examples
        --------
        >>> import numpy as np, bvhscope
        >>> vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
        >>> tree = bvhscope.build(vertices, [[0, 1, 2]])
        >>> tree.refit(vertices + [0, 0, 1])
        >>> float(tree.closest_hit([0.2, 0.2, 5], [0, 0, -1]).t)
        4.0
        """
        if faces is None and np.ndim(vertices) == 2:
            if self._faces is None:
                raise ValueError("faces: the tree was made without: give them, or triangles of shape (m, 3, 3)")
            faces = self._faces
        self._core.refit(vertices, faces, threads)
        self._arrays = {}

    def save(self, path: str | os.PathLike[str], *, triangles: bool = True) -> None:
        """Write a tree file, which :func:`load` and the program bvhscope read. Replaces a file only when all is written.

        Parameters
        ----------
        path : path
            The file.
        triangles : bool
            Write the triangles as well, so that the file is mesh and tree in one.

        Raises
        ------
        OSError
            Where the file cannot be written.
        """
        path = os.fspath(path)
        name = os.path.join(os.path.dirname(path), f".bvhscope-{secrets.token_hex(8)}")
        os.close(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        try:
            self._core.write(name, triangles)
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise

    def __reduce__(self) -> tuple[Callable[..., Tree], tuple[bytes, NDArray[np.int32] | None]]:
        return _restore, (self._core.to_bytes(), self._faces)

    def __repr__(self) -> str:
        stats = self.stats()

        def count(number: int, noun: str) -> str:
            return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"

        triangles, nodes = count(stats["triangles"], "triangle"), count(stats["nodes"], "node")
        builder = stats["builder"] or "unknown builder"
        return f"<bvhscope.Tree: {triangles}, {stats['container']}, {builder}, {nodes}, SAH cost {stats['sah_cost']:.1f}>"


def _restore(content: bytes, faces: NDArray[np.int32] | None) -> Tree:
    """The tree of a pickle."""
    return Tree(_engine.read(content, None, None, 0)[0], faces)


def _own_faces(faces: ArrayLike | None) -> NDArray[np.int32] | None:
    """A copy of `faces`, which refitting needs later. Numbers that do not fit are left to the checks of the engine."""
    if faces is None:
        return None
    array = np.asarray(faces)
    if array.dtype.kind not in "iu" or (array.size and (array.min() < 0 or array.max() > np.iinfo(np.int32).max)):
        return array
    return np.array(array, dtype=np.int32, order="C")


def _stops_at_any(query: str) -> bool:
    if query not in ("closest", "any"):
        raise ValueError(f"query: '{query}' is none of 'closest', 'any'")
    return query == "any"
