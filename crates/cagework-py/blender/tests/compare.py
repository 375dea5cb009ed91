"""Prints the tables of docs/blender.md: Cagework beside Blender's Mesh Deform, on the reference of tests/data/armadillo
and, for the time of a frame and of a mouse move, on a sphere of 36,182 vertices.

Run by hand, in the environment of `cargo xtask blender`: python compare.py [PRECISION ...]
"""

import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from conftest import EXTENSION, Modal, ball, local, select, world

DATA = Path(__file__).parents[4] / "tests/data/armadillo"
RUNS = 3
# Frames of the animation, and mouse moves of the drag.
STEPS = 60


def mesh_object(name, vertices, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def weights(model, cage):
    """The weights that a modifier or the extension uses, measured by moving each cage vertex by one unit along x."""
    rest, rows = local(cage.data), []
    before = world(model)
    for k in range(len(rest)):
        moved = rest.copy()
        moved[k, 0] += 1
        cage.data.vertices.foreach_set("co", moved.astype(np.float32).ravel())
        cage.data.update()
        rows.append((world(model) - before)[:, 0])
    cage.data.vertices.foreach_set("co", rest.astype(np.float32).ravel())
    cage.data.update()
    return np.array(rows).T


def peak():
    """Peak memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def row(name, grid, bind, expected):
    """Prints the median of the bind times, the memory that the first bind adds, and the error of the last one."""
    walls, processor, peaks = [], [], []
    for _ in range(RUNS):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        model = mesh_object("Model", np.load(DATA / "points.npy"), np.zeros((0, 3), int))
        cage = mesh_object("Cage", np.load(DATA / "cage_positions.npy"), np.load(DATA / "cage_triangles.npy"))
        select(model)
        peaks.append(peak())
        wall_start, processor_start = time.perf_counter(), time.process_time()
        bind(model, cage)
        walls.append(time.perf_counter() - wall_start)
        processor.append(time.process_time() - processor_start)
        peaks.append(peak())
    error = np.abs(weights(model, cage) - expected).mean()
    times = f"{np.median(walls):.3f} s | {np.median(processor):.3f} s"
    print(f"| {name} | {grid} | {times} | {peaks[1] - peaks[0]:.0f} MB | {error:.1e} |", flush=True)


def with_mesh_deform(precision):
    def bind(model, cage):
        modifier = model.modifiers.new("Deform", "MESH_DEFORM")
        modifier.object, modifier.precision = cage, precision
        bpy.ops.object.meshdeform_bind(modifier=modifier.name)
        assert modifier.is_bound

    return bind


def with_cagework(grid):
    def bind(model, cage):
        model.data.cagework.cage, model.data.cagework.grid = cage, grid
        assert bpy.ops.cagework.bind() == {"FINISHED"}

    return bind


def caged_sphere():
    """A sphere of 36,182 vertices and its cage, in a new file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    model = ball("Model", segments=270)
    select(model)
    bpy.ops.cagework.make_cage(vertices=80)
    return model, model.data.cagework.cage


def frame_time(bind):
    """Median time of a frame in which the cage moves, ms."""
    model, cage = caged_sphere()
    bind(model, cage)
    for frame, x in [(1, 0.0), (STEPS, 1.0)]:
        cage.location.x, cage.scale.z = x, 1 + x
        for path in ["location", "scale"]:
            cage.keyframe_insert(path, frame=frame)
    return median_time(bpy.context.scene.frame_set)


def median_time(step):
    """Median time of a function for the numbers 1 to STEPS, ms."""
    times = []
    for k in range(1, STEPS + 1):
        start = time.perf_counter()
        step(k)
        times.append(1000 * (time.perf_counter() - start))
    return np.median(times)


def move_time():
    """Median time of a mouse move while a point is pulled, ms; with the update of the mesh."""
    model, cage = caged_sphere()
    with_cagework(64)(model, cage)
    modal = Modal(EXTENSION.operators.Pull)
    modal.invoke()
    middle = np.array([modal.region.width, modal.region.height]) / 2
    modal.send("LEFTMOUSE", "PRESS", middle)

    def step(k):
        assert modal.send("MOUSEMOVE", at=middle + k) == {"RUNNING_MODAL"}
        bpy.context.view_layer.update()

    return median_time(step)


if __name__ == "__main__":
    reference = np.load(DATA / "weights_fem.npy")
    print(EXTENSION.__name__, bpy.app.version_string)
    for precision in map(int, sys.argv[1:] or ["5", "6"]):
        cells = 2**precision + 2
        # Measure the extension first, because the peak memory of a process only grows.
        row("Cagework", cells, with_cagework(cells), reference)
        row("Mesh Deform", cells, with_mesh_deform(precision), reference)
    mesh_deform, cagework = frame_time(with_mesh_deform(5)), frame_time(with_cagework(64))
    print(f"a frame: Mesh Deform {mesh_deform:.1f} ms, Cagework {cagework:.1f} ms; a mouse move: {move_time():.1f} ms")
    EXTENSION.unregister()  # Otherwise Blender does not exit.
