import sys
from pathlib import Path

import pytest

# Source of the widget's wheel. `cargo xtask notebook-wheel` adds the files that `widget_files` replaces here.
sys.path.append(str(Path(__file__).parents[1] / "notebook"))
import support


@pytest.fixture(autouse=True)
def widget_files(tmp_path_factory, monkeypatch):
    """Replaces the script and the wasm file of the notebook widget, which are built from TypeScript and Rust."""
    import cagework_notebook

    folder = tmp_path_factory.mktemp("files")
    for name in ("widget.js", "cagework.wasm.gz"):
        (folder / name).write_bytes(b"")
    monkeypatch.setattr(cagework_notebook, "FILES", folder)
    cagework_notebook._file.cache_clear()


@pytest.fixture(scope="session")
def model():
    return support.capsule()


@pytest.fixture(scope="session")
def cage(model):
    return support.cage_of(model, target=40)


@pytest.fixture(scope="session")
def bound(model, cage):
    import cagework as cw

    return cw.bind(model.vertices, cage, grid=24)
