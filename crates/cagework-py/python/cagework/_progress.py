"""Progress bars, for the Rust code that reports progress."""

from collections.abc import Callable
from typing import Any


def function_of(progress: Any) -> Callable[[float], Any]:
    """Returns a function of the completed fraction: `progress` itself, or one that moves a bar of tqdm."""
    if callable(progress):
        return progress
    if not hasattr(progress, "update"):
        raise TypeError(f"progress: expected a function or a bar of tqdm, got {type(progress).__name__}")
    if progress.total is None:
        progress.total = 100

    def move(fraction: float) -> None:
        progress.n = round(fraction * progress.total, 1)
        progress.update(0) if fraction < 1 else progress.refresh()

    return move
