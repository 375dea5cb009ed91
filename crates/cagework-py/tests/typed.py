"""Calls that mypy and pyright accept; the errors on the last lines must be reported."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

import cagework as cw

points: NDArray[np.float32] = np.zeros((5, 3), np.float32)
cage: cw.Cage = cw.generate_cage(points, [[0, 1, 2]], target=40, kind="hull")
weights, report = cw.bind(points, cage, grid=32, outside="stay")
matrix: csr_array = weights
moved: NDArray[np.float32] | NDArray[np.float64] = cw.deform(weights, cage.vertices, report)
posed: NDArray[np.float64] = cw.pull(points, cage.triangles, cage, weights, [0], [[0.0, 0.0, 1.0]])
data: bytes = cw.reshape("fox.glb", cage, posed, joints="turn", grid=32)
dressed: bytes = cw.transfer("body.glb", b"")[0]
nodes: NDArray[np.float32] | NDArray[np.float64] = cw.Field(cage, posed, cells=32).map(points)
cw.bind(points, cage, grit=32)  # type: ignore[call-arg]
cw.bind(points, cage, outside="sometimes")  # type: ignore[arg-type]
