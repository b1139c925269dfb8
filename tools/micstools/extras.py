"""Packages that only some commands need: installed when such a command is called first."""

import importlib
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from micstools.reading.reader import BadRun

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "shape": ("gmsh", "manifold3d", "networkx", "trimesh"),
    "ensemble": ("cryptography", "dask_jobqueue", "distributed"),
    "survey": ("ezdxf", "rasterio"),
    "pictures": ("pyvista", "vtk"),
    "serve": ("aiohttp",),
}
_OF_A_FIRST_RUN = "pictures"  # `make deps` installs them, whatever it is asked for


def need(extra: str) -> None:
    """Make sure that the packages of an extra are there. What is missing is installed where `make
    deps` has made this Python, and asked for where somebody else has."""
    missing = [name for name in PACKAGES[extra] if find_spec(name) is None]
    if not missing:
        return
    script = ROOT / "tools" / "deps.sh"
    if not script.is_file() or Path(sys.prefix) != ROOT / ".venv":
        raise BadRun(f"{', '.join(missing)} missing: pip install 'micstools[{extra}]'")
    print(f"first call: installing {', '.join(missing)}", file=sys.stderr, flush=True)
    words = [str(script), *([] if extra == _OF_A_FIRST_RUN else [extra])]
    if subprocess.run(words, stdout=sys.stderr).returncode:
        raise BadRun(f"{', '.join(missing)} could not be installed; the reason stands above")
    importlib.invalidate_caches()
