"""Pictures of a tree's triangles."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from ._tree import Tree

# Direction from the mesh to the eye where none is given, with y up; and field of view in radians, from top to bottom.
_FROM = np.array([0.55, 0.4, 0.75])
_FIELD_OF_VIEW = 0.6


def camera_rays(
    bounds: NDArray[np.floating], size: tuple[int, int], eye: ArrayLike | None, target: ArrayLike | None, up: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The eye and the (height, width, 3) directions of a camera; without `eye`, one that sees all of `bounds`, (2, 3)."""
    width, height = size
    middle, radius = bounds.mean(axis=0), np.linalg.norm(np.ptp(bounds, axis=0)) / 2
    at = middle if target is None else np.asarray(target, dtype=np.float64)
    upwards = np.asarray(up, dtype=np.float64)
    if eye is None:
        half = min(1.0, width / height) * np.tan(_FIELD_OF_VIEW / 2)
        # `_FROM` in axes of which `up` is the second.
        axes = _axes(np.roll(upwards, 1), upwards)
        from_eye = at + (radius or 1.0) / np.sin(np.arctan(half)) * (_FROM / np.linalg.norm(_FROM)) @ axes
    else:
        from_eye = np.asarray(eye, dtype=np.float64)
    right, above, back = _axes(from_eye - at, upwards)
    scale = 2 * np.tan(_FIELD_OF_VIEW / 2) / height
    x = scale * (np.arange(width) + 0.5 - width / 2)
    y = scale * (height / 2 - np.arange(height) - 0.5)
    return from_eye, x[None, :, None] * right + y[:, None, None] * above - back


def _axes(back: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows right, up and back of unit length, at right angles."""
    right = np.cross(up, back)
    if not np.any(right):
        raise ValueError("up: runs along the view: give another direction")
    rows: NDArray[np.float64] = np.stack([right, np.cross(back, right), back])
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows


def lit(tree: Tree, eye: NDArray[np.float64], directions: NDArray[np.float64], threads: int) -> NDArray[np.uint8]:
    """(height, width, 3): the triangles in the light of a lamp at the eye, on white."""
    hits = tree.closest_hit(eye, directions, threads=threads)
    is_hit = hits.triangle >= 0
    a, b, c = np.moveaxis(tree.triangles[hits.triangle[is_hit]].astype(np.float64), 1, 0)
    normals, along = np.cross(b - a, c - a), directions[is_hit]
    lengths = np.linalg.norm(normals, axis=1) * np.linalg.norm(along, axis=1)
    cosine = np.abs((normals * along).sum(axis=1)) / np.where(lengths > 0, lengths, 1)
    picture = np.full((*is_hit.shape, 3), 255, dtype=np.uint8)
    # Linear light to sRGB, nearly.
    picture[is_hit] = (255 * (0.05 + 0.75 * cosine[:, None] * [0.8, 0.85, 0.9]) ** (1 / 2.2)).astype(np.uint8)
    return picture


def counted(tree: Tree, eye: NDArray[np.float64], directions: NDArray[np.float64], threads: int) -> NDArray[np.uint8]:
    """(height, width, 3): tests of containers and triangles that each pixel takes, from black over red and yellow to white."""
    counts = tree.tests(eye, directions, threads=threads)
    heat = 3 * ((counts.containers + counts.triangles) / max(1, (counts.containers + counts.triangles).max()))
    picture: NDArray[np.uint8] = (255 * np.clip(heat[..., None] - [0, 1, 2], 0, 1)).astype(np.uint8)
    return picture


def png(picture: NDArray[np.uint8]) -> bytes:
    """A picture (height, width, 3) as a PNG file."""
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = picture.reshape(height, -1)

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows.tobytes())), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)
