"""Reshapes many files on many machines with Dask: one task, and one solve of the cage, per group of files.

    from dask.distributed import Client
    from cagework.distributed import reshape_files
    done = reshape_files(files, "out", cage, posed, client=Client("scheduler:8786"))

Inputs and outputs are on a file system that the client and all workers share. Outputs are written atomically. An output newer than
its input is kept, so that the same call after a crash processes only the remaining files. Dask gives the tasks of a dead worker to
another worker.
"""

import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from distributed import Client, Future, default_client, get_worker, wait
from distributed.scheduler import KilledWorker

from cagework import Cage, reshape
from cagework._progress import function_of

PathLike = str | os.PathLike[str]
# Path of a file, and path of its output.
Job = tuple[str, str]
Result = dict[str, str]

# Largest default of files_per_task. A solve then takes a small share of the time of a task, and Dask can still balance the load.
MAX_FILES_PER_TASK = 64
# Seconds between two calls of a progress function.
POLL_INTERVAL = 0.2


def reshape_files(
    files: Iterable[PathLike],
    out: PathLike,
    cage: Cage,
    posed: np.ndarray,
    *,
    client: Client | None = None,
    files_per_task: int | None = None,
    progress: Any = None,
    work: Callable[..., Any] = reshape,
    **options: Any,
) -> list[Result]:
    """Reshapes files into the folder `out`, keeping their names; a .gltf or .fbx becomes a .glb.

    cage, posed ([n_cage, 3], object units) and options are those of cagework.reshape. client: Dask client; None uses the default client,
    or starts worker processes on this machine. files_per_task: files that share a task and a solve of the cage; None gives each thread of
    the workers one task, of at most 64 files. progress: function that is called with the completed fraction of the files, or a bar
    of tqdm; raise in it to cancel. work: function called for each task, with the signature of cagework.reshape for a list of files.

    Returns a dict per file, in input order: file, output, state ("written", "kept" for an output newer than its input that an earlier call
    wrote, or "failed") and error. Duplicate inputs are processed once. A failure does not stop the other files. If the workers of a task
    die repeatedly, its files get tasks of their own, and only those whose workers die again count as failed. Raises ValueError if two
    files have the same output, or `out` is a folder of the inputs.

    >>> from dask.distributed import Client
    >>> from cagework.distributed import reshape_files
    >>> cage = cw.generate_cage("fox.glb", target=40)
    >>> posed = cage.vertices * [1.3, 1.0, 1.0]
    >>> with Client(processes=False, dashboard_address=None) as client:
    ...     done = reshape_files(["fox.glb"], "out", cage, posed, client=client, grid=24)
    >>> done[0]["state"]
    'written'
    """
    if files_per_task is not None and files_per_task < 1:
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
    all_jobs = [(str(file), str(output)) for output, file in jobs.items()]
    results = {job: _result(job, "kept") for job in all_jobs if _is_current(job)}
    remaining = [job for job in all_jobs if job not in results]
    if remaining:
        with _client(client) as workers:
            size = files_per_task or _group_size(len(remaining), workers)
            groups = [remaining[at : at + size] for at in range(0, len(remaining), size)]
            report = progress and _Report(workers, function_of(progress), len(all_jobs), len(results))
            arguments = {"cage": cage, "posed": posed, "work": work, "options": options, "topic": report and report.topic}
            results |= _run(workers, groups, arguments, report)
    return [results[job] for job in all_jobs]


def _client(client: Client | None) -> AbstractContextManager[Client]:
    try:
        return nullcontext(client or default_client())
    except ValueError:
        return Client(threads_per_worker=1, dashboard_address=None)


def _group_size(n_files: int, client: Client) -> int:
    n_threads = sum(client.nthreads().values()) or 1
    return min(MAX_FILES_PER_TASK, -(-n_files // n_threads))


class _Report:
    """Counts the files that workers have finished, and reports the fraction."""

    def __init__(self, client: Client, function: Callable[[float], Any], n_files: int, n_kept: int) -> None:
        self.function, self.n_files, self.n_kept, self.finished = function, n_files, n_kept, set[str]()
        self.topic = f"cagework-{uuid4().hex}"
        client.subscribe_topic(self.topic, lambda event: self.finished.add(event[1]))

    def __call__(self, is_end: bool = False) -> None:
        self.function(1.0 if is_end else (self.n_kept + len(self.finished)) / self.n_files)


def _run(client: Client, groups: list[list[Job]], arguments: dict[str, Any], report: _Report | None) -> dict[Job, Result]:
    """Runs a task per group, and returns the results."""
    results: dict[Job, Result] = {}

    def submit(group: list[Job]) -> Future:
        # Not pure: a second call must not get the results of the first.
        return client.submit(_reshape_group, group, **arguments, pure=False)

    pending = {submit(group): group for group in groups}
    while pending:
        try:
            finished = wait(list(pending), timeout=POLL_INTERVAL if report else None, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            finished = set()
        for future in finished:
            group, error = pending.pop(future), future.exception()
            if error is None:
                results |= zip(group, future.result(), strict=True)
            elif isinstance(error, KilledWorker) and len(group) > 1:
                pending |= {submit([job]): [job] for job in group}
            else:
                results |= {job: _result(job, "failed", error) for job in group}
        if report:
            report(is_end=not pending)
    if report:
        client.unsubscribe_topic(report.topic)
    return results


def _result(job: Job, state: str, error: BaseException | None = None) -> Result:
    text = f"{type(error).__name__}: {error}" if error else ""
    return {"file": job[0], "output": job[1], "state": state, "error": text}


def _is_current(job: Job) -> bool:
    """Whether the output exists and is not older than the input."""
    file, output = job
    try:
        return os.path.getmtime(output) >= os.path.getmtime(file)
    except OSError:
        return False


def _reshape_group(
    group: list[Job], cage: Cage, posed: np.ndarray, work: Callable[..., Any], options: dict[str, Any], topic: str | None
) -> list[Result]:
    # The client sends no files with current outputs: a worker that died has written them.
    results = {job: _result(job, "written") for job in group if _is_current(job)}
    remaining = [job for job in group if job not in results]

    # `each` is called in another thread, which knows no worker.
    worker = get_worker() if topic else None

    def each(index: int, data: bytes | Exception) -> None:
        job = remaining[index]
        results[job] = _write(job, data)
        if worker:
            worker.log_event(topic, job[0])

    if remaining:
        work([file for file, _ in remaining], cage, posed, each=each, **options)
    return [results[job] for job in group]


def _write(job: Job, data: bytes | Exception) -> Result:
    if isinstance(data, Exception):
        return _result(job, "failed", data)
    output = Path(job[1])
    part = output.with_name(f".{output.name}.{uuid4().hex}")
    try:
        part.write_bytes(data)
        part.replace(output)
    except OSError as error:
        return _result(job, "failed", error)
    finally:
        part.unlink(missing_ok=True)
    return _result(job, "written")
