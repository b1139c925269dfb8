"""What `pip install .` gives: all that the tools need, and nothing that only some commands need."""

import ast
import email
import subprocess
import sys
import tomllib
import zipfile
from email.message import Message
from pathlib import Path

import pytest

from calls import ROOT, python
from micstools import cli, extras
from micstools.reading import schema
from micstools.reading.reader import Run

IMPORTED_AS = {"dask_jobqueue": "dask-jobqueue", "imageio_ffmpeg": "imageio-ffmpeg",
               "PIL": "pillow", "vtkmodules": "vtk"}  # fmt: skip


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel that pip makes of a copy of the sources; nothing is fetched."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    words = ["git", "ls-files", "-co", "--exclude-standard", "-z",
             "pyproject.toml", "tools", "docs"]  # fmt: skip
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_symlink():
            (source / name).symlink_to((ROOT / name).readlink())
        elif (ROOT / name).is_file():
            (source / name).write_bytes((ROOT / name).read_bytes())
    words = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index",
             "--no-build-isolation", "--wheel-dir", folder, source]  # fmt: skip
    python(*words, check=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def metadata(wheel: Path) -> Message:
    with zipfile.ZipFile(wheel) as file:
        (name,) = (name for name in file.namelist() if name.endswith("/METADATA"))
        return email.message_from_bytes(file.read(name))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel unpacked, with packages that only some commands need out of reach."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as file:
        file.extractall(folder)
    hidden = sorted({name for names in extras.PACKAGES.values() for name in names})
    lines = ["import sys", *(f"sys.modules[{name!r}] = None" for name in [*hidden, "vtkmodules"])]
    (folder / "sitecustomize.py").write_text("\n".join(lines))
    return folder


def call(installed: Path, *words: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
    done = python(*words, cwd=installed, tools=installed)
    assert done.returncode == code, done.stderr
    return done


def names_of(requirements: list[str], extra: str = "") -> set[str]:
    """Names of the packages that are needed, or that an extra adds."""
    kept = [r for r in requirements if (f'extra == "{extra}"' in r if extra else "extra" not in r)]
    return {r.split(";")[0].split(">")[0].split("=")[0].strip() for r in kept}


def imports(path: Path, inside: bool) -> set[str]:
    """Packages that a file imports at its head, or `inside` its procedures."""
    tree = ast.parse(path.read_text())
    nodes = [n for n in ast.walk(tree) if isinstance(n, (ast.Import, ast.ImportFrom))]
    nodes = [n for n in nodes if (n not in tree.body) is inside]
    names = {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
    names |= {str(n.module) for n in nodes if isinstance(n, ast.ImportFrom)}
    found = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names) - {"micstools"}
    return {IMPORTED_AS.get(name, name) for name in found}


def test_pip_installs_what_the_tools_import(metadata: Message) -> None:
    files = (ROOT / "tools" / "micstools").rglob("*.py")
    files = [path for path in files if path.parent.name != "bench"]  # of the sources only
    needed = metadata.get_all("Requires-Dist", [])
    always = set().union(*(imports(path, inside=False) for path in files))
    assert names_of(needed) == always - {"aiohttp", "distributed", "dask-jobqueue"}
    offered = set().union(*(names_of(needed, extra) for extra in extras.PACKAGES))
    assert offered | always >= set().union(*(imports(path, inside=True) for path in files))


def test_extras_are_those_that_are_asked_for(metadata: Message) -> None:
    needed = metadata.get_all("Requires-Dist", [])
    for extra, packages in extras.PACKAGES.items():
        wanted = {IMPORTED_AS.get(name, name) for name in packages}
        assert wanted <= names_of(needed, extra), extra
    pinned = (ROOT / "requirements.txt").read_text()
    for name in names_of(needed) | names_of(needed, "pictures"):
        assert f"\n{name}==" in pinned, name
    about = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert about["scripts"] == {"mics-tools": "micstools.cli:main"}


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_helps_without_the_extras(installed: Path, name: str) -> None:
    call(installed, "-m", "micstools.cli", name, "--help")


def test_an_installed_package_works(installed: Path, loose_pile: Run, tmp_path: Path) -> None:
    """The page has its scripts, its style and the defaults of the case; cases and runs are read
    into pandas and xarray, in any folder."""
    path = tmp_path / "page.html"
    call(installed, "-m", "micstools.cli", "report", loose_pile.folder, "--out", path)
    assert "What differs from the defaults" in path.read_text()
    program = (
        "import sys; from micstools import Case, Run\n"
        "case, run = Case.read(sys.argv[1]), Run(sys.argv[2])\n"
        "print(case.run.about('dt'), len(case.body), len(run.blocks), dict(run.fields.sizes))"
    )
    case = ROOT / "input" / "blocks_coarse.nml"
    said = call(installed, "-c", program, case, loose_pile.folder).stdout
    assert "[s]" in said and f" 3 {401 * 9} " in said and "'time': 17" in said


def test_defaults_are_those_of_the_schema(wheel: Path) -> None:
    """Of which there is one: the package carries the file that `make reference` writes."""
    with zipfile.ZipFile(wheel) as file:
        carried = file.read("micstools/mics-case.schema.json")
    assert carried == (ROOT / "docs" / "mics-case.schema.json").read_bytes()
    assert schema.variables("contact")["friction"]["default"] == 0.6
    assert schema.variables("run")["restart_interval"]["default"] == 1.0


@pytest.mark.parametrize("words", [["plot"], ["movie"], ["export", "--to", "pvd"]])
def test_pictures_ask_for_their_packages(
    installed: Path, loose_pile: Run, words: list[str]
) -> None:
    words = ["-m", "micstools.cli", words[0], loose_pile.folder, *words[1:]]
    (line,) = call(installed, *words, code=2).stderr.splitlines()
    assert "pip install 'micstools[pictures]'" in line
