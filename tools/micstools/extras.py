"""Packages that only some commands need: such a command says what installs them."""

import sys
from importlib.util import find_spec
from pathlib import Path

from micstools.reading.reader import BadRun

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "shape": ("gmsh", "manifold3d", "networkx", "trimesh"), "survey": ("ezdxf", "rasterio"),
    "ensemble": ("cryptography", "dask_jobqueue", "distributed"), "paper": ("weasyprint",),
    "pictures": ("pyvista", "vtk"), "serve": ("aiohttp",),
}  # fmt: skip


def need(extra: str) -> None:
    """Refuse to go on without the packages of an extra, with the command that installs them."""
    missing = [name for name in PACKAGES[extra] if find_spec(name) is None]
    if missing:
        ours = Path(sys.prefix) == ROOT / ".venv" and (ROOT / "tools" / "deps.sh").is_file()
        command = f"make -C {ROOT} deps" if ours else f"pip install 'micstools[{extra}]'"
        raise BadRun(f"{', '.join(missing)} missing: {command}")
