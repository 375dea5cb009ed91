"""Harmonic-coordinate cage deformation: cages for models, weights, posed points, deformed rigged models.

    import cagework as cw
    cage = cw.generate_cage(vertices, triangles, target=80)
    weights, report = cw.bind(points, cage, grid=64)
    posed = cage.vertices.copy()
    posed[0] += [0.0, 0.1, 0.0]
    deformed = weights @ posed
    data = cw.reshape("fox.glb", cage, posed)

Lengths are in the model's own units. For many files on many machines see cagework.distributed.
"""

from cagework._errors import ArrayError, BindError, CageError, Error, ModelError, OptionError, PullError
from cagework._native import (
    Cage,
    Field,
    Splats,
    __version__,
    bind,
    bind_many,
    check_cage,
    deform,
    generate_cage,
    pull,
    read_model,
    reshape,
)

__all__ = [
    "ArrayError",
    "BindError",
    "Cage",
    "CageError",
    "Error",
    "Field",
    "ModelError",
    "OptionError",
    "PullError",
    "Splats",
    "__version__",
    "bind",
    "bind_many",
    "check_cage",
    "deform",
    "generate_cage",
    "pull",
    "read_model",
    "reshape",
]
