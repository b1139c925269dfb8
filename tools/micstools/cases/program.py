"""The program `mics` and the case handed to it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from micstools.cases import case_copy, settings
from micstools.reading.reader import BadRun

VARIABLE = "MICS"
"""Environment variable that names the program."""
BUILT = Path(__file__).parents[3] / "mics"
"""The program that make builds, where the tools run from the folder of its sources."""
ENVIRONMENT = {"GOMP_SPINCOUNT": "1000", "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}
"""How threads wait, and in which pages memory comes, unless the user has chosen: measured in
docs/performance.md."""


def find(given: Path | None = None, case: Path | None = None) -> Path:
    """The program: `given`, else that of the environment variable MICS, of the folder of sources,
    on the PATH, beside a case or in the folder above it. Raises BadRun where there is none."""
    if given is not None:
        return _named(str(given), str(given))
    if named := os.environ.get(VARIABLE):
        return _named(named, f"{VARIABLE} = {named}")
    folders = [case.resolve().parent, case.resolve().parent.parent] if case else []
    path = os.environ.get("PATH", os.defpath)
    for folder in (str(BUILT.parent), path, *map(str, folders)):
        if found := shutil.which("mics", path=folder):
            return Path(found).resolve()
    raise BadRun("the program mics is not found: run make, set MICS, put it on the PATH or beside "
                 "the case, or name it with --program")  # fmt: skip


def _named(name: str, words: str) -> Path:
    """A program by its path, or by its name on the PATH."""
    found = shutil.which(Path(name).absolute()) or shutil.which(name)
    if found is None:
        raise BadRun(f"{words}: is no program")
    return Path(found).resolve()


def case_text(case: Path, words: list[str]) -> str:
    """The text of a case with settings; files beside it are named from where we are, since the
    program does not see where a text comes from."""
    text = settings.read(case)
    if words:
        wanted = [settings.parse(word) for word in words]
        text = settings.set_variables(text, wanted)
        if any(setting.name == "drop.seed" for setting in wanted):
            drops = sum(name == "drop" for name, _, _ in settings.groups(text))
            seeds = ", ".join(str(settings.value(text, "drop", "seed", n)) for n in range(drops))
            if drops > 1:
                print(f"&drop seed = {seeds}: one for each of the {drops} groups", file=sys.stderr)
    return case_copy.from_here(text, case.parent)


def check(program: Path, text: str) -> str:
    """The plan of a case on one thread; its faults in the program's own words."""
    done = subprocess.run(
        [program, "--check", "--threads", "1"], input=text, capture_output=True, text=True
    )
    if done.returncode:
        raise BadRun(done.stderr.strip() or f"{program} ended with code {done.returncode}")
    return done.stdout


def wait(process: subprocess.Popen[Any]) -> int:
    """Exit code of the program, as a shell would tell it; Ctrl-C reaches the program itself, which
    writes a restart file before it ends."""
    while True:
        try:
            code = process.wait()
        except KeyboardInterrupt:
            continue
        return code if code >= 0 else 128 - code
