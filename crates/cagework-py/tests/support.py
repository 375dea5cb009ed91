"""Generated models, and the `cagework` command, whose results those of the package must equal."""

import json
import os
import struct
import subprocess

import numpy as np
import trimesh

import cagework as cw

COMMAND = os.environ["CAGEWORK_COMMAND"]


def command(folder, line):
    """Runs the `cagework` command in a folder and returns its stdout."""
    done = subprocess.run([COMMAND, *line.split()], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def capsule():
    """A capsule of length 2 along z."""
    return trimesh.creation.capsule(height=1.4, radius=0.3, count=[16, 16])


def box(divisions=1):
    """Vertices and quads of the cube from -1 to 1, subdivided divisions - 1 times."""
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    for _ in range(1, divisions):
        # Split each quad into four, and merge equal positions.
        corners = vertices[faces]
        edges = (corners + np.roll(corners, -1, axis=1)) / 2
        middle = corners.mean(axis=1)
        quads = [
            np.stack([corners[:, k], edges[:, k], middle, edges[:, k - 1]], axis=1) for k in range(4)
        ]
        split = np.concatenate(quads)
        vertices, number = np.unique(split.reshape(-1, 3), axis=0, return_inverse=True)
        faces = number.reshape(-1, 4)
    return vertices, faces


def bent(cage):
    """A pose of the cage: x grows with the square of z above the middle."""
    posed = cage.vertices.copy()
    posed[:, 0] += 0.4 * np.maximum(posed[:, 2], 0.0) ** 2
    return posed


def pack(arrays):
    """Buffer, buffer views and accessors of named arrays: (array, type of a glTF accessor)."""
    of_dtype = {"float32": 5126, "uint32": 5125, "uint8": 5121}
    data, views, accessors = b"", [], []
    for array, kind in arrays.values():
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessor = {"bufferView": len(accessors), "componentType": of_dtype[array.dtype.name], "type": kind}
        accessor["count"] = len(array)
        if kind in ("VEC3", "SCALAR") and array.dtype.name == "float32":
            accessor["min"], accessor["max"] = np.atleast_1d(array.min(0)).tolist(), np.atleast_1d(array.max(0)).tolist()
        accessors.append(accessor)
        data += array.tobytes()
        data += bytes(-len(data) % 4)
    return data, views, accessors


def glb(document, data):
    """Bytes of a GLB."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def rigged_glb(radius=0.3):
    """A capsule with two joints, a morph target, and a clip that rotates the second joint."""
    mesh = trimesh.creation.capsule(height=1.4, radius=radius, count=[12, 12])
    positions = mesh.vertices.astype("<f4")
    joints = np.zeros((len(positions), 4), dtype="u1")
    joints[:, 1] = 1
    weights = np.zeros((len(positions), 4), dtype="<f4")
    weights[:, 1] = np.clip(positions[:, 2] + 0.5, 0, 1)
    weights[:, 0] = 1 - weights[:, 1]
    bind = np.stack([np.eye(4, dtype="<f4")] * 2)
    bind[1, 3, 2] = -0.5  # The inverse bind matrix of the second joint, column-major.
    half = np.sqrt(0.5)
    arrays = {
        "positions": (positions, "VEC3"),
        "indices": (mesh.faces.astype("<u4").reshape(-1), "SCALAR"),
        "joints": (joints, "VEC4"),
        "weights": (weights, "VEC4"),
        "target": ((positions * [0.2, 0.2, 0.0]).astype("<f4"), "VEC3"),
        "bind": (bind.reshape(2, 16), "MAT4"),
        "times": (np.array([0, 1], dtype="<f4"), "SCALAR"),
        "turns": (np.array([[0, 0, 0, 1], [half, 0, 0, half]], dtype="<f4"), "VEC4"),
    }
    data, views, accessors = pack(arrays)
    at = {name: k for k, name in enumerate(arrays)}
    attributes = {"POSITION": at["positions"], "JOINTS_0": at["joints"], "WEIGHTS_0": at["weights"]}
    primitive = {"attributes": attributes, "material": 0, "indices": at["indices"], "targets": [{"POSITION": at["target"]}]}
    clip = {
        "name": "bend",
        "samplers": [{"input": at["times"], "output": at["turns"]}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
    }
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {"name": "arm", "translation": [0, 0, 0.5]}],
        "materials": [{"name": "skin"}],
        "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": at["bind"]}],
        "animations": [clip],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return glb(document, data)


# Joints of a figure: name, parent, place. Those with `{}` exist on the left and mirrored on the right.
FIGURE = [
    ("hips", None, [0, 1, 0]),
    ("spine", "hips", [0, 1.2, 0]),
    ("head", "spine", [0, 1.6, 0]),
    ("upperarm.{}", "spine", [0.25, 1.45, 0]),
    ("forearm.{}", "upperarm.{}", [0.55, 1.45, 0]),
    ("hand.{}", "forearm.{}", [0.85, 1.45, 0]),
    ("thigh.{}", "hips", [0.12, 0.95, 0]),
    ("shin.{}", "thigh.{}", [0.12, 0.5, 0]),
    ("foot.{}", "shin.{}", [0.12, 0.08, 0.03]),
]


def humanoid_glb():
    """A figure of one ball per joint, which follows that joint only."""
    joints = []
    for name, parent, at in FIGURE:
        for side, sign in [("L", 1), ("R", -1)] if "{}" in name else [("", 1)]:
            joints.append((name.format(side), parent and parent.format(side), np.array(at) * [sign, 1, 1]))
    names = [name for name, _, _ in joints]
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.08)
    n = len(ball.vertices)
    positions = np.concatenate([ball.vertices + at for _, _, at in joints]).astype("<f4")
    faces = np.concatenate([ball.faces + n * k for k in range(len(joints))])
    bind = np.stack([np.eye(4, dtype="<f4")] * len(joints))
    bind[:, 3, :3] = [-at for _, _, at in joints]
    influences = np.zeros((len(positions), 4), dtype="u1")
    influences[:, 0] = np.repeat(np.arange(len(joints)), n)
    weights = np.tile(np.array([1, 0, 0, 0], dtype="<f4"), (len(positions), 1))
    data, views, accessors = pack(
        {
            "positions": (positions, "VEC3"),
            "indices": (faces.astype("<u4").reshape(-1), "SCALAR"),
            "joints": (influences, "VEC4"),
            "weights": (weights, "VEC4"),
            "bind": (bind.reshape(-1, 16), "MAT4"),
        }
    )
    nodes = [{"mesh": 0, "skin": 0}]
    for name, parent, at in joints:
        above = joints[names.index(parent)][2] if parent else 0
        below = [1 + k for k, joint in enumerate(joints) if joint[1] == name]
        nodes.append({"name": name, "translation": (at - above).tolist(), **({"children": below} if below else {})})
    attributes = {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1}]}],
        "skins": [{"joints": list(range(1, len(nodes))), "inverseBindMatrices": 4}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return glb(document, data)


def splat_records():
    """200 splats, as in a .splat file: positions, scales, colours, quaternions."""
    random = np.random.default_rng(5)
    records = np.zeros(200, [("p", "<f4", 3), ("s", "<f4", 3), ("c", "u1", 4), ("q", "u1", 4)])
    records["p"] = random.uniform(-0.8, 0.8, (200, 3))
    records["s"] = random.uniform(0.01, 0.05, (200, 3))
    records["c"] = random.integers(0, 256, (200, 4))
    records["q"] = random.integers(0, 256, (200, 4))
    return records


def cage_of(mesh, **options):
    """A cage generated for a trimesh."""
    return cw.generate_cage(mesh.vertices, mesh.faces, **options)
