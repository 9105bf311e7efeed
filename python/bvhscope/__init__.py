"""Bounding volume hierarchies over triangles: exact ray and point queries, and the tree, its cost and its counts as arrays.

>>> import numpy as np
>>> import bvhscope
>>> vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
>>> tree = bvhscope.build(vertices, faces=[[0, 1, 2]])
>>> hits = tree.closest_hit([0.25, 0.5, 3], [[0, 0, -1], [0, 0, 1]])
>>> hits.triangle
array([ 0, -1], dtype=int32)
>>> hits.t
array([ 3., inf], dtype=float32)

Conventions of all functions:

- Arrays of float32 and float64 in C order are read where they are; anything else is copied. float32 is not converted, float64 is,
  after :attr:`Tree.offset` has been subtracted in double precision.
- Points and directions have their coordinates along the last axis; results have the axes before it. One origin or one direction, of
  shape (3,), goes with any number of the other.
- A miss is triangle -1 at an infinite distance.
- ``threads`` is the number of threads, 0 for all cores. Other threads of Python run meanwhile, Ctrl-C ends the call.
- Wrong arguments raise ``ValueError`` with the name of the argument and what to do. Arrays that other threads write to during a call
  give results for some mixture of old and new numbers, and do no harm.
"""

from ._program import measure
from ._tree import AllHits, ClosestPoints, Counts, Hits, Tree, build, from_file, load

__all__ = ["AllHits", "ClosestPoints", "Counts", "Hits", "Tree", "build", "from_file", "load", "measure"]
