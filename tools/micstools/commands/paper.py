"""The ensemble of the paper: `tools/paper_ensemble.py`."""

import argparse
import csv
import os
from pathlib import Path
from typing import Any

from micstools import files
from micstools.cases import program
from micstools.commands.base import Command
from micstools.commands.ensemble import ENSEMBLE
from micstools.commands.pile import PILE
from micstools.commands.report import REPORT
from micstools.ensembles import paper_ensemble
from micstools.ensembles.paper_ensemble import CHOICES, Choice

CASE = Path(__file__).parents[3] / "input" / "blocks.nml"
COARSE = "grid.cells=60,10,20"  # a fifth of the time


def arguments(parser: argparse.ArgumentParser) -> None:
    """How many runs, and where they go."""
    add = parser.add_argument
    add("--case", type=Path, default=CASE, help="default input/blocks.nml")
    add("--set", action="append", default=[], metavar="GROUP.VARIABLE=VALUE", help="in the case; "
        "drop.if_blocked=raise lets drops go on above a pile that fills their place")  # fmt: skip
    add("--runs", type=int, default=50, help="drops of six blocks, default 50")
    add("--moves", type=int, default=0, help="runs of each choice that may move the shares, on "
        f"coarse cells ({COARSE}); default 0")  # fmt: skip
    add("--jobs", type=int, default=os.cpu_count() or 1, help="at once, one core each")
    add("--out", type=Path, default=Path("mics-paper-ensemble"), help="folder")
    add("--program", type=Path, help="default: the mics that make has built")


def work(given: argparse.Namespace) -> int:
    """Run what is missing, tell the shares and write `shares.csv` and `shares.md`."""
    folder: Path = given.out
    case = program.case_text(given.case, given.set)
    code = _ensemble(given, CHOICES[0], case, folder / "drops", given.runs)
    if code:
        return code
    _call(PILE, str(folder / "drops"))
    _call(REPORT, str(folder / "drops"))
    first = f"{given.case.name}, {', '.join(given.set) or 'as it is'}"
    rows = [paper_ensemble.row_of(first, folder / "drops")]
    _write(folder, rows)
    quick = program.case_text(given.case, [*given.set, COARSE])
    for choice in CHOICES if given.moves else ():
        code = _ensemble(given, choice, quick, folder / choice.name, given.moves)
        if code:
            return code
        rows.append(paper_ensemble.row_of(f"coarse: {choice.words}", folder / choice.name))
        _write(folder, rows)
    print(paper_ensemble.as_markdown(rows), end="")
    return 0


def _ensemble(given: argparse.Namespace, choice: Choice, case: str, folder: Path, runs: int) -> int:
    """Run what an ensemble lacks; its exit code."""
    print(f"-- {choice.words}")
    path = folder.with_suffix(".nml")
    path.parent.mkdir(parents=True, exist_ok=True)
    files.write(path, choice.text(case))
    other = ("--program", str(given.program)) if given.program else ()
    words = ("--runs", str(runs), "--jobs", str(given.jobs), "--out", str(folder))
    return _call(ENSEMBLE, str(path), *words, *choice.options, *other)


def _call(command: Command, *words: str) -> int:
    parser = argparse.ArgumentParser(prog=command.name)
    command.arguments(parser)
    return command.work(parser.parse_args(words))


def _write(folder: Path, rows: list[dict[str, Any]]) -> None:
    files.write(folder / "shares.md", paper_ensemble.as_markdown(rows))
    with (folder / "shares.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
