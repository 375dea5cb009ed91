#!/usr/bin/env python3
"""Compares Cagework with libigl on public models: weights with `harmonic` and `bbw`, cages with the lazy cage.

    pip install libigl gpytoolbox numpy scipy
    python docs/figures/libigl.py

Needs the command `cagework` on the PATH or in the variable CAGEWORK, and Linux. Everything runs on one core, for a
quarter of an hour or so. Models are downloaded to the folder `libigl-data`, unless they are there. The tables are written to
docs/evaluation/libigl.md.
"""

import hashlib
import json
import multiprocessing
import os
import platform
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from urllib.request import urlretrieve

os.environ.update(OMP_NUM_THREADS="1", IGL_NUM_THREADS="1", RAYON_NUM_THREADS="1")
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import gpytoolbox.copyleft
import igl
import igl.copyleft.cgal as cgal
import numpy as np
import scipy.sparse
from igl.copyleft.tetgen import tetrahedralize

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/evaluation/libigl.md"
WORK = Path("libigl-data").absolute()
CAGEWORK = shutil.which(os.environ.get("CAGEWORK", "cagework"))
SOURCE = "https://raw.githubusercontent.com/alecjacobson/common-3d-test-models/8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/"
MODELS = {  # The first digits of the SHA-256 of each file.
    "spot": "0738b5e8608fed74",
    "homer": "b20b1391fd62964f",
    "cheburashka": "b2ac59bc1112f1b3",
    "rocker-arm": "590257e6d01e6893",
}
REPEATS = 3
GRIDS = (64, 128, 256)
TETRAHEDRA = (10_000, 50_000, 200_000)  # The cage's volume by the largest volume that TetGen may give a tetrahedron.
BBW = ((1_000, 100), (10_000, 8), (50_000, 8))  # The same, and the largest number of iterations: 100 by default, 8 in the tutorial.
BBW_LIMIT = 300  # Seconds.
CAGE_VERTICES = 80


def alone(function, *args, limit=None):
    """Runs a function in a process of its own. None if it takes more than `limit` seconds."""
    with multiprocessing.Pool(1) as pool:
        try:
            return pool.apply_async(function, args).get(limit)
        except multiprocessing.TimeoutError:
            return None


def memory():
    """Peak memory of this process in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def run(*args):
    done = subprocess.run([CAGEWORK, *map(str, args), "-q", "--json"], cwd=WORK, check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def read_obj(path):
    """Positions, and faces cut into triangles."""
    lines = [line.split() for line in path.read_text().splitlines()]
    positions = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    faces = [[int(x.split("/")[0]) - 1 for x in line[1:]] for line in lines if line[:1] == ["f"]]
    triangles = [[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)]
    return positions, np.array(triangles, np.int64)


def write_obj(path, positions, triangles):
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in positions]
    lines += ["f {} {} {}".format(*(t + 1)) for t in triangles]
    path.write_text("\n".join(lines) + "\n")


def diagonal(positions):
    return np.linalg.norm(np.ptp(positions, axis=0))


def download():
    WORK.mkdir(exist_ok=True)
    for name, digest in MODELS.items():
        path = WORK / f"{name}.obj"
        if not path.exists():
            urlretrieve(SOURCE + path.name, path)
        if not hashlib.sha256(path.read_bytes()).hexdigest().startswith(digest):
            sys.exit(f"{path} is not the expected file")
        write_obj(WORK / f"{name}-model.obj", *read_obj(path))


# Weights. Each bind returns a dictionary with the weights at the points, and times in seconds.


def cagework(name, grid):
    weights = WORK / "weights.npz"
    report = run("bind", f"{name}-model.obj", "--cage", f"{name}-cage.obj", "-g", grid, "--threads", 1, "--weights", weights)
    times = report["timings_ms"]
    return {
        "weights": scipy.sparse.load_npz(weights).toarray(),
        "unknowns": report["cells"]["interior"],
        "seconds": [times[stage] / 1000 for stage in ("voxelize", "solve", "sample")],
        "memory": report["memory_bytes"]["peak"] / 2**20,
    }


def hats(points, cage, triangles):
    """The boundary values: linear on each triangle of the cage, 1 at one vertex and 0 at the others."""
    _, nearest, feet = igl.point_mesh_squared_distance(points, cage, triangles)
    corners = triangles[nearest]
    parts = igl.barycentric_coordinates(feet, *(np.ascontiguousarray(cage[corners[:, k]]) for k in range(3)))
    values = np.zeros((len(points), len(cage)))
    np.put_along_axis(values, corners, parts, axis=1)
    return values


def interpolate(values, vertices, tetrahedra, points):
    """Values at points, linear in each tetrahedron."""
    tree = igl.AABB()
    tree.init(vertices, tetrahedra)
    inside = igl.in_element(vertices, tetrahedra, points, tree)
    assert (inside >= 0).all(), "a point is outside the mesh"
    corners = tetrahedra[inside]
    first = vertices[corners[:, 0]]
    edges = np.stack([vertices[corners[:, k]] - first for k in (1, 2, 3)], axis=2)
    parts = np.linalg.solve(edges, (points - first)[:, :, None])[:, :, 0]
    parts = np.column_stack([1 - parts.sum(axis=1), parts])
    return sum(parts[:, k, None] * values[corners[:, k]] for k in range(4))


def libigl(name, n, bbw_iterations=None):
    """`harmonic`, or `bbw` with the vertices of the cage as handles."""
    points, _ = read_obj(WORK / f"{name}-model.obj")
    cage, triangles = read_obj(WORK / f"{name}-cage.obj")
    before = memory()
    times = [time.perf_counter()]
    largest = igl.moments(cage, triangles)[0] / n
    vertices, tetrahedra = tetrahedralize(cage, triangles, flags=f"pq1.2a{largest:.9g}Q")[:2]
    times.append(time.perf_counter())
    if bbw_iterations:
        n_fixed = len(cage)
        values = igl.bbw(vertices, tetrahedra, np.arange(n_fixed), np.eye(n_fixed), max_iter=bbw_iterations)
    else:
        fixed = np.unique(igl.boundary_facets(tetrahedra)[0])
        n_fixed = len(fixed)
        values = igl.harmonic(vertices, tetrahedra, fixed, hats(vertices[fixed], cage, triangles), 1)
    times.append(time.perf_counter())
    weights = interpolate(values, vertices, tetrahedra, points)
    times.append(time.perf_counter())
    return {
        "weights": weights,
        "unknowns": len(vertices) - n_fixed,
        "seconds": list(np.diff(times)),
        "memory": memory() - before,
        "vertices": len(vertices),
    }


def repeated(function, *args):
    """The last of several binds, with the median of each time."""
    binds = [alone(function, *args) for _ in range(REPEATS)]
    return binds[-1] | {"seconds": [statistics.median(x) for x in zip(*(b["seconds"] for b in binds), strict=True)]}


def rest_error(name, weights):
    points, _ = read_obj(WORK / f"{name}-model.obj")
    cage, _ = read_obj(WORK / f"{name}-cage.obj")
    return np.linalg.norm(weights @ cage - points, axis=1) / diagonal(cage)


def power(x, digits=0):
    """A number such as 6.5e-5."""
    return f"{x:.{digits}e}".replace("e-0", "e-") if x else "0"


def table(header, rows):
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in (header, *rows)]
    return "\n".join([lines[0], "|---" * len(header) + "|", *lines[1:]])


def stages(bind):
    return [f"{x:.2g}" if x < 10 else f"{x:.0f}" for x in bind["seconds"]]


def common(name, bind):
    return [
        f"{bind['unknowns']:,}", *stages(bind), f"{bind['memory']:.0f}",
        power(bind['weights'].min()), power(rest_error(name, bind['weights']).max()),
    ]


COMMON = ["unknowns", "prepare, s", "solve, s", "evaluate, s", "memory, MiB", "smallest weight", "rest pose"]


def armadillo():
    data = ROOT / "tests/data/armadillo"
    points = np.load(data / "points.npy")
    write_obj(WORK / "armadillo-model.obj", points, np.arange(len(points)).reshape(-1, 3))
    write_obj(WORK / "armadillo-cage.obj", np.load(data / "cage_positions.npy"), np.load(data / "cage_triangles.npy"))
    reference = np.load(data / "weights_fem.npy")
    binds = [(f"Cagework, g = {g}", repeated(cagework, "armadillo", g)) for g in GRIDS]
    binds += [(f"`harmonic`, {n // 1000}k", repeated(libigl, "armadillo", n)) for n in TETRAHEDRA]
    rows = []
    for label, bind in binds:
        error = np.abs(bind["weights"] - reference)
        rows.append([label, *common("armadillo", bind), power(error.mean(), 1), power(error.max(), 1)])
    return table(["Armadillo", *COMMON, "mean error", "largest error"], rows)


def other_models():
    rows = []
    for name in MODELS:
        run("cage", f"{name}-model.obj", "--vertices", CAGE_VERTICES, "--triangles", "-o", f"{name}-cage.obj")
        fine = [alone(cagework, name, GRIDS[2]), alone(libigl, name, TETRAHEDRA[2])]
        binds = {
            f"{name}: Cagework, g = {GRIDS[0]}": repeated(cagework, name, GRIDS[0]),
            f"{name}: `harmonic`, {TETRAHEDRA[1] // 1000}k": repeated(libigl, name, TETRAHEDRA[1]),
        }
        for label, bind in binds.items():
            differences = [power(np.abs(bind['weights'] - f['weights']).mean(), 1) for f in fine]
            rows.append([label, *common(name, bind), *differences])
    fine = [f"Cagework, g = {GRIDS[2]}", f"`harmonic`, {TETRAHEDRA[2] // 1000}k"]
    return table(["model", *COMMON, *(f"difference from {x}" for x in fine)], rows)


def bounded_biharmonic():
    def row(label, bind):
        sums = bind["weights"].sum(axis=1, keepdims=True)
        weights = bind["weights"] / sums
        error = rest_error("armadillo", weights)
        return [
            label, f"{sum(bind['seconds']):.2g}", power(bind['weights'].min()), power(np.abs(sums - 1).max()),
            f"{(weights > 0.01).sum(axis=1).mean():.1f}", power(error.mean()), power(error.max()),
        ]

    rows = [row(f"Cagework, g = {GRIDS[0]}", alone(cagework, "armadillo", GRIDS[0]))]
    for n, iterations in BBW:
        bind = alone(libigl, "armadillo", n, iterations, limit=BBW_LIMIT)
        if bind:
            rows.append(row(f"`bbw`, {bind['vertices']:,} vertices, at most {iterations} iterations", bind))
        else:
            rows.append([f"`bbw`, {n // 1000}k, at most {iterations} iterations", f"stopped after {BBW_LIMIT}", *[""] * 5])
    header = ["Armadillo", "seconds", "smallest weight", "sum - 1", "weights above 1 %", "rest pose, mean", "rest pose, largest"]
    return table(header, rows)


# Cages. Each function returns positions, triangles and seconds.


def own_cage(name):
    report = run("cage", f"{name}-model.obj", "--vertices", CAGE_VERTICES, "-o", "cage.obj")
    return *read_obj(WORK / "cage.obj"), report["report"]["elapsed_ms"] / 1000


def published_lazy_cage(name, n_triangles):
    positions, triangles = read_obj(WORK / f"{name}-model.obj")
    start = time.perf_counter()
    cage, faces = gpytoolbox.copyleft.lazy_cage(positions, triangles, num_faces=n_triangles)
    return np.ascontiguousarray(cage), np.ascontiguousarray(faces, np.int64), time.perf_counter() - start


def lazy_cage(name, n_triangles):
    """Finds the smallest offset whose decimated surface encloses the model, as libigl's lazy_cage does in C++."""
    positions, triangles = read_obj(WORK / f"{name}-model.obj")
    start = time.perf_counter()
    low, high, best = 0, 0.1 * diagonal(positions), None
    for step in range(13):
        offset = (low + high) / 2 if step else high
        fine, faces = igl.offset_surface(positions, triangles, offset, 50, igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER)[:2]
        fine, faces = np.asfortranarray(fine), np.asfortranarray(faces, np.int32)
        cage, faces = map(np.ascontiguousarray, igl.decimate(fine, faces, n_triangles, block_intersections=True)[:2])
        met = cgal.intersect_other(positions, triangles, cage, faces, detect_only=True, first_only=True)[1]
        if len(faces) <= n_triangles and not len(met) and (igl.winding_number(cage, faces, positions) > 0.5).all():
            high, best = offset, (cage, faces)
        else:
            low = offset
    return (*best, time.perf_counter() - start) if best else None


def cages():
    rows = []
    for name in MODELS:
        positions, triangles = read_obj(WORK / f"{name}-model.obj")
        ours = own_cage(name)
        n_triangles = len(ours[1])
        made = {
            "Cagework": ours,
            "gpytoolbox": alone(published_lazy_cage, name, n_triangles),
            "libigl": alone(lazy_cage, name, n_triangles),
        }
        for label, result in made.items():
            if result is None:
                rows.append([f"{name}: {label}", "none found", *[""] * 6])
                continue
            cage, faces, seconds = result
            inside = (igl.winding_number(cage, faces, positions) > 0.5).mean()
            crossings = cgal.intersect_other(positions, triangles, cage, faces, detect_only=True)[1]
            own = cgal.remesh_self_intersections(cage, faces, detect_only=True)[2]
            gap = np.sqrt(igl.point_mesh_squared_distance(positions, cage, faces)[0]).mean() / diagonal(positions)
            volume = igl.moments(cage, faces)[0] / igl.moments(positions, triangles)[0]
            rows.append([
                f"{name}: {label}", len(cage), f"{100 * inside:.4g} %", len(crossings), len(own),
                f"{volume:.2f}", f"{100 * gap:.1f} %", f"{seconds:.1f}",
            ])
    header = ["cage", "vertices", "model inside", "crossings with the model", "with itself", "volume", "mean distance", "seconds"]
    return table(header, rows)


def conditions():
    packages = ", ".join(f"{name} {version(name)}" for name in ("libigl", "gpytoolbox", "numpy"))
    command = subprocess.run([CAGEWORK, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    processor = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    load = os.getloadavg()[0]
    machine = processor[1] if processor else platform.machine()
    return f"This run: {command}; {packages}; one core of {machine}, load average {load:.1f} at the start."


def main():
    texts = {"conditions": conditions()}
    download()
    for part in (armadillo, other_models, bounded_biharmonic, cages):
        texts[part.__name__] = part()
        print(f"{texts[part.__name__]}\n", flush=True)
    page = PAGE.read_text()
    for name, text in texts.items():
        pattern = rf"(<!-- {name}: written by docs/figures/libigl.py -->\n).*?(<!-- end -->)"
        page = re.sub(pattern, lambda match, text=text: f"{match[1]}\n{text}\n\n{match[2]}", page, flags=re.DOTALL)
    PAGE.write_text(page)


if __name__ == "__main__":
    main()
