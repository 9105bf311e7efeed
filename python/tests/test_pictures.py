"""Pictures, notebooks, the window and the commands of the program."""

import os
import struct
import sys
import zlib

import numpy as np
import pytest

import bvhscope
from bvhscope import _picture

from . import brute

TREE = bvhscope.build(*brute.sphere(4))


def test_the_whole_mesh_is_seen_and_lit_by_the_eye():
    picture = TREE.render((90, 60))
    assert picture.shape == (60, 90, 3) and picture.dtype == np.uint8
    seen = (picture < 255).any(axis=-1)
    assert not (seen[0].any() or seen[-1].any() or seen[:, 0].any() or seen[:, -1].any())
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    # Round, in the middle, and as large as the sphere around its box allows: 1 of 1.73 of the height.
    assert np.ptp(rows) == np.ptp(columns) and abs(rows.mean() - 29.5) < 1 and abs(columns.mean() - 44.5) < 1
    assert 0.45 * 60 < np.ptp(rows) < 0.65 * 60
    brightness = picture[30].astype(int).sum(axis=-1)
    assert brightness[45] > brightness[columns[1]] and (np.diff(brightness[columns[1] : 45]) >= -9).all()


def test_the_eye_is_where_it_is_put_and_up_is_up():
    floor = bvhscope.build([[[-9, 0, -9], [9, 0, -9], [0, 0, 9]]])
    seen = (floor.render((40, 40), eye=[0, 2, 8], target=[0, 0, 0]) < 255).any(axis=-1)
    assert seen[39].all() and not seen[0].any()
    turned = (floor.render((40, 40), eye=[0, 2, 8], target=[0, 0, 0], up=[0, -1, 0]) < 255).any(axis=-1)
    np.testing.assert_array_equal(turned, seen[::-1, ::-1])
    far = bvhscope.build(np.array([[[-9, 0, -9], [9, 0, -9], [0, 0, 9]]]) + 1e7)
    moved = (far.render((40, 40), eye=np.array([0, 2, 8]) + 1e7, target=[1e7] * 3) < 255).any(axis=-1)
    np.testing.assert_array_equal(moved, seen)


def test_a_picture_of_tests_is_brightest_where_most_are_made():
    eye, directions = _picture.camera_rays(np.array([[-1.0] * 3, [1.0] * 3]), (40, 30), None, None, (0, 1, 0))
    counts = TREE.tests(eye, directions)
    total = counts.containers + counts.triangles
    picture = TREE.render((40, 30), color="tests").astype(int).sum(axis=-1)
    assert picture.flat[total.argmax()] == 3 * 255 == picture.max()
    assert (np.diff(picture.ravel()[np.argsort(total.ravel())]) >= 0).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"color": "red"}, "color: 'red' is none of 'lit', 'tests'"),
        ({"size": (0, 5)}, "size: 0 x 5: give at least 1 x 1"),
        ({"eye": [0, 5, 0], "target": [0, 0, 0]}, "up: runs along the view: give another direction"),
    ],
)
def test_wrong_options_of_a_picture_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        TREE.render(**{"size": (4, 4), **options})


def test_notebooks_get_a_table_and_a_picture():
    picture = TREE._repr_png_()
    assert picture.startswith(b"\x89PNG\r\n\x1a\n") and struct.unpack(">II", picture[16:24]) == (320, 240)
    at = picture.index(b"IDAT")
    length = struct.unpack(">I", picture[at - 4 : at])[0]
    rows = np.frombuffer(zlib.decompress(picture[at + 4 : at + 4 + length]), dtype=np.uint8).reshape(240, 961)
    assert (rows[:, 0] == 0).all()
    np.testing.assert_array_equal(rows[:, 1:].reshape(240, 320, 3), TREE.render((320, 240)))
    text = TREE._repr_html_()
    assert "<td>2,048</td>" in text and f"<td>{TREE.sah_cost:.2f}</td>" in text and "data:image/png;base64,iVBOR" in text
    assert bvhscope.build(np.zeros((0, 3, 3)))._repr_html_()


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """A program in place of bvhscope that prints its arguments, and fails where they say so."""
    script = tmp_path / "bvhscope"
    script.write_text(
        f"#!{sys.executable}\nimport json, os, sys\nwords = sys.argv[1:]\n"
        "if '--fail' in words: sys.exit('warning\\nmesh.obj: no such file; check the path')\n"
        "if words[0].endswith('.bvh'): words.append(os.path.getsize(words[0]))\n"
        "print(json.dumps({'words': words}, indent=1)); print(json.dumps({'row': 2}))\n"
    )
    script.chmod(0o755)
    monkeypatch.setenv("BVHSCOPE_PROGRAM", str(script))


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a script")
def test_a_command_gets_its_options_and_gives_its_rows(stand_in, tmp_path):
    options = {"rays": ["primary", "ao"], "epo_samples": 100, "strict": True, "plot": None, "wide": False, "eye": (-1, 0, 2)}
    rows = bvhscope.measure("compare", tmp_path / "a.obj", "builtin:teapot", **options)
    words = ["compare", str(tmp_path / "a.obj"), "builtin:teapot", "--json", "--rays=primary,ao", "--epo-samples=100", "--strict"]
    assert rows == [{"words": [*words, "--eye=-1,0,2"]}, {"row": 2}]
    with pytest.raises(ValueError, match=r"^mesh\.obj: no such file; check the path$"):
        bvhscope.measure("info", fail=True)


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a script")
def test_the_window_gets_mesh_and_tree(stand_in, capfd):
    window = TREE.show()
    assert window.wait() == 0
    path = window.args[1]
    assert bvhscope.load(path).triangle_count == TREE.triangle_count
    assert str(os.path.getsize(path)) in capfd.readouterr().out


def test_a_program_that_is_missing_is_named(monkeypatch):
    monkeypatch.setenv("BVHSCOPE_PROGRAM", "/nowhere/bvhscope")
    for call in (TREE.show, lambda: bvhscope.measure("info")):
        with pytest.raises(FileNotFoundError, match="/nowhere/bvhscope, which BVHSCOPE_PROGRAM names, is no program: install"):
            call()
    monkeypatch.delenv("BVHSCOPE_PROGRAM")
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(FileNotFoundError, match="bvhscope is not in the path: install it, or set BVHSCOPE_PROGRAM"):
        bvhscope.measure("info")
