"""Converts trees that other libraries save into tree files for bvhscope.

    python3 assets/convert_tree.py tinybvh saved.bin mine.bvh
    python3 assets/convert_tree.py madmann91 saved.bin mine.bvh
    bvhscope mesh.obj --tree mine.bvh

tinybvh    what BVH::Save of jbikker/tinybvh writes, versions 1.6.1 to 1.6.7 (July 2025 to February 2026; cache versions 161
           to 166), on machines of 64 bits
madmann91  what Bvh::serialize of madmann91/bvh writes, version 2 (August 2022 to June 2025), nodes of float or double in 3D,
           with the default sizes of indices

The triangles must be those of the mesh in bvhscope's order, as `bvhscope info --triangles` writes them. docs/tree-file.md has
both layouts byte by byte. Python 3.8 or newer; needs bvhscope_tree.py beside it.
"""

import argparse
import struct
import sys

import bvhscope_tree

#: Bytes of a node of tinybvh: min, left child or first index, max, number of primitives.
_TINY_NODE = struct.Struct("<3fI3fI")
#: Bytes of the file before the C++ object BVH, whose size is the compiler's.
_TINY_OBJECT = 8
#: From the beginning of that object: layout, allocated nodes, used nodes, triangles, indices.
_TINY_FIELDS = struct.Struct("<5I")
_TINY_FIELDS_AT = 32
_TINY_LAYOUT = 1
#: Accepted sizes of the object: 240 to 288 bytes have been seen.
_TINY_OBJECTS = range(64, 4097)

#: Format of a node of madmann91/bvh by the bytes of its numbers: bounds as min, max of x, y, z, then the index.
_MADMANN_NODES = {4: "<6fI", 8: "<6dQ"}
#: Bits of the index that count the primitives of a leaf.
_COUNT_BITS = 4


def from_tinybvh(data):
    """Boxes, links and primitive indices of a tree that tinybvh saved, and its number of triangles."""
    if len(data) < _TINY_OBJECT + _TINY_FIELDS_AT + _TINY_FIELDS.size:
        raise ValueError("too short for a file of tinybvh")
    header, triangles = struct.unpack_from("<2I", data)
    version, layout = header & 0xFFFFFF, header >> 24
    if layout != _TINY_LAYOUT:
        raise ValueError("not a file of BVH::Save: layout %d instead of 1; save the class BVH, not one made from it" % layout)
    if not 161 <= version <= 166:
        raise ValueError("cache version %d of tinybvh; 161 to 166 are known" % version)
    inner_layout, _, nodes, inner_triangles, indices = _TINY_FIELDS.unpack_from(data, _TINY_OBJECT + _TINY_FIELDS_AT)
    if (inner_layout, inner_triangles) != (layout, triangles):
        raise ValueError("the fields of the class BVH are not where 64-bit machines have them")
    begin = len(data) - 4 * indices - _TINY_NODE.size * nodes
    if begin - _TINY_OBJECT not in _TINY_OBJECTS or begin % 8 != 0:
        raise ValueError("%d nodes and %d indices do not fit a file of %d bytes" % (nodes, indices, len(data)))
    boxes, links = [], []
    end = begin + _TINY_NODE.size * nodes
    for ax, ay, az, first, bx, by, bz, count in _TINY_NODE.iter_unpack(data[begin:end]):
        boxes.append((ax, ay, az, bx, by, bz))
        links.append((first, count))
    return boxes, links, struct.unpack_from("<%dI" % indices, data, end), triangles


def from_madmann91(data):
    """Boxes, links and primitive indices of a tree that madmann91/bvh serialised, and a lower bound of its number of
    triangles, which the file does not contain."""
    for size, layout in _MADMANN_NODES.items():
        word = {4: "I", 8: "Q"}[size]
        if len(data) < 2 * size:
            continue
        nodes, indices = struct.unpack_from("<2" + word, data)
        node = struct.Struct(layout)
        if len(data) == 2 * size + nodes * node.size + indices * size:
            break
    else:
        raise ValueError("%d bytes fit neither nodes of float nor of double in 3D" % len(data))
    boxes, links = [], []
    end = 2 * size + nodes * node.size
    for ax, bx, ay, by, az, bz, index in node.iter_unpack(data[2 * size:end]):
        # Doubles are rounded to the nearest float, which keeps the order of numbers, so that children stay inside.
        boxes.append((ax, ay, az, bx, by, bz))
        links.append((index >> _COUNT_BITS, index & ((1 << _COUNT_BITS) - 1)))
    primitives = struct.unpack_from("<%d%s" % (indices, word), data, end)
    return boxes, links, primitives, max(primitives, default=-1) + 1


def arrays_of(boxes, links, primitives):
    """The arrays of a tree file for nodes with two neighbouring children each. `links` has for each node the first child and 0,
    or the first of `primitives` and their number. Nodes that nothing reaches, which tinybvh has, are left out."""
    bounds, children, leaves, indices = [], [], [], []
    order = [0] if boxes else []
    for node in order:
        first, count = links[node]
        bounds.append(boxes[node])
        if count > 0:
            if first + count > len(primitives):
                raise ValueError("the leaf %d ends beyond the indices" % node)
            leaves.append((len(indices), count))
            children.append((bvhscope_tree.EMPTY, bvhscope_tree.EMPTY))
            indices.extend(primitives[first:first + count])
            continue
        if first + 1 >= len(boxes):
            raise ValueError("the children of node %d are beyond the nodes" % node)
        leaves.append((0, 0))
        children.append((len(order), len(order) + 1))
        order += (first, first + 1)
        if len(order) > len(boxes):
            raise ValueError("nodes are reached twice; the last one below node %d" % node)
    return bounds, children, leaves, indices


def main():
    summary, _, details = __doc__.partition("\n\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=details, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("format", choices=("tinybvh", "madmann91"), help="the library that wrote IN")
    parser.add_argument("input", metavar="IN", help="the file to read")
    parser.add_argument("output", metavar="OUT", help="the tree file to write")
    parser.add_argument("--triangles", type=int, metavar="N", help="triangles of the mesh [default: those of the leaves]")
    flags = parser.parse_args()
    read, builder = {
        "tinybvh": (from_tinybvh, "tinybvh"),
        "madmann91": (from_madmann91, "madmann91/bvh"),
    }[flags.format]
    try:
        with open(flags.input, "rb") as file:
            data = file.read()
        boxes, links, primitives, triangles = read(data)
        arrays = arrays_of(boxes, links, primitives)
        bvhscope_tree.write(flags.output, *arrays, arity=2, triangles=flags.triangles or triangles, builder=builder)
    except (OSError, OverflowError, ValueError, struct.error) as error:
        sys.exit("%s: %s" % (flags.input, error))


if __name__ == "__main__":
    main()
