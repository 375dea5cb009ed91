"""Meshes and file objects, for the Rust code that reads models."""

import os
from typing import Any

import numpy as np


def mesh_of(model: Any) -> tuple[Any, Any] | None:
    """Returns the vertices and faces of a mesh object or of a pair (vertices, faces); None for anything else."""
    if isinstance(model, tuple):
        return model if len(model) == 2 and np.ndim(model[0]) == 2 else None
    if hasattr(model, "to_mesh") and hasattr(model, "geometry"):  # A scene of trimesh, which trimesh.load returns for a GLB.
        model = model.to_mesh()
    vertices = _attribute(model, "vertices", "points")
    if hasattr(model, "cells_dict"):  # meshio
        faces = [face for kind in ("triangle", "quad", "polygon") for face in model.cells_dict.get(kind, ())]
    else:
        faces = _attribute(model, "faces", "triangles")
    if vertices is None or faces is None:
        return None
    return vertices, faces if isinstance(faces, list) else _unpacked(np.asarray(faces))


def content_of(name: str, file: Any) -> tuple[str, bytes]:
    """Reads a file object. Returns the name of its file, or `model`, and its bytes."""
    data = file.read()
    if not isinstance(data, bytes):
        raise TypeError(f"{name}: the file is read as {type(data).__name__}, expected bytes: open it with mode 'rb'")
    path = getattr(file, "name", None)
    return os.path.basename(path) if isinstance(path, str) else "model", data


def _attribute(model: Any, *names: str) -> Any:
    return next((getattr(model, name) for name in names if hasattr(model, name)), None)


def _unpacked(faces: np.ndarray) -> Any:
    """Faces as rows or lists. VTK and PyVista store them in one array: a number of corners, the corners, and so on."""
    if faces.ndim != 1 or not faces.size:
        return faces
    step = faces[0] + 1
    if faces.size % step == 0 and (faces[::step] == faces[0]).all():
        return faces.reshape(-1, step)[:, 1:]
    lists, at = [], 0
    while at < faces.size:
        lists.append(faces[at + 1 : at + 1 + faces[at]])
        at += 1 + faces[at]
    return lists
