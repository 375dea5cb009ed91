from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, TypedDict, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from typing_extensions import Unpack

__version__: str

_Faces = ArrayLike | Sequence[ArrayLike]

class _Bar(Protocol):
    n: Any
    total: Any
    def update(self, n: Any = ...) -> Any: ...
    def refresh(self) -> Any: ...

class _Readable(Protocol):
    def read(self) -> bytes: ...

class _Writable(Protocol):
    def write(self, data: bytes, /) -> Any: ...

class _VerticesFaces(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _VerticesTriangles(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...

class _PointsFaces(Protocol):
    @property
    def points(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _PointsCells(Protocol):
    @property
    def points(self) -> Any: ...
    @property
    def cells_dict(self) -> Any: ...

class _Scene(Protocol):
    @property
    def geometry(self) -> Any: ...
    def to_mesh(self) -> Any: ...

_Progress = Callable[[float], object] | _Bar | None
_File = str | PathLike[str] | bytes | bytearray | memoryview | _Readable
_Mesh = _VerticesFaces | _VerticesTriangles | _PointsFaces | _PointsCells | _Scene | tuple[ArrayLike, _Faces]
_Model = _File | _Mesh
_Points = ArrayLike | _Model

class BindOptions(TypedDict, total=False):
    grid: int | Literal["auto"]
    method: Literal["embedded", "classic"]
    solver: Literal["multigrid", "jacobi", "cg"] | None
    threads: int
    tau: float
    max_iterations: int
    sparsify: float
    memory_limit: int
    outside: Literal["extend", "stay", "refuse"]

class CageOptions(TypedDict, total=False):
    target: int
    detail: float
    quads: bool
    kind: Literal["auto", "skeleton", "shell", "hull"]
    symmetry: Literal["auto", "none", "x", "y", "z"]
    per_component: bool
    clearance: float
    voxels: int
    smooth: int

@final
class Cage:
    def __new__(cls, vertices: ArrayLike, faces: _Faces, smooth: int = 0) -> Cage: ...
    @staticmethod
    def load(path: _Model, smooth: int = 0) -> Cage: ...
    def save(self, path: str | PathLike[str] | _Writable, vertices: ArrayLike | None = None) -> None: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> list[NDArray[np.int32]]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...
    @property
    def smooth(self) -> int: ...
    @property
    def notices(self) -> list[str]: ...
    @property
    def checked(self) -> dict[str, Any]: ...
    @property
    def report(self) -> dict[str, Any] | None: ...
    @property
    def rings(self) -> dict[str, Any] | None: ...

@final
class Field:
    def __new__(
        cls, cage: Cage, posed: ArrayLike, *, cells: int = 64, progress: _Progress = None, **options: Unpack[BindOptions]
    ) -> Field: ...
    def pose(self, posed: ArrayLike) -> Field: ...
    def map(self, points: ArrayLike) -> NDArray[np.float32] | NDArray[np.float64]: ...
    def inverse(self, points: ArrayLike) -> NDArray[np.float32] | NDArray[np.float64]: ...
    def gradient(self, points: ArrayLike) -> NDArray[np.float32]: ...
    def save(self, path: str | PathLike[str] | _Writable) -> None: ...

@final
class Puller:
    def __new__(
        cls,
        vertices: _Points,
        triangles: ArrayLike | None,
        cage: Cage,
        weights: Any,
        *,
        report: dict[str, Any] | None = None,
        progress: _Progress = None,
        **options: Unpack[BindOptions],
    ) -> Puller: ...
    def pull(
        self,
        grabs: ArrayLike,
        to: ArrayLike,
        *,
        pins: ArrayLike | None = None,
        start: ArrayLike | None = None,
        reach: float | None = None,
        relax: float = 0.5,
    ) -> NDArray[np.float64]: ...
    def drag(
        self,
        grabs: ArrayLike,
        *,
        pins: ArrayLike | None = None,
        start: ArrayLike | None = None,
        reach: float | None = None,
        relax: float = 0.5,
    ) -> Drag: ...

@final
class Drag:
    def to(self, targets: ArrayLike) -> NDArray[np.float64]: ...

@final
class Splats:
    def __new__(cls, path: _Model) -> Splats: ...
    def __len__(self) -> int: ...
    @property
    def positions(self) -> NDArray[np.float32] | NDArray[np.float64]: ...
    @property
    def scales(self) -> NDArray[np.float32]: ...
    @property
    def rotations(self) -> NDArray[np.float32]: ...
    @property
    def opacities(self) -> NDArray[np.float32]: ...
    @property
    def colors(self) -> NDArray[np.float32]: ...
    @property
    def harmonics(self) -> NDArray[np.float32]: ...
    @property
    def covariances(self) -> NDArray[np.float32]: ...
    def deformed(self, field: Field) -> Splats: ...
    def first_order_errors(self, field: Field) -> NDArray[np.float32]: ...
    def shells(self) -> tuple[NDArray[np.float32] | NDArray[np.float64], NDArray[np.int32]]: ...
    def save(
        self, path: str | PathLike[str] | _Writable, format: Literal["ply", "splat", "spz", "glb"] | None = None
    ) -> None: ...

def generate_cage(
    vertices: _Points | list[_Model],
    triangles: ArrayLike | None = None,
    *,
    rig: _Model | list[_Model] | None = None,
    progress: _Progress = None,
    **options: Unpack[CageOptions],
) -> Cage: ...
def check_cage(
    cage: Cage | _VerticesFaces, points: _Points | None = None, grid: int | Literal["auto"] = "auto", smooth: int | None = None
) -> list[dict[str, Any]]: ...
def bind(
    points: _Points, cage: Cage, *, progress: _Progress = None, **options: Unpack[BindOptions]
) -> tuple[csr_array, dict[str, Any]]: ...
def bind_many(
    models: Sequence[_Points], cage: Cage, *, progress: _Progress = None, **options: Unpack[BindOptions]
) -> list[tuple[csr_array, dict[str, Any]]]: ...
def deform(
    weights: Any, posed: ArrayLike, report: dict[str, Any] | None = None
) -> NDArray[np.float32] | NDArray[np.float64]: ...
def pull(
    vertices: _Points,
    triangles: ArrayLike | None,
    cage: Cage,
    weights: Any,
    grabs: ArrayLike,
    to: ArrayLike,
    *,
    pins: ArrayLike | None = None,
    report: dict[str, Any] | None = None,
    start: ArrayLike | None = None,
    reach: float | None = None,
    relax: float = 0.5,
    progress: _Progress = None,
    **options: Unpack[BindOptions],
) -> NDArray[np.float64]: ...
def humanoid_bones(model: _Model, bones: dict[str, str] | None = None) -> dict[str, str]: ...
def proportions(
    model: _Model,
    cage: Cage,
    factors: dict[str, float] | None = None,
    *,
    preset: Literal["longer legs", "big head", "hero", "chibi", "slim", "stout"] | None = None,
    bones: dict[str, str] | None = None,
    progress: _Progress = None,
    **options: Unpack[BindOptions],
) -> NDArray[np.float64]: ...
def read_model(
    model: _Model | list[_Model], states: bool = False, clip: str | None = None
) -> tuple[NDArray[np.float32] | NDArray[np.float64], NDArray[np.int32]]: ...
def to_glb(model: _Model) -> bytes | None: ...
def defaults() -> list[dict[str, Any]]: ...
def restored_cage(vertices: ArrayLike, faces: _Faces, smooth: int, made: str) -> Cage: ...
def restored_splats(arrays: list[bytes]) -> Splats: ...
@overload
def reshape(
    model: _Model,
    cage: Cage,
    posed: ArrayLike | dict[str, ArrayLike],
    *,
    joints: Literal["follow", "stay", "turn"] = "follow",
    keep_travel: bool = False,
    ground: bool = False,
    feet: Literal["free", "lock"] = "free",
    rigid: Sequence[str] = [],
    mask: dict[str, float] | None = None,
    skeleton: _Model | None = None,
    expressions: bool = False,
    times: Sequence[float] | None = None,
    interpolation: Literal["step", "linear", "cubic"] | None = None,
    static: bool = False,
    each: Callable[[int, Any], object] | None = None,
    progress: _Progress = None,
    **options: Unpack[BindOptions],
) -> bytes: ...
@overload
def reshape(
    model: list[_Model],
    cage: Cage,
    posed: ArrayLike | dict[str, ArrayLike],
    *,
    joints: Literal["follow", "stay", "turn"] = "follow",
    keep_travel: bool = False,
    ground: bool = False,
    feet: Literal["free", "lock"] = "free",
    rigid: Sequence[str] = [],
    mask: dict[str, float] | None = None,
    skeleton: _Model | None = None,
    expressions: bool = False,
    times: Sequence[float] | None = None,
    interpolation: Literal["step", "linear", "cubic"] | None = None,
    static: bool = False,
    each: Callable[[int, Any], object] | None = None,
    progress: _Progress = None,
    **options: Unpack[BindOptions],
) -> list[bytes]: ...
def transfer(
    body: _Model, clothes: _Model, *, push_out: float | None = None, memory_limit: int = ...
) -> tuple[bytes, dict[str, Any]]: ...
