"""Models of files, by the readers of the program."""

import gzip
import json

import numpy as np
import pytest

import bvhscope

from . import brute

pytestmark = pytest.mark.skipif(not hasattr(bvhscope._engine, "read_model"), reason="built without the readers of files")

VERTICES, FACES = brute.sphere(2)
OBJ = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in VERTICES.tolist()) + "".join(
    f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES.tolist()
)


def test_a_file_gives_the_tree_of_its_arrays(tmp_path):
    (tmp_path / "sphere.obj").write_text(OBJ)
    (tmp_path / "sphere.obj.gz").write_bytes(gzip.compress(OBJ.encode()))
    expected = bvhscope.build(VERTICES, FACES, preset="hq")
    for name in ("sphere.obj", "sphere.obj.gz"):
        tree = bvhscope.from_file(tmp_path / name, preset="hq")
        np.testing.assert_array_equal(tree.triangles, VERTICES[FACES])
        np.testing.assert_array_equal(tree.bounds, expected.bounds)
        assert tree.stats()["settings"] == expected.stats()["settings"]
    expected.save(tmp_path / "sphere.bvh")
    np.testing.assert_array_equal(bvhscope.from_file(tmp_path / "sphere.bvh").triangles, VERTICES[FACES])


def test_coordinates_far_away_have_the_offset_of_arrays(tmp_path):
    place = np.array([408_204.0, 4_080_928.0, 12.0])
    (tmp_path / "far.obj").write_text(
        "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in (VERTICES + place).tolist()) + "f 1 3 5\nf 2 4 6\n"
    )
    tree = bvhscope.from_file(tmp_path / "far.obj")
    same = bvhscope.build(VERTICES + place, [[0, 2, 4], [1, 3, 5]])
    np.testing.assert_array_equal(tree.offset, same.offset)
    np.testing.assert_array_equal(tree.triangles, same.triangles)


def test_faults_of_a_file_are_warnings_and_others_are_refused(tmp_path):
    path = tmp_path / "sphere.obj"
    path.write_text(OBJ + "f 1 2 999\n")
    with pytest.warns(UserWarning, match=r"sphere\.obj: 1 "):
        assert bvhscope.from_file(path).triangle_count == len(FACES)
    path.write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match=r"sphere\.obj: .*; "):
        bvhscope.from_file(path)
    with pytest.raises(FileNotFoundError):
        bvhscope.from_file(tmp_path / "none.obj")
    with pytest.raises(ValueError, match="path: there is no built-in scene 'bunny'; there are: "):
        bvhscope.from_file("builtin:bunny")
    with pytest.raises(ValueError, match="preset: 'x' is none of"):
        bvhscope.from_file("builtin:teapot", preset="x")


def test_options_have_their_names_of_python(tmp_path):
    (tmp_path / "inside").mkdir()
    (tmp_path / "mesh.bin").write_bytes(VERTICES[FACES].astype("<f4").tobytes())
    count = 3 * len(FACES)
    gltf = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "../mesh.bin", "byteLength": 12 * count}],
        "bufferViews": [{"buffer": 0, "byteLength": 12 * count}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    path = tmp_path / "inside" / "mesh.gltf"
    path.write_text(json.dumps(gltf))
    with pytest.raises(ValueError, match="allow_outside=True"):
        bvhscope.from_file(path)
    assert bvhscope.from_file(path, allow_outside=True).triangle_count == len(FACES)


def test_built_in_models_are_there():
    tree = bvhscope.from_file("builtin:terrain:1000", container="sphere", threads=1)
    assert (tree.triangle_count, tree.container, tree.open_edges > 0) == (968, "sphere", True)
