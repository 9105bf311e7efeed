"""One part of a sweep: a model with one setting, as a row. `sweep_dask.py` and `sweep_ray.py` spread the parts over machines."""

import itertools

import numpy as np

import bvhscope

MODELS = ["waves", "cloud"]
SETTINGS = [{"threshold": threshold, "epsilon": epsilon} for threshold, epsilon in itertools.product((4, 12, 20), (0.1, 0.2))]
PARTS = list(itertools.product(MODELS, SETTINGS))


def triangles(model):
    """(m, 3, 3) float32: put the loading of your own models here."""
    if model == "cloud":
        random = np.random.default_rng(1)
        return (random.random((20_000, 1, 3)) + 0.02 * random.standard_normal((20_000, 3, 3))).astype(np.float32)
    x, z = np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 1, 101))
    grid = np.stack([x, 0.1 * np.sin(20 * x) * np.cos(13 * z), z], axis=-1).astype(np.float32)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 3)


def measure(model, settings):
    """Build a tree on one thread, and count the tests of rays through it. No result but the times depends on the machine."""
    tree = bvhscope.build(triangles(model), threads=1, **settings)
    low, high = tree.triangles.min(axis=(0, 1)), tree.triangles.max(axis=(0, 1))
    random = np.random.default_rng(1)
    from_points, to_points = (random.uniform(low, high, (10_000, 3)).astype(np.float32) for _ in range(2))
    counts = tree.tests(from_points, to_points - from_points, threads=1)
    stats = tree.stats()
    return {
        "model": model,
        **settings,
        "build_ms": stats["build_ms"],
        "sah_cost": stats["sah_cost"],
        "tests_per_ray": float((counts.containers + counts.triangles).mean()),
    }


def show(rows):
    """Print rows as a table with tabs, for any spreadsheet; ``pandas.DataFrame(rows)`` takes them as they are."""
    print("\t".join(rows[0]))
    for row in rows:
        print("\t".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()))


if __name__ == "__main__":
    show([measure(*part) for part in PARTS])
