#!/usr/bin/env python3
"""Draws the pictures of docs/rigs.md with `cagework render`, from the built-in humanoid and clothes that are made here.

    cargo run --release -p cagework-benches --example walk -- sample humanoid.glb
    python docs/figures/rigs.py humanoid.glb

Needs the command `cagework` on the PATH, NumPy and Pillow. Files are written to the folder `rigs-pictures`.
"""

import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

WORK = Path("rigs-pictures")
PICTURES = Path(__file__).parents[1] / "pictures"
SHIRT, SHORTS, VEST, SKIRT = (0.85, 0.45, 0.1), (0.75, 0.68, 0.5), (0.25, 0.45, 0.25), (0.5, 0.15, 0.3)
LEATHER, METAL = (0.3, 0.17, 0.08), (0.85, 0.7, 0.3)
N_SECTORS = 96


def run(*args):
    subprocess.run(["cagework", *map(str, args)], cwd=WORK, check=True, stdout=subprocess.DEVNULL)


def read_glb(path):
    """Positions, colours and triangles of the first primitive."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, start = json.loads(data[20 : 20 + length]), 28 + length
    primitive = document["meshes"][0]["primitives"][0]
    types = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
    widths = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}

    def array(index):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        offset = start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        dtype, width = np.dtype(types[accessor["componentType"]]), widths[accessor["type"]]
        stride = view.get("byteStride", dtype.itemsize * width)
        raw = np.ndarray((accessor["count"], width), dtype, data, offset, (stride, dtype.itemsize))
        return raw.astype(float) / (np.iinfo(dtype).max if accessor.get("normalized") else 1)

    attributes = primitive["attributes"]
    colours = array(attributes["COLOR_0"])[:, :3] ** (1 / 2.2)
    return array(attributes["POSITION"]), colours, array(primitive["indices"]).astype(int).reshape(-1, 3)


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    rows = np.array([[float(x) for x in line[1:7]] for line in lines if line[:1] == ["v"]])
    faces = [[int(x.split("/")[0]) - 1 for x in line[1:]] for line in lines if line[:1] == ["f"]]
    return rows[:, :3], rows[:, 3:], faces


def write_obj(path, parts):
    """parts: (group, positions, colours, faces)."""
    lines, first = [], 1
    for group, positions, colours, faces in parts:
        lines += [f"v {p[0]:.6f} {p[1]:.6f} {p[2]:.6f} {c[0]:.3f} {c[1]:.3f} {c[2]:.3f}" for p, c in zip(positions, colours)]
        lines += [f"g {group}"] + ["f " + " ".join(str(first + v) for v in face) for face in faces]
        first += len(positions)
    path.write_text("\n".join(lines) + "\n")


def painted(group, positions, colour, faces):
    return group, positions, np.tile(colour, (len(positions), 1)), faces


def tube(rings):
    """A closed surface through elliptic rings (height, semi-axes along x and z, centre along z)."""
    angles = np.linspace(0, 2 * np.pi, N_SECTORS, endpoint=False)
    positions = [[a * np.sin(t), y, z + b * np.cos(t)] for y, a, b, z in rings for t in angles]
    n, faces = len(rings), []
    for k in range(n):
        for i in range(N_SECTORS):
            j, low, high = (i + 1) % N_SECTORS, k * N_SECTORS, (k + 1) % n * N_SECTORS
            faces.append([low + i, low + j, high + j, high + i])
    return np.array(positions), faces


def shell(body, inside, distance):
    """The faces of the body whose corners are all inside, moved along the normals."""
    positions, _, triangles = body
    corners = positions[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(positions)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], across)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    kept = triangles[inside[triangles].all(axis=1)]
    used, faces = np.unique(kept, return_inverse=True)
    return positions[used] + distance * normals[used], faces.reshape(-1, 3)


def ellipse(body, y, margin):
    """Semi-axes and centre of the trunk at a height, enlarged by a margin."""
    positions = body[0]
    ring = positions[(abs(positions[:, 1] - y) < 0.015) & (abs(positions[:, 0]) < 0.3)]
    low, high = ring.min(axis=0), ring.max(axis=0)
    return y, high[0] + margin, (high[2] - low[2]) / 2 + margin, (high[2] + low[2]) / 2


def clothes(body):
    x, y = abs(body[0][:, 0]), body[0][:, 1]
    waist = 1.07
    outer = [ellipse(body, h, m) for h, m in ((waist, 0.03), (1.0, 0.035), (0.92, 0.05))]
    hem = (0.52, 0.36, 0.28, 0.02)
    skirt = outer + [hem]
    inner = [(h, a - 0.008, b - 0.008, c) for h, a, b, c in reversed(skirt)]
    _, a, b, c = ellipse(body, waist, 0.034)
    belt = [(waist - 0.03, a, b, c), (waist - 0.03, a + 0.012, b + 0.012, c), (waist + 0.03, a + 0.012, b + 0.012, c), (waist + 0.03, a, b, c)]
    front = c + b + 0.014
    # The buckle is a square frame with round corners, standing upright before the belt.
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    frame, faces = [], []
    for t in angles:
        out = np.array([np.sign(np.cos(t)) * abs(np.cos(t)) ** 0.3, np.sign(np.sin(t)) * abs(np.sin(t)) ** 0.3])
        for size, depth in ((0.055, 0), (0.055, 0.02), (0.038, 0.02), (0.038, 0)):
            frame.append([out[0] * size, waist + out[1] * size, front + depth])
    for i in range(48):
        j = (i + 1) % 48
        faces += [[4 * i + k, 4 * j + k, 4 * j + (k + 1) % 4, 4 * i + (k + 1) % 4] for k in range(4)]
    garments = {
        "shirt": [painted("shirt", *paint(shell(body, (y > 0.98) & (y < 1.57) & (x < 0.52), 0.018), SHIRT))],
        "shorts": [painted("shorts", *paint(shell(body, (y > 0.5) & (y < 1.03) & (x < 0.3), 0.014), SHORTS))],
        "vest": [painted("vest", *paint(shell(body, (y > 0.98) & (y < 1.45) & (x < 0.25), 0.022), VEST))],
        "skirt": [painted("skirt", *paint(tube(skirt + inner), SKIRT))],
        "belt": [painted("belt", *paint(tube(belt), LEATHER)), painted("buckle", np.array(frame), METAL, faces)],
    }
    (WORK / "clothes").mkdir(exist_ok=True)
    for name, parts in garments.items():
        write_obj(WORK / f"clothes/{name}.obj", parts)


def paint(mesh, colour):
    return mesh[0], colour, mesh[1]


def dressed(name, body, folder, garments):
    """Writes one model of a body and its clothes."""
    parts = [("body", *body)]
    parts += [(one, *read_obj(WORK / folder / f"{one}.obj")) for one in garments]
    write_obj(WORK / f"{name}.obj", parts)


def draw(model, *options, cage=None, size="440x720", view="20,8"):
    options += ("--cage", cage) if cage else ("--no-cage",)
    run("render", model, "-o", "picture.png", "--theme", "light", "--size", size, "--view", view, *options)
    return Image.open(WORK / "picture.png").convert("RGB")


def cut(picture, left, top, right, bottom):
    """The part of a picture between fractions of its width and height."""
    w, h = picture.size
    return picture.crop((int(left * w), int(top * h), int(right * w), int(bottom * h)))


def row(pictures, gap=16):
    height = max(p.height for p in pictures)
    canvas = Image.new("RGB", (sum(p.width for p in pictures) + gap * (len(pictures) - 1), height), "white")
    x = 0
    for picture in pictures:
        canvas.paste(picture, (x, height - picture.height))
        x += picture.width + gap
    return canvas


def save(name, pictures):
    row(pictures).save(PICTURES / f"{name}.webp", quality=80, method=6)


def main():
    WORK.mkdir(exist_ok=True)
    (WORK / "humanoid.glb").write_bytes(Path(sys.argv[1]).read_bytes())
    run("proportions", "humanoid.glb", "--leg", 1.3, "--feet", "lock", "-o", "tall.glb")
    times = ("--clip", "Walk", "--at", "0,0.25,0.5")
    walks = [draw(model, *times, size="260x480", view="65,5") for model in ("humanoid.glb", "tall.glb")]
    save("walk", walks)

    body = read_glb(WORK / "humanoid.glb")
    clothes(body)
    run("cage", "humanoid.glb", "clothes", "-o", "cage.obj")
    broad = ("--limb", 1.25, "--waist", 1.4, "--hip", 1.2, "--shoulder", 1.15)
    run("proportions", "humanoid.glb", "--cage", "cage.obj", *broad, "--pose-out", "broad.obj", "-o", "broad.glb")
    run("refit", "humanoid.glb", "clothes", "--skeleton", "humanoid.glb", "--cage", "cage.obj", "--pose", "broad.obj", "-o", "out")
    after = read_glb(WORK / "out/humanoid.glb")
    for name, shape, folder in (("before", body, "clothes"), ("after", after, "out")):
        dressed(f"{name}-1", shape, folder, ["shirt", "shorts"])
        dressed(f"{name}-2", shape, folder, ["vest", "skirt", "belt"])
    seen = (0, 0.15, 1, 0.85)
    save("clothes", [cut(draw(f"{name}-1.obj"), *seen) for name in ("before", "after")])
    save("outfits", [cut(draw(f"after-{k}.obj"), *seen) for k in (1, 2)])

    # The pose shears the cage: y grows with x.
    lines = [line.split() for line in (WORK / "cage.obj").read_text().splitlines()]
    sheared = [f"v {x[1]} {float(x[2]) + 0.8 * float(x[1])} {x[3]}" if x[:1] == ["v"] else " ".join(x) for x in lines]
    (WORK / "sheared.obj").write_text("\n".join(sheared) + "\n")
    run("bind", "clothes/belt.obj", "--cage", "cage.obj", "--weights", "belt.npz")
    deform = ("deform", "clothes/belt.obj", "--cage", "cage.obj", "--weights", "belt.npz", "--pose", "sheared.obj", "-o")
    run(*deform, "bent.obj")
    run(*deform, "rigid.obj", "--rigid", "buckle")
    belts = ("clothes/belt.obj", "bent.obj", "rigid.obj")
    save("buckle", [draw(belt, "--no-floor", size="380x280", view="0,10") for belt in belts])


if __name__ == "__main__":
    main()
