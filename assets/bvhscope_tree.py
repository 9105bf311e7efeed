"""Writes and reads tree files: bounding volume hierarchies that bvhscope shows, traces and measures.

    import bvhscope_tree
    bvhscope_tree.write("mine.bvh", bounds, children, leaves, indices, triangles=1000, builder="mine")

    bvhscope mesh.obj --tree mine.bvh

`write_two_levels` writes trees of meshes below one over copies of them, `read` and `read_two_levels` read what was written.

One file for Python 3.8 or newer, without dependencies. Where NumPy is installed, its arrays are written as they are, without a
detour through lists, and `read` returns such arrays. The format is described in docs/tree-file.md; examples are in
examples/tree_file/. Part of bvhscope and licensed like it, under MIT or Apache-2.0, at your option.
"""

import array
import itertools
import json
import os
import sys

try:
    import numpy
except ImportError:
    numpy = None

#: An empty slot among the children of a node.
EMPTY = 0xFFFFFFFF

_MAGIC = b"bvhscope tree 1\n"
_MAGIC_TWO_LEVELS = b"bvhscope tree 2\n"
_LONGEST_HEADER = 1 << 20
#: Numbers in a row of `bounds`, by container.
_WIDTHS = {"box": 6, "sphere": 4, "dop": 14, "oriented": 21}
#: Type codes of `array` with 32 bits.
_CODES = {"f": "f", "u": "I" if array.array("I").itemsize == 4 else "L"}


class Tree:
    """Result of `read`: the header as a dictionary, and the arrays `bounds`, `children`, `leaves`, `indices` and `corners`
    (None where the file has none). They are NumPy arrays in the shapes of docs/tree-file.md, or flat arrays of the standard
    library's module `array` where NumPy is not installed."""

    def __init__(self, header, arrays):
        self.header = header
        self.bounds = arrays["bounds"]
        self.children = arrays["children"]
        self.leaves = arrays["leaves"]
        self.indices = arrays["indices"]
        self.corners = arrays["corners"]


class TwoLevels:
    """Result of `read_two_levels`: the header as a dictionary; `meshes`, a list with a `Tree` for each mesh; `top`, the `Tree` over the
    instances, whose `indices` are their numbers; and the arrays `instances`, the mesh of each, `matrices`, twelve numbers each, and `ids`
    (None where the file has none). The header of each tree is None."""

    def __init__(self, header, meshes, top, arrays):
        self.header = header
        self.meshes = meshes
        self.top = top
        self.instances = arrays["instances"]
        self.matrices = arrays["matrices"]
        self.ids = arrays["ids"]


def write(path, bounds, children, leaves, indices, *, triangles=None, corners=None, container="box", arity=None, builder=None,
          settings=None, build_ms=None, **fields):
    """Writes a tree to the file `path`, which appears there once it is whole.

    bounds     of every node: min x, y, z, max x, y, z ("box"); center x, y, z, radius ("sphere"); or min x, y, z, max x, y, z, four
               low and four high along the diagonals ("dop"); or min x, y, z, max x, y, z, three normals, three low and three high
               along them ("oriented")
    children   of every node, `arity` numbers each; EMPTY or -1 is an empty slot; the row of a leaf is not read
    leaves     of every node: first index and number of indices; the number of an interior node is 0
    indices    the triangles in the leaves, from 0
    triangles  number of triangles of the mesh; not needed with `corners`
    corners    the triangles themselves, nine numbers each: the file is then model and tree in one
    container  "box", "sphere", "dop" or "oriented"
    arity      most children of a node, 2 to 32; taken from the rows of `children` where these are rows
    builder    name of the builder
    settings   its settings, a text or a dictionary
    build_ms   milliseconds that the build took
    fields     further fields of the header

    Arrays are lists of rows, flat lists, or anything with the buffer interface, as NumPy's arrays. ValueError says which of
    them does not fit the others.
    """
    if container not in _WIDTHS:
        raise ValueError("container is %r, neither 'box', 'sphere', 'dop' nor 'oriented'" % (container,))
    if arity is None:
        arity = _row_length(children)
    data, triangles = _tree(bounds, children, leaves, indices, triangles, corners, container, arity)
    header = dict(fields, container=container, arity=int(arity), nodes=_rows("leaves", data, 2), indices=len(data["indices"]),
                  triangles=int(triangles), builder=builder, settings=settings, build_ms=build_ms)
    _save(path, _MAGIC, header, {name: [numbers] for name, numbers in data.items()})


def write_two_levels(path, meshes, top, instances, matrices, *, ids=None, builder=None, settings=None, build_ms=None, **fields):
    """Writes a tree for each mesh and one over copies of the meshes, the instances, to the file `path`.

    meshes     of each mesh a dictionary of `bounds`, `children`, `leaves`, `indices`, and `triangles` or `corners`, as for `write`: a tree
               of boxes in the coordinates of the mesh. Either all have corners or none has
    top        such a dictionary without triangles: the tree over the instances in world space. Its indices are those of instances, from 0,
               each in one leaf
    instances  the mesh of each instance, from 0
    matrices   of each instance three rows of four numbers, from the mesh to the world; the last of each row is the translation
    ids        of each instance a number of your own
    builder    and all others as for `write`

    The number of children in a row may differ from tree to tree. ValueError says what does not fit.
    """
    meshes = list(meshes)
    if not meshes:
        raise ValueError("there are no meshes")
    trees = meshes + [dict(top, triangles=len(instances))]
    arities = [_row_length(tree["children"]) for tree in trees]
    parts, counts = {}, []
    for number, (tree, arity) in enumerate(zip(trees, arities)):
        name = "mesh %d" % number if number < len(meshes) else "top"
        try:
            unknown = set(tree) - {"bounds", "children", "leaves", "indices", "triangles", "corners"}
            if unknown:
                raise ValueError("there is no %s" % ", ".join(sorted(unknown)))
            data, triangles = _tree(tree["bounds"], tree["children"], tree["leaves"], tree["indices"], tree.get("triangles"),
                                    tree.get("corners"), "box", arity)
        except (KeyError, ValueError) as error:
            raise ValueError("%s: %s" % (name, error)) from error
        if number < len(meshes) and ("corners" in data) != (meshes[0].get("corners") is not None):
            raise ValueError("%s: some meshes have corners and some have none" % name)
        data["children"] = _padded(data["children"], arity, max(arities))
        counts.append([_rows("leaves", data, 2), len(data["indices"]), int(triangles)])
        for array_name, numbers in data.items():
            parts.setdefault(array_name, []).append(numbers)
    parts["trees"] = [_numbers("trees", counts, "u")]
    parts["instances"] = [_numbers("instances", instances, "u")]
    parts["matrices"] = [_numbers("matrices", matrices, "f")]
    if ids is not None:
        parts["ids"] = [_numbers("ids", ids, "u")]
    for name, width in (("instances", 1), ("matrices", 12), ("ids", 1)):
        if name in parts and len(parts[name][0]) != width * counts[-1][2]:
            raise ValueError("%s has %d numbers, not %d for each of %d instances" % (name, len(parts[name][0]), width, counts[-1][2]))
    header = dict(fields, container="box", arity=max(arities), nodes=sum(row[0] for row in counts),
                  indices=sum(row[1] for row in counts), triangles=sum(row[2] for row in counts[:-1]), trees=len(counts),
                  instances=counts[-1][2], builder=builder, settings=settings, build_ms=build_ms)
    _save(path, _MAGIC_TWO_LEVELS, header, parts)


def _tree(bounds, children, leaves, indices, triangles, corners, container, arity):
    """The arrays of a tree by name, and the number of triangles."""
    if not 2 <= arity <= 32:
        raise ValueError("arity is %s, not 2 to 32" % (arity,))
    data = {
        "bounds": _numbers("bounds", bounds, "f"),
        "children": _numbers("children", children, "u"),
        "leaves": _numbers("leaves", leaves, "u"),
        "indices": _numbers("indices", indices, "u"),
    }
    nodes = _rows("leaves", data, 2)
    for name, width in (("bounds", _WIDTHS[container]), ("children", arity)):
        if _rows(name, data, width) != nodes:
            raise ValueError("%s has %d rows, leaves has %d" % (name, _rows(name, data, width), nodes))
    if corners is not None:
        data["corners"] = _numbers("corners", corners, "f")
        if triangles not in (None, _rows("corners", data, 9)):
            raise ValueError("triangles is %s, corners has %d rows" % (triangles, _rows("corners", data, 9)))
        triangles = _rows("corners", data, 9)
    if triangles is None:
        raise ValueError("the number of triangles is missing")
    return data, triangles


def _save(path, magic, header, parts):
    """Writes a file of arrays, each in parts that follow one another."""
    places, end = {}, 0
    for name, arrays in parts.items():
        places[name] = end
        end += 4 * sum(len(numbers) for numbers in arrays)
    header = {name: value for name, value in dict(header, arrays=places).items() if value is not None}
    line = json.dumps(header).encode("ascii") + b"\n"
    if len(line) > _LONGEST_HEADER:
        raise ValueError("the header takes %d bytes, more than 1 MiB" % len(line))

    part = os.fspath(path) + ".part"
    try:
        with open(part, "wb") as file:
            file.write(magic + line)
            for arrays in parts.values():
                for numbers in arrays:
                    file.write(numbers)
        os.replace(part, path)
    except BaseException:
        if os.path.exists(part):
            os.remove(part)
        raise


def read(path):
    """The `Tree` in the file `path`. Checks that the arrays are complete, not their values: bvhscope does that.
    Raises ValueError with the fault."""
    header, arrays = _load(path, _MAGIC)
    return Tree(header, arrays)


def read_two_levels(path):
    """The `TwoLevels` in the file `path`, checked as by `read`."""
    header, arrays = _load(path, _MAGIC_TWO_LEVELS)
    trees, ends = [], [0, 0, 0]
    for row in _lists(arrays["trees"], 3):
        starts, ends = ends, [end + count for end, count in zip(ends, row)]
        part = {name: _part(arrays[name], starts[0], ends[0], width)
                for name, width in (("bounds", 6), ("children", header["arity"]), ("leaves", 2))}
        part["indices"] = _part(arrays["indices"], starts[1], ends[1], 1)
        part["corners"] = None
        if arrays["corners"] is not None and len(trees) + 1 < header["trees"]:
            part["corners"] = _part(arrays["corners"], starts[2], ends[2], 9)
        trees.append(Tree(None, part))
    if ends[:2] != [header["nodes"], header["indices"]] or ends[2] != header["triangles"] + header["instances"]:
        raise ValueError("%s: the rows of trees do not add up to the counts of the header" % path)
    return TwoLevels(header, trees[:-1], trees[-1], arrays)


def _load(path, magic):
    """The header of the file `path`, and its arrays by name; None for those that it lacks and may lack."""
    with open(path, "rb") as file:
        if file.readline(len(magic)) != magic:
            raise ValueError("%s: does not begin with '%s'" % (path, magic.decode("ascii").rstrip()))
        line = file.readline(_LONGEST_HEADER + 1)
        if not line.endswith(b"\n"):
            raise ValueError("%s: the header has no end within 1 MiB" % path)
        header = json.loads(line)
        data = file.read()
    try:
        nodes, places = header["nodes"], header["arrays"]
        shapes = {
            "bounds": ("f", nodes, _WIDTHS[header["container"]]),
            "children": ("u", nodes, header["arity"]),
            "leaves": ("u", nodes, 2),
            "indices": ("u", header["indices"], 1),
            "corners": ("f", header["triangles"], 9),
        }
        if magic == _MAGIC_TWO_LEVELS:
            shapes["trees"] = ("u", header["trees"], 3)
            shapes["instances"] = ("u", header["instances"], 1)
            shapes["matrices"] = ("f", header["instances"], 12)
            shapes["ids"] = ("u", header["instances"], 1)
    except KeyError as error:
        raise ValueError("%s: the header lacks or does not know %s" % (path, error)) from error
    arrays = {"corners": None, "ids": None}
    for name, (kind, rows, width) in shapes.items():
        if name in ("corners", "ids") and name not in places:
            continue
        if name not in places:
            raise ValueError("%s: there is no array %s" % (path, name))
        begin, size = places[name], 4 * rows * width
        if begin < 0 or begin + size > len(data):
            raise ValueError("%s: the array %s ends beyond the file" % (path, name))
        arrays[name] = _array(data, begin, kind, rows, width)
    return header, arrays


def read_triangles(path):
    """The triangles that `bvhscope info --triangles FILE MODEL` wrote to the file `path`, nine numbers each: a NumPy array of
    that shape, or a list of tuples where NumPy is not installed."""
    with open(path, "rb") as file:
        data = file.read()
    if len(data) % 36 != 0:
        raise ValueError("%s: %d bytes are no whole number of triangles" % (path, len(data)))
    numbers = _array(data, 0, "f", len(data) // 36, 9)
    return numbers if numpy else list(zip(*[iter(numbers)] * 9))


def _row_length(children):
    """Numbers in a row of `children`; 2 where these are not in rows."""
    shape = getattr(children, "shape", None)
    if shape is not None:
        return shape[1] if len(shape) == 2 else 2
    first = next(iter(children), None)
    return len(first) if hasattr(first, "__len__") else 2


def _padded(children, arity, width):
    """Rows of `arity` children as rows of `width`."""
    if arity == width:
        return children
    if numpy is not None:
        rows = numpy.full((len(children) // arity, width), EMPTY, "<u4")
        rows[:, :arity] = children.reshape(-1, arity)
        return rows.reshape(-1)
    # The number of an empty slot is the same in any byte order.
    empty = array.array(_CODES["u"], [EMPTY] * (width - arity))
    rows = array.array(_CODES["u"])
    for begin in range(0, len(children), arity):
        rows += children[begin:begin + arity] + empty
    return rows


def _part(numbers, begin, end, width):
    """Rows of an array that `read` returns."""
    return numbers[begin:end] if numpy else numbers[width * begin:width * end]


def _lists(numbers, width):
    """The rows of an array that `read` returns, as lists of Python's numbers."""
    return numbers.tolist() if numpy else [list(numbers[begin:begin + width]) for begin in range(0, len(numbers), width)]


def _rows(name, data, width):
    """Rows of `width` numbers in the array `name`."""
    if len(data[name]) % width != 0:
        raise ValueError("%s has %d numbers, not a multiple of %d" % (name, len(data[name]), width))
    return len(data[name]) // width


def _numbers(name, values, kind):
    """`values` as a flat array of little-endian f32 (kind "f") or u32 (kind "u")."""
    if numpy is not None:
        values = numpy.asarray(values)
        if kind == "u" and values.size > 0:
            if values.dtype.kind not in "iu":
                raise ValueError("%s holds %s, not whole numbers" % (name, values.dtype))
            # As Python's numbers, because -1 compares with unsigned ones.
            if int(values.min()) < -1 or int(values.max()) > EMPTY:
                raise ValueError("%s holds numbers beyond 32 bits" % name)
        return numpy.ascontiguousarray(values).astype("<f4" if kind == "f" else "<u4", copy=False).reshape(-1)
    while len(values) > 0 and hasattr(values[0], "__len__"):
        values = list(itertools.chain.from_iterable(values))
    if kind == "u":
        values = (EMPTY if value == -1 else value for value in values)
    try:
        numbers = array.array(_CODES[kind], values)
    except (OverflowError, TypeError) as error:
        raise ValueError("%s: %s" % (name, error)) from error
    return _swapped(numbers)


def _array(data, begin, kind, rows, width):
    """The numbers of an array at byte `begin` of `data`."""
    if numpy is not None:
        flat = numpy.frombuffer(data, "<f4" if kind == "f" else "<u4", rows * width, begin)
        return flat if width == 1 else flat.reshape(rows, width)
    numbers = array.array(_CODES[kind])
    numbers.frombytes(data[begin:begin + 4 * rows * width])
    return _swapped(numbers)


def _swapped(numbers):
    """`numbers` from the machine's byte order to that of files, or back."""
    if sys.byteorder == "big":
        numbers.byteswap()
    return numbers
