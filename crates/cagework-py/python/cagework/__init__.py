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

from typing import Any

from cagework._errors import ArrayError, BindError, CageError, Error, ModelError, OptionError, PullError
from cagework._native import (
    Cage,
    Drag,
    Field,
    Puller,
    Splats,
    __version__,
    bind,
    bind_many,
    check_cage,
    deform,
    generate_cage,
    humanoid_bones,
    proportions,
    pull,
    read_model,
    reshape,
    transfer,
)

__all__ = [
    "ArrayError",
    "BindError",
    "Cage",
    "CageError",
    "Drag",
    "Error",
    "Field",
    "ModelError",
    "OptionError",
    "PullError",
    "Puller",
    "Splats",
    "__version__",
    "bind",
    "bind_many",
    "check_cage",
    "deform",
    "generate_cage",
    "humanoid_bones",
    "proportions",
    "pull",
    "read_model",
    "reshape",
    "show",
    "transfer",
]


def show(model: Any, cage: Cage, weights: Any = None, report: dict[str, Any] | None = None, **options: Any) -> Any:
    """Draws a model in its cage in a notebook: show(model, cage, weights=None, report=None, *, theme="auto", height=400) -> widget

    model: anything that read_model takes; a file is drawn with its materials. weights and report: the result of bind; without them, the model is bound here. theme: "auto", "dark" or "light"; height:
    CSS pixels.

    The widget's pose is the cage's vertices, [n_cage, 3] float64, object units. Drag vertices in the notebook, or assign a pose.
    widget.observe(function, "pose") calls a function at each change. The array is read-only: copy it to change numbers. deformed: the
    model's vertices in this pose.

    Needs the package cagework-notebook; raises ImportError without it, which says how to install it, ArrayError, and the exceptions of bind and read_model.

    >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    >>> widget = cw.show(mesh, cage, *cw.bind(mesh.vertices, cage, grid=24))
    >>> widget.pose = cage.vertices * [2, 1, 1]
    >>> bool(np.allclose(widget.deformed, mesh.vertices * [2, 1, 1], atol=1e-3))
    True
    """
    try:
        from cagework_notebook import show as draw
    except ModuleNotFoundError as error:
        raise ImportError(
            f"cagework.show needs the package cagework-notebook ({error}), which is not on PyPI yet. In a clone of "
            "https://github.com/cagework/cagework, run `cargo xtask notebook-wheel`, then `pip install target/notebook/*.whl`"
        ) from error
    return draw(model, cage, weights, report, **options)
