"""The same case on coarser and finer cells."""

import argparse
import json
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from micstools import files
from micstools.cases import case_copy, program, settings
from micstools.cases.convergence import Convergence, converge
from micstools.piles import maps, pile_ensemble, pile_numbers
from micstools.reading import units
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import Unit, Units, ascii_of

_ENDED = (0, 3)  # codes of a run that would end in the same way again


def finer(text: str, factor: float) -> tuple[str, float]:
    """The case with `factor` times its cells in each direction that has more than one, and how many
    times that is on average, as counts are whole."""
    cells = settings.value(text, "grid", "cells")
    if not isinstance(cells, list) or not all(isinstance(n, int) for n in cells):
        raise BadRun("the case has no &grid cells = nx, ny, nz: there is nothing to refine")
    wanted = [n if n == 1 else max(1, round(factor * n)) for n in cells]
    ratios = [new / n for new, n in zip(wanted, cells, strict=True) if n > 1]
    text = settings.set_group(text, "grid", {"cells": wanted})
    return text, float(np.prod(ratios)) ** (1 / max(1, len(ratios)))


def _run(path: Path, text: str, folder: Path, threads: int | None) -> Run:
    """Run a case in a folder to its end, unless that is there already."""
    case, result = folder / "case.nml", folder / "result"
    case_copy.keep(case, text)
    if _code(result) not in _ENDED:
        words: list[str | Path] = [path, "--output", result, "--quiet", case]
        words[1:1] = ["--threads", str(threads)] if threads is not None else []
        code = program.wait(subprocess.Popen(words))
        if code not in _ENDED:
            raise BadRun(f"{case}: the run ended with code {code}")
    return Run(result)


def _code(result: Path) -> int:
    """Exit code of a run, -1 while it has none."""
    if not (result / "run.h5").is_file():
        return -1
    return int(Run(result).provenance.get("exit_status", -1))


def work(given: argparse.Namespace) -> int:
    try:
        factors = [float(part) for part in given.cells.split(",")]
    except ValueError:
        raise BadRun(f"--cells {given.cells}: must be numbers parted by commas") from None
    if not all(a < b for a, b in zip([0.0, *factors], factors, strict=False)):
        raise BadRun(f"--cells {given.cells}: must be positive and rise")
    text = program.case_text(given.case, given.settings)
    path = program.find(given.program, given.case)
    folder = given.out or Path(f"mics-study-{given.case.stem}")
    cases = [finer(text, factor) for factor in factors]
    for each, _ in cases:
        program.check(path, each)
    if len({fine for _, fine in cases}) < len(cases):
        raise BadRun(f"--cells {given.cells}: two of them are the same cells")
    whole, found = [], []
    for factor, (each, fine) in zip(factors, cases, strict=True):
        print(f"cells x {factor:g}: {folder}/{factor:g}", flush=True)
        run = _run(path, each, folder / f"{factor:g}", given.threads)
        if _code(run.folder) != 0:
            print(f"mics-tools study: {run.folder} ended with code 3, a fault of the numerics or "
                  "blocks without room: left out", file=sys.stderr)  # fmt: skip
            continue
        whole.append(fine)
        found.append(pile_ensemble.flat(pile_numbers.numbers(run, maps.usual_step(run))))
    if found:
        _tell(folder, whole, found, units.of_run(run))
    return 0 if len(whole) == len(factors) else 3


def _tell(
    folder: Path, factors: list[float], found: list[dict[str, float | str]], chosen: Units
) -> None:
    """Print a line for each number with its unit and write `study.csv` and `study.json` in SI
    units."""
    rows: list[dict[str, object]] = []
    for name in found[0]:
        values = [float(numbers[name]) if numbers[name] != "" else np.nan for numbers in found]
        told = converge(factors, values)
        row: dict[str, object] = {"number": name}
        row["unit"] = pile_numbers.si_units([name]).get(name, "")
        row |= {f"cells x {k:g}": value for k, value in zip(factors, values, strict=True)}
        rows.append(row | asdict(told))
        unit = pile_numbers.unit(chosen, name)
        print(ascii_of(f"     {name:20}{unit.row(values, digits=5)}  {_words(told, unit)}"))
    known = [{k: None if v != v else v for k, v in row.items()} for row in rows]
    files.write(folder / "study.json", json.dumps(known, indent=2) + "\n")
    print(files.write_table(folder / "study.csv", rows))


def _words(told: Convergence, unit: Unit) -> str:
    change = replace(unit, decimals=None)  # of a place, is none
    if told.words:
        found = f", range {change.text(told.range, 2)}" if told.range == told.range else ""
        return f"({told.words}{found})"
    limit, error = unit.text(told.limit, 5), change.text(told.error, 2)
    sign = "+" if told.error > 0 else ""
    return f"order {told.order:.2f}, limit {limit}, error {sign}{error}"
