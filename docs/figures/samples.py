#!/usr/bin/env python3
"""Draws the pictures of docs/splats.md, docs/fit.md and docs/python.md with `cagework render`, from built-in samples.

    python docs/figures/samples.py

Needs the command `cagework` on the PATH, NumPy and Pillow. Files are written to the folder `rigs-pictures`.
"""

import shutil
from pathlib import Path

import numpy as np
from rigs import WORK, draw, run, save

SPOT = Path(__file__).parents[2] / "web/public/samples/spot.splat"


def vertices(path):
    return np.array([line.split()[1:4] for line in (WORK / path).open() if line.startswith("v ")], float)


def write_moved(source, positions, target):
    """Copies an OBJ file with other positions; colours and faces stay."""
    rows = iter(positions)
    with (WORK / target).open("w") as out:
        for line in (WORK / source).open():
            if line.startswith("v "):
                line = " ".join(["v", *(f"{x:.6f}" for x in next(rows)), *line.split()[4:]]) + "\n"
            out.write(line)


def turned(positions, angles, axis):
    """Rotates points about an axis through the origin by an angle for each."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    cos, sin, result = np.cos(angles), np.sin(angles), positions.copy()
    result[:, i] = cos * positions[:, i] - sin * positions[:, j]
    result[:, j] = sin * positions[:, i] + cos * positions[:, j]
    return result


def splats():
    """Twists a capture from 0 radians at the bottom to 0.9 radians at the top."""
    shutil.copy(SPOT, WORK / "spot.splat")
    run("cage", "spot.splat", "-o", "spot-cage.obj")
    rest = vertices("spot-cage.obj")
    height = (rest[:, 1] - rest[:, 1].min()) / np.ptp(rest[:, 1])
    write_moved("spot-cage.obj", turned(rest, 0.9 * height, 1), "spot-pose.obj")
    run("deform", "spot.splat", "--cage", "spot-cage.obj", "--pose", "spot-pose.obj", "-o", "bent.ply")
    seen = {"size": "360x400", "view": "-35,10"}
    caged = {"cage": "spot-cage.obj", **seen}
    posed = draw("spot.splat", "--pose", "spot-pose.obj", **caged)
    save("splats", [draw("spot.splat", **caged), posed, draw("bent.ply", **seen)])


def fit():
    """Fits the cage to a rat that is bent by a formula: its length becomes an arc of 1.8 radians."""
    rest = vertices("out/rat.obj")
    along = int(np.argmax(np.ptp(rest, axis=0)))
    across = 2 - along
    middle, length = (rest.max(axis=0) + rest.min(axis=0)) / 2, np.ptp(rest[:, along])
    radius, angle = length / 1.8, 1.8 * (rest[:, along] - middle[along]) / length
    bent, distance = rest.copy(), radius + rest[:, across] - middle[across]
    bent[:, along] = middle[along] + distance * np.sin(angle)
    bent[:, across] = middle[across] + distance * np.cos(angle) - radius
    write_moved("out/rat.obj", bent, "target.obj")
    model = ("out/rat.obj", "--cage", "out/cage.obj", "--weights", "out/weights.npz")
    run("fit", *model, "--target", "target.obj", "-o", "fitted.obj")
    seen = {"size": "420x280", "view": "80,55"}
    fitted = draw("out/rat.obj", "--weights", "out/weights.npz", "--pose", "fitted.obj", cage="out/cage.obj", **seen)
    save("fit", [draw("out/rat.obj", cage="out/cage.obj", **seen), draw("target.obj", **seen), fitted])


def python():
    """Makes the rat 1.5 times as high."""
    run("cage", "out/rat.obj", "--vertices", 80, "-o", "cage-80.obj")
    write_moved("cage-80.obj", vertices("cage-80.obj") * [1, 1.5, 1], "cage-posed.obj")
    seen = {"size": "420x330", "view": "-50,12"}
    posed = draw("out/rat.obj", "--pose", "cage-posed.obj", cage="cage-80.obj", **seen)
    save("python", [draw("out/rat.obj", **seen), draw("out/rat.obj", cage="cage-80.obj", **seen), posed])


def main():
    WORK.mkdir(exist_ok=True)
    run("demo", "-o", "out")
    splats()
    fit()
    python()


if __name__ == "__main__":
    main()
