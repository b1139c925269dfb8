"""What can be said of the pile of a run, or of the piles of an ensemble."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from micstools import command, files
from micstools.piles import maps, options, pile, pile_ensemble, pile_form, pile_numbers, placing
from micstools.piles.handover import Handover
from micstools.piles.pile_ensemble import Ensemble
from micstools.piles.placing import Area
from micstools.reading import block_numbers, units
from micstools.reading.reader import BadRun
from micstools.reading.shares import in_words
from micstools.reading.units import ascii_of
from micstools.shapes.geometry import Array


def findings(given: argparse.Namespace) -> int:
    """Print the findings."""
    run = command.open_run(given.run)
    if run.note:
        print(f"     {run.note}")
    print(pile.report(pile.findings(run, paper=given.paper or None)))
    return 0


def area_of(values: list[float] | None) -> Area | None:
    """The area that a user gave."""
    return Area((values[0], values[1]), (values[2], values[3]), True) if values else None


def box_of(values: list[float] | None) -> tuple[Array, Array] | None:
    """The corners of the box that a user gave."""
    return (np.array(values[:3]), np.array(values[3:])) if values else None


def work(given: argparse.Namespace) -> int:
    if pile_ensemble.is_ensemble(given.run):
        if given.paper:
            raise BadRun("--paper: for one run, not for an ensemble")
        told = options.told(given.run, given)
        options.keep(told, given.run)
        box, area = box_of(given.box), area_of(told.area)
        return _of_ensemble(pile_ensemble.open_ensemble(given.run, given.step, box, area, told))
    return _of_run(given)


def _of_run(given: argparse.Namespace) -> int:
    """Print the findings and the numbers in units by the size of the blocks; in SI units these and
    the outline go into `pile.json`, the height map into `pile_maps.h5`."""
    box = box_of(given.box)
    findings(given)
    run = command.open_run(given.run)
    told = options.told(run.folder, given)
    told.corners(run)  # refused before anything is written
    options.keep(told, run.folder)
    step = given.step or maps.usual_step(run)
    numbers, chosen = pile_numbers.numbers(run, step, box=box, told=told), units.of_run(run)
    found = asdict(numbers)
    for name, value in found.items():
        values = value if isinstance(value, tuple) else (value,)
        meaning = pile_numbers.MEANING.get(name, "")
        print(f"     {name:20}{pile_numbers.words(chosen, name, values)}{meaning}")
    top = maps.top_of(run, step)
    x, y = (run.grid.low[d] + (np.arange(top.shape[1 - d]) + 0.5) * step for d in (0, 1))
    _write_h5(run.folder / "pile_maps.h5", {"x": x, "y": y, "top": top})
    found["note"] = run.note
    handed = Handover(run, told)
    print(ascii_of("\n".join(f"     {line}" for line in handed.words(chosen))))
    found |= handed.about
    found["units"] = pile_numbers.si_units(found)
    found["outline"] = [line.tolist() for line in pile_form.outline(top, run.grid.low, step)]
    found["of_blocks"] = [asdict(k) for k in block_numbers.of_blocks(run)]
    write_json(run.folder / "pile.json", found)
    return 0


def _of_ensemble(ensemble: Ensemble) -> int:
    """Print shares and spread of the numbers, for each choice; they go into `pile.json`, a row for
    each run into `pile.csv`, the maps into `pile_maps.h5`."""
    if ensemble.example.run.note:
        print(f"     {ensemble.example.run.note}")
    if ensemble.left_out:
        print(ensemble.left_words)
    for part in ensemble.parts:
        # Print what there is to say of the runs of one choice
        total = len(part.piles)
        head, chosen = f"{part.name}: " if part.name else "", part.units
        if found := part.placing:
            print(head + ascii_of(placing.words(found, chosen)))
        if part.has_patterns:
            shares = pile_ensemble.pattern_shares(part.piles)
            said = [f"{k} {in_words(s['count'], total)}" for k, s in shares.items()]
            print(head + ", ".join(said))
        print(f"numbers of the {len(part.whole)} complete piles of {total}:")
        print(f"     {'':20}median [its 95 % interval] (5 to 95 % of the piles)")
        for name, spread in pile_ensemble.spreads(part).items():
            unit = pile_numbers.unit(chosen, name)
            low, high, first, last = (
                unit.figure(spread[k], 5) for k in ("5 %", "95 %", "median low", "median high")
            )
            median = unit.text(spread["median"], 5)
            print(ascii_of(f"     {name:20}{median} [{first} to {last}] ({low} to {high})"))
    path = files.write_table(ensemble.folder / "pile.csv", pile_ensemble.rows(ensemble))
    if ensemble.whole:
        # The maps; where variables were varied in a group for each choice, named by it
        maps: dict[str, Array] = {}
        for part in ensemble.parts:
            if part.whole:
                here = f"{part.name}/" if part.name else ""
                maps |= {here + k: v for k, v in asdict(pile_ensemble.maps(part)).items()}
        _write_h5(ensemble.folder / "pile_maps.h5", maps)
    print(path)
    write_json(ensemble.folder / "pile.json", pile_ensemble.summary(ensemble))
    return 0


def _write_h5(path: Path, found: dict[str, Array]) -> None:
    with h5py.File(path, "w") as h5:
        for name, values in found.items():
            h5[name] = values
            h5[name].attrs["units"] = "-" if name.endswith("cover") else "m"
    print(path)


def write_json(path: Path, content: dict[str, Any]) -> None:
    files.write(path, json.dumps(files.known(content), indent=2, allow_nan=False) + "\n")
    print(path)
