import doctest
import os
import subprocess
import sys
from pathlib import Path

import cagework as cw
import numpy as np
import pytest
from cagework.distributed import reshape_files
from support import humanoid_glb, rigged_glb, splat_records

PACKAGE = Path(__file__).parents[1]


def documented():
    """Names and docstrings of the package's functions, classes and their methods."""
    for name in cw.__all__:
        public = getattr(cw, name)
        if not callable(public) or (isinstance(public, type) and issubclass(public, Exception)):
            continue
        yield name, public.__doc__
        for part in vars(public) if isinstance(public, type) else []:
            if not part.startswith("_") and callable(getattr(public, part)):
                yield f"{name}.{part}", getattr(public, part).__doc__
    yield "reshape_files", reshape_files.__doc__


@pytest.mark.parametrize(("name", "text"), list(documented()))
def test_every_documented_function_has_an_example_that_runs(name, text, model, tmp_path, monkeypatch):
    (tmp_path / "fox.glb").write_bytes(rigged_glb())
    (tmp_path / "humanoid.glb").write_bytes(humanoid_glb())
    (tmp_path / "plant.splat").write_bytes(splat_records().tobytes())
    monkeypatch.chdir(tmp_path)
    names = {"cw": cw, "np": np, "mesh": model}
    example = doctest.DocTestParser().get_doctest(text, names, name, None, None)
    assert example.examples, f"{name} has no example"
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example).failed == 0


def test_types_accept_and_reject_calls(tmp_path):
    # SciPy contains no types.
    call = ["mypy", "--strict", "--disable-error-code=import-untyped", f"{PACKAGE}/tests/typed.py"]
    done = subprocess.run([sys.executable, "-m", *call], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_installing_from_the_root_builds_this_package(tmp_path):
    hook = f"import from_root; from_root.prepare_metadata_for_build_wheel({str(tmp_path)!r})"
    # The hook runs the program `maturin`.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    subprocess.run([sys.executable, "-c", hook], cwd=PACKAGE, check=True, env={**os.environ, "PATH": path})
    text = next(tmp_path.glob("*.dist-info/METADATA")).read_text()
    assert f"Name: cagework\nVersion: {cw.__version__}\n" in text


def test_installing_without_rust_says_so_before_it_downloads(tmp_path):
    hook = "import from_root; from_root.get_requires_for_build_wheel()"
    done = subprocess.run([sys.executable, "-c", hook], cwd=PACKAGE, capture_output=True, text=True, env={**os.environ, "PATH": str(tmp_path)})
    assert done.returncode == 1 and "no cargo on the PATH: install Rust from https://rustup.rs" in done.stderr
