"""Where units lie, as a survey hands it over."""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from contourpy import contour_generator

from micstools import command, extras, files
from micstools.commands.pile import write_json
from micstools.piles import drawing, handover, options, pile_ensemble
from micstools.piles.handover import Handover
from micstools.piles.options import Options
from micstools.piles.pile_ensemble import Ensemble
from micstools.reading import places, units
from micstools.reading.places import Survey
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import ascii_of
from micstools.shapes import height_maps

WRITERS = handover.WRITERS | {"svg": drawing.write, "pdf": drawing.write}
FORMATS = (*WRITERS, "asc")
CONTOURS = (0.1, 0.5, 0.9)
"""Probabilities of cover that lines are drawn around."""


def work(given: argparse.Namespace) -> int:
    formats = [word.strip().lower() for word in given.to.split(",")]
    for word in formats:
        if word not in FORMATS:
            raise BadRun(f"--to {given.to}: '{word}' is none of {', '.join(FORMATS)}")
    if given.crs:
        handover.crs_name(given.crs)
    if "dxf" in formats:
        extras.need("survey")
    ensemble = pile_ensemble.is_ensemble(given.run)
    if ensemble and (given.area or given.layers):
        raise BadRun("--area, --layers: for one run, not for an ensemble")
    of_results = given.run if ensemble else command.open_run(given.run).folder
    found = options.told(of_results, given)
    if not ensemble:
        found.corners(Run(of_results))
    if "asc" in formats and found.survey.north:
        raise BadRun("--to asc: a raster has its rows along east; with --north there is none")
    options.keep(found, of_results)
    return (_of_ensemble if ensemble else _of_run)(given, formats, found)


def ask_for_system(run: Run, survey: Survey) -> None:
    """Coordinates of a survey mean a place on Earth only with their system."""
    corner = survey.of(run.grid.low[:2])
    if survey.crs or not (np.abs(corner) > height_maps.SURVEY).any():
        return
    print(f"of which system are coordinates like {corner[0]:.0f}, {corner[1]:.0f}? --crs EPSG:CODE "
          "notes it; without it a GIS takes GeoJSON for degrees", file=sys.stderr)  # fmt: skip


def _of_run(given: argparse.Namespace, formats: list[str], chosen: Options) -> int:
    run, survey = command.open_run(given.run), chosen.survey
    if not run.bodies.n:
        raise BadRun(f"{run.folder} holds no blocks: there are no places")
    ask_for_system(run, survey)
    folder = given.out or run.folder
    folder.mkdir(parents=True, exist_ok=True)
    handed, shown = Handover(run, chosen), units.of_run(run)
    found, maps = handed.places, handed.maps
    about: dict[str, Any] = {"survey": asdict(survey), "columns": places.MEANING}
    about |= handed.about
    # How many units lie still
    free = [p for p in found if not p.fixed]
    out = [str(p.unit) for p in free if p.exit_time == p.exit_time]
    waiting = [str(p.unit) for p in free if p.time != p.time]
    moving = [str(p.unit) for p in free if p.x == p.x and not p.at_rest]
    print(f"{len(free)} free units, {sum(p.at_rest for p in free)} of them at rest"
          + (f"; moving: {some(moving)}" if moving else "")
          + (f"; out of the tank: {some(out)}" if out else "")
          + (f"; not released: {some(waiting)}" if waiting else ""))  # fmt: skip
    print(ascii_of("\n".join(handed.words(shown))))
    for name in formats:
        path = folder / f"places.{name}"
        if name == "asc":
            if maps is not None:
                level = survey.origin[2]
                mean = path.with_name("places-mean.asc")
                for file, surface in ((path, maps.ball), (mean, maps.seen)):
                    print(handover.raster(file, surface + level, survey, maps.low, maps.step))
        else:
            print(WRITERS[name](handed, path))
    write_json(folder / "places.json", about)
    return 0


def some(numbers: list[str]) -> str:
    """The first ten of them, and how many more."""
    more = len(numbers) - 10
    return ", ".join(numbers[:10]) + (f" and {more} more" if more > 0 else "")


def _of_ensemble(given: argparse.Namespace, formats: list[str], chosen: Options) -> int:
    """A table of all places, one of the landings of each unit; the other files for each choice."""
    if drawn := sorted({"svg", "pdf"} & set(formats)):
        raise BadRun(f"--to {','.join(drawn)}: drawings are of one run, not of an ensemble")
    whole, survey = pile_ensemble.open_ensemble(given.run), chosen.survey
    folder = given.out or whole.folder
    folder.mkdir(parents=True, exist_ok=True)
    all_places, all_landings, about = [], [], []
    ask_for_system(whole.example.run, survey)
    if whole.about.get("start"):
        print("no landings: units differ from load to load")
    if whole.left_out:
        print(whole.left_words)
    for number, part in enumerate(whole.parts, start=1):
        stem = "places" if len(whole.parts) == 1 else f"places-{number}"
        each, tolerance = pile_ensemble.places_of(part, survey, chosen.tolerance)
        found = [] if whole.about.get("start") else places.landings(each, tolerance)
        within = places.within([p for one in each for p in one], tolerance)
        if places.has_plan(part.example.run):
            head = f"{part.name}: " if part.name else ""
            print(head + ascii_of(places.share_words(within, part.units.length)))
        choice = part.choices[0]
        all_places += [{"run": n} | choice | places.row_of(row)
                       for n, one in zip(part.runs, each, strict=True) for row in one]  # fmt: skip
        all_landings += [choice | handover.landing_row(one) for one in found]
        about.append({"choice": choice, "within": asdict(within) | {"share": within.share},
                      "landings": [asdict(one) for one in found]})  # fmt: skip
        _draw(given, formats, survey, part, folder / stem, found)
    if "csv" in formats:
        print(files.write_table(folder / "places.csv", all_places))
        if all_landings:
            print(files.write_table(folder / "landings.csv", all_landings))
    write_json(folder / "places.json", {"survey": asdict(survey), "columns": places.MEANING,
               "ellipse": places.ELLIPSE, "choices": about})  # fmt: skip
    return 0


def _draw(given: argparse.Namespace, formats: list[str], survey: Survey, part: Ensemble,
          stem: Path, found: list[places.Landing]) -> None:  # fmt: skip
    """The ellipses of a choice, and how likely a unit lies over a point, of its complete piles."""
    cover = np.isfinite([p.top for p in part.whole or part.piles]).mean(axis=0)
    lines = contours(cover, part.example.run.grid.low, part.step, survey)
    for name in formats:
        path = stem.with_name(f"{stem.name}.{name}")
        if name == "geojson":
            print(handover.landings_to_geojson(found, lines, path, survey.crs))
        elif name == "dxf":
            print(handover.landings_to_dxf(found, lines, path, survey.crs))
        elif name == "asc":
            low = part.example.run.grid.low
            print(handover.raster(path, cover, survey, low, part.step))


def contours(cover: Any, low: Any, step: float, survey: Survey) -> dict[float, list[Any]]:
    """Lines (k, 2) in the survey around where the cover (ny, nx) is at least a probability."""
    lines = contour_generator(z=np.pad(cover, 1))
    return {
        p: [survey.of(low[:2] + (np.asarray(line, float) - 0.5) * step) for line in lines.lines(p)]
        for p in CONTOURS
    }
