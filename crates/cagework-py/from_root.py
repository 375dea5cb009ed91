"""Build backend of the repository's root: maturin, run in this folder."""

import os
import shutil
from pathlib import Path

import maturin
from maturin import *  # noqa: F403

os.chdir(Path(__file__).parent)


def get_requires_for_build_wheel(config_settings=None):
    """Requirements of the build. Without Rust, maturin would require a package that downloads 2 GB of compilers."""
    if not shutil.which("cargo"):
        raise SystemExit("cagework needs Rust to build, but there is no cargo on the PATH: install Rust from https://rustup.rs, then repeat")
    return maturin.get_requires_for_build_wheel(config_settings)


get_requires_for_build_editable = get_requires_for_build_wheel
