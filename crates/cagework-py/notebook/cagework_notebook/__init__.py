"""The notebook widget of cagework. Documented in cagework.show."""

import struct
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

import anywidget
import numpy as np
import traitlets
from scipy.sparse import coo_array, hstack

import cagework as cw
from cagework._models import content_of, mesh_of
from cagework._native import to_glb

__all__ = ["CageWidget", "show"]
__version__ = "0.1.0"

FILES = Path(__file__).parent / "files"
# Frames of a report without points outside the cage.
NO_FRAMES: dict[str, list[Any]] = {"whole": [], "joints": [], "bones": [], "plain": []}


@cache
def _file(name: str) -> bytes:
    try:
        return (FILES / name).read_bytes()
    except FileNotFoundError:
        raise ImportError(
            f"cagework-notebook was installed without {name}: build its wheel with `cargo xtask notebook-wheel` and install that"
        ) from None


class _Pose(traitlets.TraitType):
    """A pose: float64 [n_cage, 3], object units. Read-only, because the widget cannot detect in-place changes."""

    def validate(self, obj: Any, value: Any) -> np.ndarray:
        pose = np.array(value, dtype=np.float64)
        shape = obj.cage.vertices.shape
        if pose.shape != shape:
            raise cw.ArrayError(f"pose: expected shape {list(shape)}, got {list(pose.shape)}")
        limit = np.finfo(np.float32).max
        if not (np.abs(pose) <= limit).all():
            raise cw.ArrayError(f"pose: expected finite numbers of at most {limit:.1e}, got NaN, infinity or more: use smaller ones")
        pose.flags.writeable = False
        return pose


def _to_bytes(pose: np.ndarray, _: Any) -> bytes:
    return pose.tobytes()


def _from_bytes(data: Any, _: Any) -> np.ndarray:
    return np.frombuffer(data, np.float64).reshape(-1, 3)


class CageWidget(anywidget.AnyWidget):
    """A model in its cage. pose: [n_cage, 3], object units; set it to pose the model, or observe it."""

    _esm = ""
    _sent = traitlets.Dict().tag(sync=True)
    _wasm = traitlets.Bytes().tag(sync=True)
    pose = _Pose().tag(sync=True, to_json=_to_bytes, from_json=_from_bytes)
    theme = traitlets.Enum(["auto", "dark", "light"], "auto").tag(sync=True)
    height = traitlets.Int(400, min=100).tag(sync=True)

    def __init__(self, cage: cw.Cage, weights: Any, report: dict[str, Any], sent: dict[str, Any], **options: Any) -> None:
        self.cage, self.weights, self.report = cage, weights, report
        super().__init__(
            _esm=_file("widget.js").decode(), _wasm=_file("cagework.wasm.gz"), _sent=sent, pose=cage.vertices, **options
        )

    @property
    def deformed(self) -> np.ndarray:
        """The model's vertices in the current pose, [n, 3], object units."""
        return cw.deform(self.weights, self.pose, self.report or None)


def show(
    model: Any,
    cage: cw.Cage,
    weights: Any = None,
    report: dict[str, Any] | None = None,
    *,
    theme: str = "auto",
    height: int = 400,
) -> CageWidget:
    """Documented in cagework.show."""
    name, data, vertices = _read(model)
    if weights is None:
        weights, report = cw.bind(data if vertices is None else vertices, cage)
    rows, columns = weights.shape
    if columns != len(cage.vertices) or (vertices is not None and rows != len(vertices)):
        count = "" if vertices is None else f"{len(vertices)} vertices and "
        raise cw.ArrayError(
            f"weights: expected a row per vertex and a column per cage vertex ({count}{len(cage.vertices)} cage vertices), "
            f"got [{rows}, {columns}]"
        )
    whole = weights.tocsr()
    if report and "offsets" in report:
        own = report["offsets"]
        offsets = coo_array((np.array(own["value"], "f4"), (own["vertex"], own["column"])), (rows, own["columns"]))
        whole = hstack([weights, offsets]).tocsr()
    corners = [number for face in cage.faces for number in (len(face), *face)]
    sent = {
        "name": name,
        "file": data,
        "positions": cage.vertices.astype("<f8").tobytes(),
        "corners": np.array(corners, "<u4").tobytes(),
        "smooth": cage.smooth,
        "indptr": whole.indptr.astype("<u4").tobytes(),
        "indices": whole.indices.astype("<u4").tobytes(),
        "data": whole.data.astype("<f4").tobytes(),
        "frames": report["frames"] if report else NO_FRAMES,
        "report": {key: value for key, value in (report or {}).items() if key not in ("outside", "frames", "offsets")},
    }
    return CageWidget(cage, weights, report or {}, sent, theme=theme, height=height)


def _read(model: Any) -> tuple[str, bytes, np.ndarray | None]:
    """The name and bytes of a model's file, and its vertices if it was given by arrays."""
    mesh = mesh_of(cw.read_model(model) if isinstance(model, list) else model)
    if mesh is not None:
        _, triangles = cw.read_model(mesh)
        vertices = np.asarray(mesh[0])
        return "model.ply", _ply(vertices, triangles), vertices
    name = Path(model).name if isinstance(model, (str, PathLike)) else "model"
    if hasattr(model, "read"):
        name, model = content_of("model", model)
    glb = to_glb(model)
    data = Path(model).read_bytes() if isinstance(model, (str, PathLike)) else bytes(model)
    # A GLB that needs no other files is sent as it is.
    if glb is None or data[:4] == b"glTF":
        return name if glb is None else f"{Path(name).stem}.glb", data, None
    return f"{Path(name).stem}.glb", glb, None


def _ply(vertices: np.ndarray, triangles: np.ndarray) -> bytes:
    """A binary PLY file, which keeps 64-bit positions and their order."""
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), [("n", "u1"), ("corners", "<u4", 3)])
    faces["n"], faces["corners"] = 3, triangles
    return head.encode() + vertices.astype("<f8").tobytes() + faces.tobytes()
