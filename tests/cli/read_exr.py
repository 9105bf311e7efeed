"""Writes red, green and blue of each pixel of an OpenEXR file to another file, as little-endian f32: a reader of its own, after
"OpenEXR File Layout" (openexr.com), for one part with tiles or scan lines of 32-bit floats.

    python3 read_exr.py picture.exr pixels.f32
"""

import struct
import sys
import zlib

data = open(sys.argv[1], "rb").read()
magic, version = struct.unpack_from("<iI", data)
assert magic == 20000630 and version & 0xFF == 2 and not version & 0x1800, "one part, no deep data"
is_tiled = bool(version & 0x200)
at = 8


def text():
    global at
    end = data.index(b"\0", at)
    word, at = data[at:end].decode(), end + 1
    return word


attributes = {}
while name := text():
    text()
    (size,) = struct.unpack_from("<i", data, at)
    attributes[name] = data[at + 4 : at + 4 + size]
    at += 4 + size

x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
width, height = x1 - x0 + 1, y1 - y0 + 1
compression = attributes["compression"][0]
assert compression in (0, 1, 2, 3), "none, RLE or ZIP"

channels = []
rest = attributes["channels"]
while rest[0]:
    end = rest.index(b"\0")
    kind, _, *sampling = struct.unpack_from("<iI2i", rest, end + 1)
    assert kind == 2 and sampling == [1, 1], "32-bit floats"
    channels.append(rest[:end].decode())
    rest = rest[end + 17 :]

if is_tiled:
    across, down, mode = struct.unpack("<IIB", attributes["tiles"])
    assert mode & 15 == 0, "one level"
else:
    across, down = width, {0: 1, 1: 1, 2: 1, 3: 16}[compression]
columns, rows = -(-width // across), -(-height // down)


def unpacked(block, size):
    """The bytes of a block, of which there are `size`."""
    if compression == 0 or len(block) == size:
        return block
    if compression == 1:
        runs, i = bytearray(), 0
        while i < len(block):
            count = struct.unpack_from("b", block, i)[0]
            if count < 0:
                runs += block[i + 1 : i + 1 - count]
                i += 1 - count
            else:
                runs += block[i + 1 : i + 2] * (count + 1)
                i += 2
    else:
        runs = bytearray(zlib.decompress(block))
    for i in range(1, len(runs)):
        runs[i] = (runs[i - 1] + runs[i] - 128) & 255
    whole, half = bytearray(size), (size + 1) // 2
    whole[0::2], whole[1::2] = runs[:half], runs[half:]
    return bytes(whole)


picture = {name: [None] * (width * height) for name in channels}
offsets = struct.unpack_from(f"<{columns * rows}Q", data, at)
for offset in offsets:
    if is_tiled:
        column, row, _, _, size = struct.unpack_from("<5i", data, offset)
        left, top, start = column * across, row * down, offset + 20
    else:
        y, size = struct.unpack_from("<2i", data, offset)
        left, top, start = 0, y - y0, offset + 8
    wide, high = min(across, width - left), min(down, height - top)
    block = unpacked(data[start : start + size], 4 * wide * high * len(channels))
    values = iter(struct.unpack(f"<{len(block) // 4}f", block))
    for y in range(top, top + high):
        for name in channels:
            for x in range(left, left + wide):
                picture[name][y * width + x] = next(values)

with open(sys.argv[2], "wb") as out:
    for pixel in zip(picture["R"], picture["G"], picture["B"]):
        out.write(struct.pack("<3f", *pixel))
