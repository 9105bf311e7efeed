"""Runs the code of the notebooks that the arguments name, without pictures on a screen."""

import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("notebooks", nargs="+")
parser.add_argument("--pictures", type=pathlib.Path, metavar="FOLDER", help="write the first figure of each there")
arguments = parser.parse_args()
for path in arguments.notebooks:
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    names = {}
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"{path}, cell {number}", "exec"), names)
    import matplotlib.pyplot as plt

    assert plt.get_fignums(), f"{path}: no figure was drawn"
    if arguments.pictures:
        arguments.pictures.mkdir(exist_ok=True)
        file = arguments.pictures / f"{pathlib.Path(path).stem}.png"
        plt.figure(plt.get_fignums()[0]).savefig(file, dpi=80, bbox_inches="tight")
    plt.close("all")
    print(f"{path}: {len(cells)} cells")
