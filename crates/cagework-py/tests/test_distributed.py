"""Many files on a cluster of two local worker processes."""

import logging
import os
import signal
from pathlib import Path

import cagework as cw
import distributed
import pytest
from cagework.distributed import reshape_files
from distributed.protocol.pickle import dumps
from distributed.utils import sync
from support import bent, rigged_glb

N_FILES = 200


def name_of_status(dask_worker):
    return dask_worker.status.name


def nanny_status(worker):
    """Status of the nanny, which restarts this worker process, but not if the process dies while it starts."""
    ask = worker.rpc(worker.nanny).run
    return sync(worker.loop, ask, function=dumps(name_of_status))["result"]


def kill_this(worker):
    while nanny_status(worker) != "running":
        pass
    os.kill(os.getpid(), signal.SIGKILL)


class SingleKill:
    """Calls cagework.reshape and logs each file. Before the first result of each file in `fatal` is written, kills its process."""

    def __init__(self, log, fatal):
        self.log, self.fatal = log, fatal

    def __call__(self, files, *args, each, **options):
        # `each` is called in another thread, which knows no worker.
        worker = distributed.get_worker()

        def logged(index, data):
            name = Path(files[index]).name
            if name in self.fatal:
                try:
                    # Fails unless this is the first result of the file.
                    (self.log / f"{name}.killed").touch(exist_ok=False)
                except FileExistsError:
                    pass
                else:
                    kill_this(worker)
            each(index, data)
            with open(self.log / "done", "a") as log:
                log.write(f"{name}\n")

        with open(self.log / "solves", "a") as log:
            log.write(f"{len(files)}\n")
        cw.reshape(files, *args, each=logged, **options)


@pytest.fixture
def client():
    """Of one test: Dask sometimes fails to restart a worker that a test has killed."""
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=logging.CRITICAL
    )
    with cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Paths of small rigged models of different widths."""
    folder = tmp_path_factory.mktemp("models")
    for k in range(N_FILES):
        (folder / f"model-{k:03}.glb").write_bytes(rigged_glb(0.2 + 0.1 * k / N_FILES))
    return sorted(folder.iterdir())


def test_files_are_processed_once_each_although_workers_are_killed(client, files, tmp_path):
    cage = cw.generate_cage(*cw.read_model(files[-1]), target=24, clearance=0.05)
    posed, out, log = bent(cage), tmp_path / "out", tmp_path / "log"
    log.mkdir()
    fatal = {files[20].name, files[150].name}
    workers = set(client.run(os.getpid).values())
    assert len(workers) == 2 and os.getpid() not in workers
    options = {"grid": 8, "threads": 1, "client": client, "work": SingleKill(log, fatal)}
    fractions = []
    done = reshape_files(files, out, cage, posed, progress=fractions.append, **options)

    # Three groups of 64 and one of 8, and again those whose worker was killed.
    solves = (log / "solves").read_text().split()
    assert solves.count("64") >= 3 and "8" in solves and len(solves) < 9
    assert fractions == sorted(fractions) and fractions[-1] == 1 and any(0 < fraction < 1 for fraction in fractions)
    assert len(list(log.glob("*.killed"))) == len(fatal) == 2
    assert workers != set(client.run(os.getpid).values())
    assert [Path(result["file"]) for result in done] == files
    # Also files that a worker wrote before it was killed.
    assert {result["state"] for result in done} == {"written"}
    counted = (log / "done").read_text().split()
    assert sorted(counted) == [file.name for file in files]
    assert sorted(out.iterdir()) == [out / file.name for file in files]
    for file in [files[0], files[20], files[199]]:
        assert (out / file.name).read_bytes() == cw.reshape(file, cage, posed, grid=8)

    # The second call processes only the input that has changed and the output that is missing.
    os.utime(files[7])
    (out / files[8].name).unlink()
    again = reshape_files(files, out, cage, posed, **options)
    assert [Path(result["file"]) for result in again if result["state"] == "written"] == files[7:9]
    assert {result["state"] for result in again} == {"written", "kept"}
    assert len((log / "done").read_text().split()) == N_FILES + 2


def test_failures_are_reported_and_other_files_are_written(client, files, tmp_path):
    broken = tmp_path / "broken.glb"
    broken.write_bytes(b"no model")
    cage = cw.generate_cage(*cw.read_model(files[0]), target=24)
    names = [broken, tmp_path / "missing.glb", files[0]]
    done = reshape_files(names, tmp_path / "out", cage, cage.vertices, client=client, grid=8, files_per_task=3)
    assert [result["state"] for result in done] == ["failed", "failed", "written"]
    assert "ModelError" in done[0]["error"] and "FileNotFoundError" in done[1]["error"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == [files[0].name]


class RepeatedKill:
    """Calls cagework.reshape, and kills its process at each result of one file."""

    def __init__(self, name):
        self.name = name

    def __call__(self, files, *args, each, **options):
        # `each` is called in another thread, which knows no worker.
        worker = distributed.get_worker()

        def fatal(index, data):
            if Path(files[index]).name == self.name:
                kill_this(worker)
            each(index, data)

        cw.reshape(files, *args, each=fatal, **options)


def test_file_that_kills_its_worker_fails_and_another_is_written(client, files, tmp_path, monkeypatch):
    # One file per worker and no second attempt: only one worker dies, so that the test ends even if Dask fails to
    # restart it.
    monkeypatch.setattr(client.cluster.scheduler, "allowed_failures", 0)
    cage = cw.generate_cage(*cw.read_model(files[0]), target=24)
    work = RepeatedKill(files[1].name)
    done = reshape_files(files[:2], tmp_path / "out", cage, cage.vertices, client=client, work=work, grid=8, threads=1)
    assert [result["state"] for result in done] == ["written", "failed"]
    assert done[1]["error"].startswith("KilledWorker")
    assert list((tmp_path / "out").iterdir()) == [tmp_path / "out" / files[0].name]


def test_conflicting_outputs_are_rejected(files, tmp_path):
    cage = cw.generate_cage(*cw.read_model(files[0]), target=24)
    other = tmp_path / files[0].name
    with pytest.raises(ValueError, match="would both be written to"):
        reshape_files([files[0], other], tmp_path / "out", cage, cage.vertices)
    with pytest.raises(ValueError, match="is in the output folder .* choose another one"):
        reshape_files([files[0]], files[0].parent, cage, cage.vertices)
    with pytest.raises(ValueError, match="files_per_task is 0; it must be at least 1"):
        reshape_files(files, tmp_path / "out", cage, cage.vertices, files_per_task=0)
    assert reshape_files([], tmp_path / "out", cage, cage.vertices) == []
