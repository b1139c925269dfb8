"""The map of heights of input/mound.nml."""

import shutil
from pathlib import Path

shutil.copy(Path(__file__).resolve().parents[3] / "input" / "mound.txt", "mound.txt")
