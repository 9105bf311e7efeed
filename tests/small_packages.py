#!/usr/bin/env python3
"""Makes the list of packages in Cargo.toml that are compiled for size, from the times of two builds.

    cargo build --release --timings --config 'profile.release.package."*".opt-level=3'
    mv target/cargo-timings/cargo-timing.html fast.html; cargo clean
    cargo build --release --timings --config 'profile.release.package."*".opt-level="s"'
    mv target/cargo-timings/cargo-timing.html small.html
    tests/small_packages.py fast.html small.html [Cargo.toml]

Prints the sections, or with a file replaces those between the marks "small packages" in it. A section of a package in Cargo.toml is
stronger than "*" on the command line: remove the list first. A package is listed if it is compiled at least LEAST_GAIN seconds faster
for size, and is not among those that loading, building or tracing wait for.
"""

import json
import re
import sys

# Below this, a section is not worth its two lines.
LEAST_GAIN = 0.4
# Their speed is felt: geometry, sorting, parallel loops, memory, the file formats, and drawing of the window's triangles and text.
HOT = """
ab_glyph ab_glyph_rasterizer base64 basisu bvhscope bvhscope-engine bytemuck crc32fast csv csv-core draco-core earcut ecolor egui emath
epaint exr fdeflate fearless_simd flate2 gif glam gltf gltf-json half image image-webp libmimalloc-sys lebe mimalloc miniz_oxide png
rayon rayon-core serde_json simd-adler32 tobj weezl zune-core zune-inflate zune-jpeg
""".split()
BEGIN, END = "# Begin of small packages.\n", "# End of small packages.\n"


def seconds(path):
    """Seconds of compiling each package for the program; build scripts and macros, which run on the host, are left out."""
    with open(path, encoding="utf-8") as file:
        found = re.search(r"const UNIT_DATA = (\[.*?\n\]|\[.*?\]);", file.read(), re.DOTALL)
    if not found:
        sys.exit(f"{path}: no report of cargo build --timings")
    times = {}
    for unit in json.loads(found[1]):
        if unit["target"].strip() == "" and unit["mode"] == "build":
            times[unit["name"]] = times.get(unit["name"], 0.0) + unit["duration"]
    return times


def sections(fast, small):
    """The sections of packages that gain enough, in the order of their names."""
    gains = {name: fast[name] - small[name] for name in fast.keys() & small.keys()}
    names = sorted(name for name, gain in gains.items() if gain >= LEAST_GAIN and name not in HOT)
    return "".join(f'[profile.release.package.{name}]\nopt-level = "s"\n' for name in names)


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    text = sections(seconds(sys.argv[1]), seconds(sys.argv[2]))
    if len(sys.argv) == 3:
        print(text, end="")
        return
    with open(sys.argv[3], encoding="utf-8") as file:
        before, rest = file.read().split(BEGIN)
    after = rest.split(END)[1]
    with open(sys.argv[3], "w", encoding="utf-8") as file:
        file.write(before + BEGIN + text + END + after)


if __name__ == "__main__":
    main()
