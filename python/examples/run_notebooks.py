"""Runs the code of the notebooks that the arguments name, without pictures on a screen. With `--pictures FOLDER` before them, the first
figure of each is written there."""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
arguments = sys.argv[1:]
pictures = None
if arguments[0] == "--pictures":
    pictures, arguments = pathlib.Path(arguments[1]), arguments[2:]
for path in arguments:
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    names = {}
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"{path}, cell {number}", "exec"), names)
    import matplotlib.pyplot as plt

    assert plt.get_fignums(), f"{path}: no figure was drawn"
    if pictures:
        pictures.mkdir(exist_ok=True)
        plt.figure(plt.get_fignums()[0]).savefig(pictures / f"{pathlib.Path(path).stem}.png", dpi=80, bbox_inches="tight")
    plt.close("all")
    print(f"{path}: {len(cells)} cells")
