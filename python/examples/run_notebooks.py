"""Runs the code of the notebooks that the arguments name, without pictures on a screen."""

import json
import sys

import matplotlib

matplotlib.use("Agg")
for path in sys.argv[1:]:
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    names = {}
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"{path}, cell {number}", "exec"), names)
    import matplotlib.pyplot as plt

    assert plt.get_fignums(), f"{path}: no figure was drawn"
    plt.close("all")
    print(f"{path}: {len(cells)} cells")
