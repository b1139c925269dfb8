"""Breaks formulas one by one: each break must turn the named tests red.

The list is mutations.toml. Work happens in a copy of the tree under build/mutate, which stays for
the next call. A name without a slash in `tests` is a unit test; a name with one is a pytest item,
like `verification/test_cases.py::test_case[water_ball]`. Exit code 1: a break that no test
noticed, a pattern that is not in its file exactly once, or a test that is red without any break.
"""

import argparse
import filecmp
import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCRATCH = ROOT / "build" / "mutate"
COPIED = ("Makefile", "pyproject.toml", "src", "tools", "verification", "input")
PATIENCE = 300.0
"""Seconds after which a test counts as red: a broken formula may loop for ever."""


@dataclass(frozen=True)
class Mutation:
    """One formula, how it is broken, and the tests that must notice."""

    name: str
    file: str
    original: str
    replacement: str
    tests: tuple[str, ...]


def mutations() -> list[Mutation]:
    """All entries of mutations.toml."""
    with (ROOT / "verification" / "mutations.toml").open("rb") as file:
        entries = tomllib.load(file)["mutation"]
    return [Mutation(**{**entry, "tests": tuple(entry["tests"])}) for entry in entries]


def mismatch(mutation: Mutation) -> str:
    """Why the pattern cannot be applied; empty if it can."""
    path = ROOT / mutation.file
    if not path.is_file():
        return f"{mutation.file} does not exist"
    found = path.read_text().count(mutation.original)
    if found != 1:
        return f"found {found} times in {mutation.file}, must be there once: {mutation.original!r}"
    if mutation.original == mutation.replacement:
        return "the replacement changes nothing"
    units = {path.stem for path in (ROOT / "verification" / "unit").glob("*/test_*.f90")}
    if lost := [test for test in mutation.tests if "/" not in test and test not in units]:
        return f"no unit test is called {', '.join(lost)}"
    return "" if mutation.tests else "no tests are named"


def copy_tree() -> None:
    """Bring the scratch copy up to date; unchanged files keep their time, so little is rebuilt."""
    wanted = set()
    for name in COPIED:
        top = ROOT / name
        for source in [top] if top.is_file() else top.rglob("*"):
            relative = source.relative_to(ROOT)
            if source.is_dir() or "__pycache__" in relative.parts:
                continue
            wanted.add(relative)
            target = SCRATCH / relative
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.exists() or not filecmp.cmp(source, target, shallow=False):
                shutil.copyfile(source, target)
                shutil.copymode(source, target)
    for name in COPIED:
        for target in (SCRATCH / name).rglob("*"):
            if target.is_file() and target.relative_to(SCRATCH) not in wanted:
                target.unlink()
    venv = SCRATCH / ".venv"
    if not venv.is_symlink():
        venv.symlink_to(ROOT / ".venv")


def command(arguments: list[str | Path], patience: float = PATIENCE) -> tuple[bool, str]:
    """Run in the scratch tree; whether it ended well in time, and its output."""
    try:
        done = subprocess.run(
            arguments,
            cwd=SCRATCH,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=patience,
            env={**os.environ, "MAKEFLAGS": "", "MAKELEVEL": "0"},
        )
    except subprocess.TimeoutExpired:
        return False, "took too long"
    return done.returncode == 0, done.stdout


def source_of(test: str) -> Path:
    """The file of a unit test, from the root on."""
    (source,) = (ROOT / "verification" / "unit").glob(f"*/{test}.f90")
    return source.relative_to(ROOT)


def build(tests: tuple[str, ...], patience: float = PATIENCE) -> tuple[bool, str]:
    """Compile what these tests need, no others, with little optimisation to save time."""
    units = [source_of(test) for test in tests if "/" not in test]
    goals = sorted({f"build/serial/test_{unit.parent.name}" for unit in units})
    if units:
        goals.append(f"tests={' '.join(map(str, units))}")
    if any("/" in test for test in tests):
        goals.append("mics")
    return command(["make", "OPT=-O1 -march=native", "LTO=", *goals], patience)


def green(test: str) -> bool:
    """Does the test pass in the scratch tree?"""
    if "/" in test:
        return command([".venv/bin/python", "-m", "pytest", "-x", "-q", test])[0]
    program = f"build/serial/test_{source_of(test).parent.name}"
    return command([program, test.removeprefix("test_")])[0]


def verdict(mutation: Mutation) -> tuple[bool, str]:
    """Break the formula, run its tests, mend it; whether all tests noticed, and in words."""
    path = SCRATCH / mutation.file
    whole = path.read_text()
    path.write_text(whole.replace(mutation.original, mutation.replacement))
    try:
        built, output = build(mutation.tests)
        if not built:
            return False, f"DOES NOT COMPILE\n{output[-1500:]}"
        blind = [test for test in mutation.tests if green(test)]
    finally:
        path.write_text(whole)
    if blind:
        return False, f"SURVIVED {', '.join(blind)}"
    return True, f"killed by {', '.join(mutation.tests)}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-k", default="", metavar="TEXT", help="only names or files with TEXT")
    args = parser.parse_args()
    chosen = [m for m in mutations() if args.k in m.name or args.k in m.file]

    failed = 0
    for mutation in chosen:
        if reason := mismatch(mutation):
            print(f"{mutation.name}: PATTERN {reason}")
            failed += 1
    if failed:
        return 1

    copy_tree()
    tests = tuple(sorted({test for m in chosen for test in m.tests}))
    built, output = build(tests, 12 * PATIENCE)
    if not built:
        print(f"the unbroken program does not compile\n{output[-3000:]}")
        return 1
    if red := [test for test in tests if not green(test)]:
        print(f"red without any break: {', '.join(red)}")
        return 1

    for mutation in chosen:
        killed, words = verdict(mutation)
        failed += not killed
        print(f"{mutation.name}: {words}", flush=True)
    print(f"{len(chosen) - failed} of {len(chosen)} breaks noticed")
    return 1 if failed or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
