"""Build backend of the repository's root: maturin, run in this folder."""

import os
from pathlib import Path

from maturin import *  # noqa: F403

os.chdir(Path(__file__).parent)
