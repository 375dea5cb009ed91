"""Many files past one machine: each is reshaped by itself, so that Dask's bag over the names is all the scheduling there is.

    from dask.distributed import Client
    from cagework.distributed import reshape_files
    done = reshape_files(files, "out", cage, posed, client=Client("scheduler:8786"))

Inputs and outputs are on a file system that all workers see. An output appears whole or not at all, and one that is newer than
its input is left alone: after a crash, the same call again does what is missing. A task of a worker that dies is given to another.
"""

import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from dask.bag import from_sequence
from distributed import Client

from cagework import Cage, Error, reshape

PathLike = str | os.PathLike[str]


def reshape_files(
    files: Iterable[PathLike],
    out: PathLike,
    cage: Cage,
    posed: np.ndarray,
    *,
    client: Client | None = None,
    files_per_task: int = 1,
    work: Callable[..., bytes] = reshape,
    **options: Any,
) -> list[dict[str, str]]:
    """Reshapes files into the folder `out`, under their names; a .gltf becomes a .glb.

    cage, posed and options are those of cagework.reshape; posed: [n_cage, 3], object units. client: of the workers; None: the one
    that is there, or processes of this machine. files_per_task: more of them for many small files. work: what is called for
    each file, cagework.reshape or a function like it.

    Returns a dict for each file, in their order: file, output, state ("written", "kept" when the output was there, "failed") and
    the error. One that is named twice is done once. What fails does not end the rest. Raises ValueError when two files would be
    written to one, or one over itself.
    """
    jobs: dict[Path, Path] = {}
    for file in map(Path, files):
        output = Path(out) / (file.with_suffix(".glb") if file.suffix.lower() == ".gltf" else file).name
        if output.resolve() == file.resolve():
            raise ValueError(f"{file} would be written over itself: take another folder than {out}")
        other = jobs.setdefault(output.absolute(), file.absolute())
        if other != file.absolute():
            raise ValueError(f"{other} and {file.absolute()} would both be written to {output}")
    Path(out).mkdir(parents=True, exist_ok=True)
    if not jobs:
        return []
    bag = from_sequence([(str(file), str(output)) for output, file in jobs.items()], partition_size=files_per_task)
    tasks = bag.map(_reshape_file, cage=cage, posed=posed, work=work, options=options)
    return list(client.compute(tasks, sync=True) if client else tasks.compute())


def _reshape_file(
    job: tuple[str, str], cage: Cage, posed: np.ndarray, work: Callable[..., bytes], options: dict[str, Any]
) -> dict[str, str]:
    file, output = job
    said = {"file": file, "output": output, "error": ""}
    try:
        if os.path.exists(output) and os.path.getmtime(output) >= os.path.getmtime(file):
            return said | {"state": "kept"}
        _write_whole(output, work(file, cage, posed, **options))
    except (Error, OSError) as error:
        return said | {"state": "failed", "error": f"{type(error).__name__}: {error}"}
    return said | {"state": "written"}


def _write_whole(path: str, data: bytes) -> None:
    """Writes a file beside its place, then puts it there."""
    folder, name = os.path.split(path)
    handle, written = tempfile.mkstemp(prefix=f".{name}.", dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(written, 0o666 & ~_umask())
        os.replace(written, path)
    except BaseException:
        os.unlink(written)
        raise


def _umask() -> int:
    umask = os.umask(0o077)
    os.umask(umask)
    return umask
