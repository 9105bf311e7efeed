"""Rays for trimesh: a drop-in for its own intersectors.

>>> import trimesh
>>> import bvhscope.trimesh
>>> mesh = trimesh.creation.icosphere()
>>> mesh.ray = bvhscope.trimesh.RayMeshIntersector(mesh)
>>> locations, index_ray, index_tri = mesh.ray.intersects_location([[0, 0, 5]], [[0, 0, -1]])
>>> locations[:, 2]
array([ 1., -1.])
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._tree import Tree, build

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["RayMeshIntersector"]

# Hits of a ray that are nearer to each other are one, as where it meets an edge; a fraction of the mesh's size. trimesh's own
# intersectors move a ray by as much behind each hit.
_SAME_LOCATION = 1e-6


class RayMeshIntersector:
    """Ray queries of a mesh, with the methods of ``trimesh.ray.ray_pyembree.RayMeshIntersector``.

    The tree is built with the first query, and again after the mesh has changed. Hits are ordered by ray, then by distance.

    Parameters
    ----------
    geometry : trimesh.Trimesh
        The mesh.
    scale_to_box : bool
        Ignored: meshes of any size are traced as they are.
    preset : str
        Preset of :func:`bvhscope.build`.
    threads : int
        Number of threads, 0 for all cores.
    """

    def __init__(self, geometry: Trimesh, scale_to_box: bool = True, *, preset: str = "fast", threads: int = 0) -> None:
        self.mesh = geometry
        self._preset = preset
        self._threads = threads
        self._made: tuple[int, Tree] | None = None

    @property
    def tree(self) -> Tree:
        """The :class:`bvhscope.Tree` of the mesh."""
        key = hash(self.mesh)
        if self._made is None or self._made[0] != key:
            self._made = key, build(self.mesh.vertices, self.mesh.faces, preset=self._preset, threads=self._threads)
        return self._made[1]

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True, **options: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """Return where rays hit the mesh.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Rays.
        multiple_hits : bool
            Return all hits of each ray; otherwise the nearest.
        max_hits : int
            Most hits of each ray.

        Returns
        -------
        locations : (m, 3) float64
            Hits.
        index_ray : (m,) int64
            Number of the ray of each.
        index_tri : (m,) int64
            Number of the triangle of each.
        """
        index_tri, index_ray, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits=multiple_hits, return_locations=True, **options
        )
        return locations, index_ray, index_tri

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> Any:
        """Return the triangles that rays hit; where a ray meets several at one place, the first.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Rays.
        multiple_hits : bool
            Return all hits of each ray; otherwise the nearest.
        max_hits : int
            Most hits of each ray.
        return_locations : bool
            Return the hits as well.

        Returns
        -------
        index_tri : (m,) int64
            Number of the triangle of each hit.
        index_ray : (m,) int64
            Number of its ray.
        locations : (m, 3) float64
            The hits, where `return_locations`.
        """
        origins, directions = _rays(ray_origins, ray_directions)
        threads = self._threads
        if multiple_hits:
            hits = self.tree.all_hits(origins, directions, threads=threads)
            index_tri, index_ray, t = hits.triangle, hits.ray, hits.t
        else:
            nearest = self.tree.closest_hit(origins, directions, threads=threads)
            index_ray = np.flatnonzero(nearest.triangle >= 0)
            index_tri, t = nearest.triangle[index_ray], nearest.t[index_ray]
        distances = self._distances(index_tri, origins[index_ray], directions[index_ray], t)
        if multiple_hits:
            kept = _distinct(index_ray, distances, max(1e-8, _SAME_LOCATION * self.mesh.scale), max_hits)
            index_tri, index_ray, distances = index_tri[kept], index_ray[kept], distances[kept]
        index_tri = index_tri.astype(np.int64)
        if return_locations:
            return index_tri, index_ray, origins[index_ray] + distances[:, None] * directions[index_ray]
        return index_tri, index_ray

    def _distances(
        self,
        index_tri: NDArray[np.integer],
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        t: NDArray[np.float32],
    ) -> NDArray[np.float64]:
        """The distances of hits in double precision, by the planes of their triangles; `t` where a ray runs along the plane."""
        triangles = np.asarray(self.mesh.triangles)[index_tri]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        along = np.einsum("ij,ij->i", normals, directions)
        across = np.abs(along) > 1e-6 * np.linalg.norm(normals, axis=1)
        to_plane = np.einsum("ij,ij->i", normals, triangles[:, 0] - origins)
        distances: NDArray[np.float64] = t.astype(np.float64)
        np.divide(to_plane, along, out=distances, where=across)
        return distances

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.int64]:
        """Return the first triangle of each ray.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Rays.

        Returns
        -------
        (n,) int64
            Numbers of triangles, -1 where a ray misses.
        """
        rays = _rays(ray_origins, ray_directions)
        return self.tree.closest_hit(*rays, threads=self._threads).triangle.astype(np.int64)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each ray hits the mesh.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Rays.

        Returns
        -------
        (n,) bool
        """
        return self.tree.any_hit(*_rays(ray_origins, ray_directions), threads=self._threads)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each point lies inside of the mesh. For a mesh that is not closed the answer means nothing.

        Parameters
        ----------
        points : (n, 3) float
            Points.

        Returns
        -------
        (n,) bool
        """
        return self.tree.contains(points, check=False, threads=self._threads)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_made": None}

    def __copy__(self) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, preset=self._preset, threads=self._threads)

    def __deepcopy__(self, memo: dict[int, Any]) -> RayMeshIntersector:
        return self.__copy__()


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origins and unit directions; a direction without length stays as it is."""
    origins, directions = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
    if origins.shape != directions.shape or origins.ndim != 2:
        raise ValueError(f"ray_directions: shape {directions.shape}: give as many as origins, of shape {origins.shape}")
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, np.divide(directions, lengths, out=directions.copy(), where=lengths > 0)


def _distinct(index_ray: NDArray[np.int64], distances: NDArray[np.float64], tolerance: float, max_hits: int) -> NDArray[np.bool_]:
    """Which hits, sorted by ray and distance, are not at the location of the one before, and among the first `max_hits` of a ray."""
    if not len(index_ray):
        return np.zeros(0, dtype=bool)
    is_new = np.ones(len(index_ray), dtype=bool)
    is_new[1:] = (np.diff(index_ray) > 0) | (np.diff(distances) > tolerance)
    # The number of each hit among those of its ray.
    count = np.cumsum(is_new)
    starts = np.flatnonzero(np.diff(index_ray, prepend=-1))
    before = np.repeat(count[starts] - 1, np.diff(np.append(starts, len(index_ray))))
    is_new &= count - before <= max_hits
    return is_new
