"""Reshapes many files on many machines with Dask: one task per file or per group of files.

    from dask.distributed import Client
    from cagework.distributed import reshape_files
    done = reshape_files(files, "out", cage, posed, client=Client("scheduler:8786"))

Inputs and outputs are on a file system that all workers share. Outputs are written atomically. An output newer than its input is
kept, so that the same call after a crash processes only the remaining files. Dask gives the tasks of a dead worker to another worker.
"""

import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from dask.bag import from_sequence
from distributed import Client, default_client

from cagework import Cage, reshape

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
    """Reshapes files into the folder `out`, keeping their names; a .gltf or .fbx becomes a .glb.

    cage, posed ([n_cage, 3], object units) and options are those of cagework.reshape. client: Dask client; None uses the default client,
    or starts worker processes on this machine. files_per_task: larger values reduce overhead for small files. work: function called for
    each file, with the signature of cagework.reshape.

    Returns a dict per file, in input order: file, output, state ("written", "kept" for an output that is newer than its input, or
    "failed") and error. Duplicate inputs are processed once. A failure does not stop the other files; if the workers of a task die
    repeatedly, all its files count as failed. Raises ValueError if two files have the same output, or `out` is a folder of the inputs.

    >>> from dask.distributed import Client
    >>> from cagework.distributed import reshape_files
    >>> cage = cw.generate_cage(*cw.read_model("fox.glb", states=True), target=40)
    >>> posed = cage.vertices * [1.3, 1.0, 1.0]
    >>> with Client(processes=False, dashboard_address=None) as client:
    ...     done = reshape_files(["fox.glb"], "out", cage, posed, client=client, grid=24)
    >>> done[0]["state"]
    'written'
    """
    if files_per_task < 1:
        raise ValueError(f"files_per_task is {files_per_task}; it must be at least 1")
    jobs: dict[Path, Path] = {}
    for file in map(Path, files):
        output = Path(out) / (file.with_suffix(".glb") if file.suffix.lower() in (".gltf", ".fbx") else file).name
        if Path(out).resolve() in (file.parent.resolve(), file.resolve().parent):
            raise ValueError(f"{file} is in the output folder {out}: choose another one")
        other = jobs.setdefault(output.absolute(), file.absolute())
        if other != file.absolute():
            raise ValueError(f"{other} and {file.absolute()} would both be written to {output}")
    Path(out).mkdir(parents=True, exist_ok=True)
    if not jobs:
        return []
    named = [(str(file), str(output)) for output, file in jobs.items()]
    bag = from_sequence(named, partition_size=files_per_task)
    tasks = bag.map(_reshape_file, cage=cage, posed=posed, work=work, options=options).to_delayed()
    done: list[dict[str, str]] = []
    with _client(client) as workers:
        for future in workers.compute(tasks):
            part = named[len(done) : len(done) + files_per_task]
            error = future.exception()
            done += future.result() if error is None else [_result(job, "failed", error) for job in part]
    return done


def _client(client: Client | None) -> AbstractContextManager[Client]:
    try:
        return nullcontext(client or default_client())
    except ValueError:
        return Client(threads_per_worker=1, dashboard_address=None)


def _result(job: tuple[str, str], state: str, error: BaseException | None = None) -> dict[str, str]:
    text = f"{type(error).__name__}: {error}" if error else ""
    return {"file": job[0], "output": job[1], "state": state, "error": text}


def _reshape_file(
    job: tuple[str, str], cage: Cage, posed: np.ndarray, work: Callable[..., bytes], options: dict[str, Any]
) -> dict[str, str]:
    file, output = job
    part = Path(output).with_name(f".{Path(output).name}.{uuid4().hex}")
    try:
        if os.path.exists(output) and os.path.getmtime(output) >= os.path.getmtime(file):
            return _result(job, "kept")
        part.write_bytes(work(file, cage, posed, **options))
        part.replace(output)
    except Exception as error:
        return _result(job, "failed", error)
    finally:
        part.unlink(missing_ok=True)
    return _result(job, "written")
