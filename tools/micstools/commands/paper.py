"""The ensemble of the paper: `tools/paper_ensemble.py`."""

import argparse
from pathlib import Path
from typing import Any

from micstools import files
from micstools.cases import program
from micstools.commands.base import Parser
from micstools.ensembles import paper_ensemble
from micstools.ensembles.paper_ensemble import CHOICES, Choice

CASE = Path(__file__).parents[3] / "input" / "blocks.nml"
COARSE = "grid.cells=60,10,20"  # a fifth of the time


def work(given: argparse.Namespace) -> int:
    """Run what is missing, tell the shares and write `shares.csv` and `shares.md`."""
    folder: Path = given.out
    case = program.case_text(given.case, given.set)
    code = _ensemble(given, CHOICES[0], case, folder / "drops", given.runs)
    if code:
        return code
    for command in ("pile", "report"):
        Parser(command).call([str(folder / "drops")])
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
    return Parser("ensemble").call([str(path), *words, *choice.options, *other])


def _write(folder: Path, rows: list[dict[str, Any]]) -> None:
    files.write(folder / "shares.md", paper_ensemble.as_markdown(rows))
    files.write_table(folder / "shares.csv", rows)
