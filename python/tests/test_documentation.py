"""Examples give what they show, and everything public is documented and in the stubs."""

import ast
import doctest
import importlib
import inspect
import pathlib

import pytest

import bvhscope

PYTHON = ["bvhscope", "bvhscope._tree", "bvhscope.trimesh"]


@pytest.mark.parametrize("name", PYTHON)
def test_examples_give_what_they_show(name):
    if name == "bvhscope.trimesh":
        pytest.importorskip("trimesh")
    failed, attempted = doctest.testmod(importlib.import_module(name))
    assert failed == 0 and attempted > 3


@pytest.mark.parametrize(
    "function",
    [
        bvhscope.build,
        bvhscope.from_file,
        bvhscope.load,
        *(member for name, member in inspect.getmembers(bvhscope.Tree, inspect.isfunction) if not name.startswith("_")),
    ],
)
def test_functions_document_arguments_results_errors_and_an_example(function):
    text = inspect.getdoc(function)
    assert text and text.splitlines()[0].endswith(".")
    is_short = "those of :meth:" in text
    for parameter in list(inspect.signature(function).parameters):
        assert parameter == "self" or is_short or parameter in text, f"{function.__qualname__}: {parameter}"
    assert ">>> " in text or function.__name__ in ("save", "show")


def test_every_public_name_is_documented():
    members = [bvhscope.Tree, *(getattr(bvhscope, name) for name in bvhscope.__all__)]
    members += [member for name, member in inspect.getmembers(bvhscope.Tree) if not name.startswith("_")]
    assert [member for member in members if not inspect.getdoc(member)] == []


def test_the_stubs_have_the_members_of_the_engine():
    folder = pathlib.Path(bvhscope.__file__).parent
    assert (folder / "py.typed").exists()
    stubs = ast.parse((folder / "_engine.pyi").read_text())
    classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
    functions = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef)}
    engine = bvhscope._engine
    assert set(functions) | {"Core"} == {name for name in dir(engine) if not name.startswith("__")}
    methods = {node.name: node for node in classes["Core"].body}
    assert set(methods) == {name for name in dir(engine.Core) if not name.startswith("__")}
    for name, node in [*functions.items(), *methods.items()]:
        owner = engine if name in functions else engine.Core
        parameters = [argument.arg for argument in node.args.args]
        assert parameters == list(inspect.signature(getattr(owner, name)).parameters), name
