"""`make install` gives a program that runs from where it was put; the recipe of a container names
what is there."""

import re
import shlex
import subprocess
import tomllib
from pathlib import Path

from calls import ROOT, needs_mics

RECIPE = (ROOT / "tools" / "Containerfile").read_text().replace("\\\n", " ")


def make(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", "-s", *words], cwd=ROOT, capture_output=True, text=True)


@needs_mics
def test_an_installed_program_runs(tmp_path: Path) -> None:
    done = make("install", "PREFIX=/opt/a b", f"DESTDIR={tmp_path}")
    assert done.returncode == 0, done.stderr
    there = tmp_path / "opt" / "a b"
    share = there / "share" / "mics"
    done = subprocess.run([there / "bin" / "mics", "--check", "--threads", "1", "input/mound.nml"],
                          cwd=share, capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (share / "input").iterdir()} == {
        p.name for p in (ROOT / "input").iterdir()
    }


def test_nothing_is_installed_before_it_is_built(tmp_path: Path) -> None:
    done = make("install", "DEBUG=1", "SAN=1", f"PREFIX={tmp_path / 'new'}")
    assert done.returncode == 2 and "there is no ./mics_debug_san yet; run make" in done.stderr
    assert not (tmp_path / "new").exists()


def test_tools_get_an_environment_of_their_own() -> None:
    said = make("-n", "install-tools", "PREFIX=/opt/mics").stdout
    assert "venv '/opt/mics/lib/mics'" in said and "'.[pictures]'" in said
    assert "ln -sf ../lib/mics/bin/mics-tools '/opt/mics/bin/mics-tools'" in said


def test_the_recipe_of_a_container_names_what_is_there() -> None:
    about = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    steps = re.findall(r"^([A-Z]+) (.*)$", RECIPE, re.MULTILINE)
    copied = [shlex.split(words)[:-1] for kind, words in steps if kind == "COPY"]
    names = [name for words in copied if not words[0].startswith("--from") for name in words]
    assert len(names) > 8 and all((ROOT / name).exists() for name in names)
    for kind, words in steps:
        if kind == "RUN":
            assert subprocess.run(["sh", "-n", "-c", words]).returncode == 0
    (entry,) = (words for kind, words in steps if kind == "ENTRYPOINT")
    assert entry.strip('["]') in about["scripts"]
