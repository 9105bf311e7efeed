"""The engine beside Open3D, embreex and trimesh, in one process and interleaved, on the same arrays, with one thread each.

``pip install open3d embreex trimesh rtree`` beside the wheel; those that are missing are left out. Arguments are models that trimesh
reads; without any, a sphere of a million triangles. Prints for each model the median time of seven rounds over that of this engine.
"""

import importlib.util
import os
import statistics
import sys
import time

# Before the libraries start their threads.
os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np

import bvhscope

ROUNDS = 7
RAYS = 256
POINTS = 10_000


def sphere(rows):
    """(n, 3) float32 vertices and (m, 3) uint32 faces of a closed sphere."""
    v, u = np.meshgrid(np.linspace(0, np.pi, rows + 1)[1:-1], np.linspace(0, 2 * np.pi, 2 * rows, endpoint=False), indexing="ij")
    ring = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], axis=-1).reshape(-1, 3)
    vertices = np.concatenate([ring, [[0, 1, 0], [0, -1, 0]]]).astype(np.float32)
    columns = 2 * rows
    row, column = np.meshgrid(np.arange(rows - 2), np.arange(columns), indexing="ij")
    a, b = row * columns + column, row * columns + (column + 1) % columns
    quads = np.stack([a, a + columns, b + columns, a, b + columns, b], axis=-1).reshape(-1, 3)
    turn = np.arange(columns)
    last = (rows - 2) * columns
    top = np.stack([np.full(columns, len(ring)), turn, (turn + 1) % columns], axis=-1)
    bottom = np.stack([np.full(columns, len(ring) + 1), last + (turn + 1) % columns, last + turn], axis=-1)
    return vertices, np.concatenate([quads, top, bottom]).astype(np.uint32)


def load(path):
    """Vertices and faces of a model."""
    import trimesh

    mesh = trimesh.load(path, force="mesh", process=False)
    return np.ascontiguousarray(mesh.vertices, dtype=np.float32), np.ascontiguousarray(mesh.faces, dtype=np.uint32)


def workloads(vertices, faces):
    """Origins and directions of primary and diffuse rays, and points around the mesh: (n, 3) float32 each."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    center, size = (low + high) / 2, np.linalg.norm(high - low)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, RAYS), np.linspace(0.5, -0.5, RAYS))
    origin = center + np.array([0.2, 0.3, 1.0], np.float32) * size
    directions = np.stack([x, y, np.full_like(x, -1)], axis=-1).reshape(-1, 3) * size + (center - origin + [0, 0, size])
    primary = np.broadcast_to(origin, directions.shape).astype(np.float32), directions.astype(np.float32)
    tree = bvhscope.build(vertices, faces)
    hits = tree.closest_hit(*primary)
    found = hits.triangle >= 0
    corners = vertices[faces[hits.triangle[found]]].astype(float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    normal *= -np.sign(np.einsum("ij,ij->i", normal, primary[1][found]))[:, None]
    around = np.random.default_rng(1).standard_normal(normal.shape)
    around = normal + around / np.linalg.norm(around, axis=1, keepdims=True)
    place = primary[0][found] + primary[1][found] * hits.t[found, None] + normal * size * 1e-5
    diffuse = place.astype(np.float32), around.astype(np.float32)
    points = np.random.default_rng(2).uniform(low, high, (POINTS, 3)).astype(np.float32)
    return primary, diffuse, points


def of_open3d(vertices, faces):
    """Its queries of RaycastingScene, on one thread."""
    import open3d

    tensors = open3d.core.Tensor(vertices), open3d.core.Tensor(faces)

    def build():
        scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(*tensors)
        # Built by the first query.
        scene.count_intersections(open3d.core.Tensor(np.array([[9e9, 9e9, 9e9, 1, 0, 0]], np.float32)))
        return scene

    scene = build()
    return {
        # Its arrays have origin and direction side by side: not timed.
        "prepare": lambda arrays: open3d.core.Tensor(np.concatenate(arrays, axis=1)),
        "build": build,
        "closest": lambda rays: int(np.isfinite(scene.cast_rays(rays, nthreads=1)["t_hit"].numpy()).sum()),
        "any": lambda rays: int(scene.test_occlusions(rays, nthreads=1).numpy().sum()),
        "point": lambda points: scene.compute_closest_points(points, nthreads=1)["points"].numpy(),
    }


def of_embreex(vertices, faces):
    """Its nearest hits; it has one thread."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    signed = faces.astype(np.int32)

    def build():
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, vertices, signed)
        # Built by the first query.
        scene.run(np.full((1, 3), 9e9, np.float32), np.array([[1, 0, 0]], np.float32))
        return scene

    scene = build()
    return {
        "build": build,
        "closest": lambda rays: int((scene.run(*rays) >= 0).sum()),
        "any": lambda rays: int((scene.run(*rays, query="OCCLUDED") >= 0).sum()),
    }


def of_trimesh(vertices, faces):
    """Its closest points, by rtree; it has one thread."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return {"point": lambda points: trimesh.proximity.closest_point(mesh, *points)[0]}


def of_this(vertices, faces):
    """This engine, with the preset Best, on one thread."""
    build = lambda: bvhscope.build(vertices, faces, preset="best", threads=1)
    tree = build()
    return {
        "build": build,
        "closest": lambda rays: int((tree.closest_hit(*rays, threads=1).triangle >= 0).sum()),
        "any": lambda rays: int(tree.any_hit(*rays, threads=1).sum()),
        "point": lambda points: tree.closest_point(*points, threads=1).point,
    }


ENGINES = {"bvhscope": of_this, "open3d": of_open3d, "embreex": of_embreex, "trimesh": of_trimesh}


def measure(name, vertices, faces):
    primary, diffuse, points = workloads(vertices, faces)
    engines = {
        engine: make(vertices, faces) for engine, make in ENGINES.items() if importlib.util.find_spec(engine) is not None
    }
    tasks = [
        ("build", "build", None),
        ("primary rays", "closest", primary),
        ("diffuse rays", "closest", diffuse),
        ("any hit of diffuse rays", "any", diffuse),
        ("closest points", "point", (points[: POINTS // 10] if "trimesh" in engines else points,)),
    ]
    print(f"{name}, {len(faces):,} triangles, one thread, times over those of bvhscope")
    for title, task, arrays in tasks:
        times, results = {}, {}
        asked = {engine: queries for engine, queries in engines.items() if task in queries}
        prepared = {engine: [queries.get("prepare", tuple)(arrays)] for engine, queries in asked.items() if arrays}
        for _ in range(ROUNDS + 1):
            for engine, queries in asked.items():
                start = time.perf_counter()
                results[engine] = queries[task](*prepared.get(engine, []))
                times.setdefault(engine, []).append(time.perf_counter() - start)
        # The first round warms up.
        medians = {engine: statistics.median(times[1:]) for engine, times in times.items()}
        own = medians["bvhscope"]
        cells = [f"{engine} {median / own:.2f}" for engine, median in medians.items() if engine != "bvhscope"]
        print(f"  {title}: {', '.join(cells)}; bvhscope {1e3 * own:.2f} ms")
        if task in ("closest", "any"):
            print("    hits: " + ", ".join(f"{engine} {count}" for engine, count in results.items()))
        if task == "point":
            distances = {engine: np.linalg.norm(found - arrays[0], axis=1) for engine, found in results.items()}
            worst = {engine: np.abs(found - distances["bvhscope"]).max() for engine, found in distances.items()}
            print("    largest difference of distances: " + ", ".join(f"{engine} {far:.1e}" for engine, far in worst.items()))


def lost_hits():
    """Rays from the middle of a closed sphere of a million triangles through its vertices and edges: none may get out."""
    vertices, faces = sphere(500)
    edges = vertices[faces].astype(float)
    targets = np.concatenate([vertices, ((edges[:, 0] + edges[:, 1]) / 2), ((edges[:, 1] + edges[:, 2]) / 2)]).astype(np.float32)
    rays = np.zeros_like(targets), targets
    print(f"closed sphere, {len(faces):,} triangles, {len(targets):,} rays through vertices and edges, that miss: ", end="")
    counts = []
    for engine, make in ENGINES.items():
        if engine != "trimesh" and importlib.util.find_spec(engine) is not None:
            queries = make(vertices, faces)
            found = queries["closest"](queries.get("prepare", tuple)(rays))
            counts.append(f"{engine} {len(targets) - found}")
    print(", ".join(counts))


def memory():
    """Bytes for each triangle by which the process grows with what each engine builds, where the system says."""
    vertices, faces = sphere(500)
    if not os.path.exists("/proc/self/statm"):
        return
    built, cells = [], []
    for engine, make in ENGINES.items():
        if engine != "trimesh" and importlib.util.find_spec(engine) is not None:
            build = make(vertices, faces)["build"]
            before = resident()
            built.append([build() for _ in range(3)])
            cells.append(f"{engine} {(resident() - before) / 3 / len(faces):.0f}")
    print("bytes for each triangle: " + ", ".join(cells))


def resident():
    """Bytes of this process in memory."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def overhead():
    """The time of a call with a single ray."""
    tree = bvhscope.build(*sphere(20))
    ray = np.zeros((1, 3), np.float32), np.array([[1, 0, 0]], np.float32)
    times = []
    for _ in range(2_000):
        start = time.perf_counter()
        tree.closest_hit(*ray, threads=1)
        times.append(time.perf_counter() - start)
    print(f"a call with one ray: {1e6 * statistics.median(times):.1f} µs")


overhead()
lost_hits()
memory()
for path in sys.argv[1:]:
    measure(os.path.basename(path), *load(path))
if not sys.argv[1:]:
    measure("sphere", *sphere(500))
