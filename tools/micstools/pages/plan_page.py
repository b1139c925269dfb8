"""The page of a case before it is computed: what stands where, what comes when, what the program
warns of, how long it takes and how much memory."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from micstools.pages import motion, run_words
from micstools.pages.html import Markup, data, document, facts, section, table, tag
from micstools.pages.parts import north_note, player, swatch
from micstools.pages.set_up import Part, Remark, SetUp
from micstools.pages.views import block_colours
from micstools.reading import units
from micstools.reading.reader import Run
from micstools.reading.units import Units, figure
from micstools.shapes.geometry import Array

START = """
const planPlayer = startPlan(document.getElementById('player'));
if (planPlayer) planPlayer.load(read('scene'));
"""
SCRIPTS = ("plan",)
_TIMED = 12  # blocks to come whose labels bear their times; more would hide the picture
_MARKED = 40  # blocks of a group that its warning marks
_LINES = 160  # faces of cells that are drawn in a direction
_COLOUR = "#8560b8"  # of ways and reaches
_LONG = 90  # letters of a text of the plan that takes the whole width
_ROWS = 300  # of the table of blocks to come


def page(found: SetUp, name: str, north: float | None = None) -> str:
    """The page of a set-up as text. `name`: of the case where it has no title; `north`: its
    direction in the plan, degrees from +y towards +x."""
    title = found.run.value("run", "title") or name
    return document(
        title,
        tag("h1", title),
        tag("p", lead(found), class_="lead"),
        *content(found, north),
        section("case", "The case file", tag("pre", found.text)),
        data("scene", scene(found, north)),
        script=START,
        more=SCRIPTS,
    )


def content(found: SetUp, north: float | None = None) -> list[Markup | None]:
    """The parts of the page, the player first."""
    label = "the set-up; arrow keys turn it, + and - zoom, space plays"
    return [player("player", label, plan=True), north_note(north), *parts(found).values()]


def parts(found: SetUp) -> dict[str, Markup | None]:
    """What is said of a set-up: warnings, figures, blocks, plan."""
    # The plan in the words of the program
    said = tag("div", *(_part(part) for part in found.plan), class_="parts")
    return {
        "warnings": _warnings(found),
        "facts": _facts(found),
        "blocks": _blocks(found),
        "plan": section("plan", "The plan", said),
    }


def lead(found: SetUp) -> str:
    """What comes, in a sentence."""
    run = found.run
    chosen = units.of_run(run)
    n = len(found.warnings)
    said = "The program accepts this case"
    said += f" with {run_words.count(n, 'warning')}. " if n else ". "
    if not run.bodies.n:
        return said + "There are no blocks in it."
    return said + run_words.blocks(run, chosen)


def _facts(found: SetUp) -> Markup:
    cells = found.entry("Tank", "cells")
    memory, _, there = found.entry("Memory", "about").partition(" of ")
    time = found.entry("Time steps", "time of the run").removeprefix("about ")
    b, shown = found.run.bodies, units.of_run(found.run)
    time, _, cores = time.partition(" on ")
    pairs: list[tuple[str, object, str]] = [
        ("computing time", time, f"on {cores}, an estimate"),
        ("memory", memory, f"of {there}" if there else ""),
        ("simulated time", found.entry("Run", "simulated time"),
         found.entry("Time steps", "largest")),
    ]  # fmt: skip
    if cells:
        pairs.append(("cells", cells.split(" = ")[-1], cells.split(" = ")[0]))
    if b.n:
        free = b.mass[~b.fixed]
        words = f"{run_words.count(int(b.fixed.sum()), 'fixed block')} besides"
        pairs.append(("blocks", f"{free.size}", f"{shown.mass.text(float(free.sum()))}; {words}"))
    return facts(pairs)


def _warnings(found: SetUp) -> Markup | None:
    """What the program warns of, each with a button that shows where."""
    if not found.warnings:
        return None
    marked = {mark["number"] for mark in marks(found)}
    rows = [
        tag(
            "li",
            tag("button", str(n), type="button", data_mark=n, aria_label=f"show where: {w.text}")
            if n in marked
            else tag("b", str(n)),
            tag(
                "span",
                w.text,
                tag("button", w.place, type="button", class_="line", data_line=w.line)
                if w.line
                else w.place,
            ),
        )
        for n, w in enumerate(found.warnings, 1)
    ]
    title = run_words.capital(run_words.count(len(rows), "warning"))
    return section("warnings", title, tag("ol", *rows, class_="remarks"))


def _blocks(found: SetUp) -> Markup | None:
    """A row for the blocks of each group of the case."""
    b = found.run.bodies
    if not b.n:
        return None
    shown = units.of_run(found.run)
    colours = block_colours(b.dropped, b.n)
    rows = [_row(found, blocks, shown, colours[blocks[0] + 1]) for blocks in _groups(found)]
    length = shown.length.name
    heads: list[object] = ["blocks", "shape", "from [s]", f"place x, y, z [{length}]",
                           f"at random up to [{length}]", "line of the case"]  # fmt: skip
    more = len(rows) - _ROWS
    note = tag("p", f"and {more} more groups", class_="note") if more > 0 else None
    return section("blocks", "Blocks", table(heads, rows[:_ROWS], numbers=False), note)


def _row(found: SetUp, blocks: list[int], shown: Units, colour: str) -> list[object]:
    run, k = found.run, blocks[0]
    due, length = run.bodies.release_time[blocks], shown.length
    several = f"{k + 1} to {blocks[-1] + 1}" if len(blocks) > 1 else str(k + 1)
    when = figure(float(due[0]))
    if due[-1] > due[0]:
        when += f" to {figure(float(due[-1]))}"
    places = [", ".join(shown.place.figure(v) for v in found.place[m]) for m in (k, blocks[-1])]
    where = " → ".join(dict.fromkeys(places))
    random = found.spread[blocks].max(axis=0)
    shift = ", ".join("±" + length.figure(v) if v else "0" for v in random) if random.any() else "–"
    names = ", ".join(dict.fromkeys(run.bodies.shape[m] for m in blocks))
    held = " (fixed)" if run.bodies.fixed[k] else ""
    return [swatch(colour, several), names + held, when, where, shift, int(found.line[k]) or "–"]


def _groups(found: SetUp) -> Iterator[list[int]]:
    """Numbers, from 0, of the bodies of each group of the case, in order."""
    blocks: list[int] = []
    for k in range(found.run.bodies.n):
        if blocks and found.line[k] != found.line[blocks[0]]:
            yield blocks
            blocks = []
        blocks.append(k)
    if blocks:
        yield blocks


def _part(part: Part) -> Markup:
    heading = tag("h3", part.heading)
    rows: list[list[object]] = [[name, text] for name, text in part.pairs]
    if part.table:
        return tag("div", heading, tag("pre", part.table), class_="wide")
    if len(max((text for _, text in part.pairs), key=len)) > _LONG:
        return tag("div", heading, table(["", ""], rows, numbers=False), class_="plan wide")
    return tag("div", heading, table(["", ""], rows, numbers=False), class_="plan")


def scene(found: SetUp, north: float | None = None) -> dict[str, Any]:
    """What the player needs: the scene of a run, and what comes."""
    run = found.run
    rows = np.arange(len(run.bodies.time))
    packed = motion.tank(run, north) | motion.blocks(run, rows) | {"water": _water(run)}
    b = run.bodies
    come = [k for k in range(b.n) if b.release_time[k] > 0 or k >= _placed(run)]
    if len(rows) == 1 and (last := float(b.release_time.max(initial=0.0))) > 0:
        still = motion.blocks(run, np.array([0, 0]))
        packed |= still | {"times": motion.packed([0.0, last], "f4")}
    for k in come if len(come) <= _TIMED else []:
        block = packed["bodies"][k]
        block["label"] = f"{block['number']}: {figure(float(b.release_time[k]))} s"
    for k in come:
        if b.release_time[k] <= 0:  # it comes in at the start, and is a ghost before
            packed["bodies"][k]["release"] = 1e-6
    # Two corners [m] of each box that the centroids of blocks to come may start in
    place = found.place - found.run.grid.low
    boxes = np.stack([place - found.spread, place + found.spread], axis=1)
    return packed | {
        "plan": {
            "cells": _cells(run) if _wet(run) else [[], [], []],
            "reach": [box.tolist() for box in np.unique(boxes[found.spread.any(axis=1)], axis=0)],
            "liquid": _boxes(run),
            "ways": _ways(found),
            "marks": marks(found),
            "colour": _COLOUR,
        }
    }


def _placed(run: Run) -> int:
    """How many bodies the groups &body have."""
    return len(run.parameters.get("body", []))


def _wet(run: Run) -> bool:
    return run.physics in ("coupled", "fluid")


def _cells(run: Run) -> list[list[float]]:
    """Faces between cells in x, y, z, from the lower corner of the tank [m]; every second, third,
    ... where they are many."""
    found = []
    for faces in run.grid.faces:
        step = max(1, int(np.ceil((len(faces) - 1) / _LINES)))
        found.append([round(float(v), 9) for v in faces[step:-1:step] - faces[0]])
    return found


def _water(run: Run) -> dict[str, Any] | None:
    """The level of the water at the start."""
    if run.physics == "dry":
        return None
    low, high = float(run.grid.low[2]), float(run.grid.high[2])
    if run.value("fluid", "single_phase"):
        return {"level": high - low}
    level = run.value("fluid", "water_level")
    if level is None or not low < float(level):
        return None
    return {"level": min(float(level), high) - low}


def _boxes(run: Run) -> list[list[list[float]]]:
    """Two corners [m] of each box of liquid, as far as it is in the tank."""
    if not _wet(run):
        return []
    low, high = run.grid.low, run.grid.high
    return [
        [(np.clip(box[end], low, high) - low).tolist() for end in ("min", "max")]
        for box in run.parameters.get("water", [])
    ]


def _ways(found: SetUp) -> list[dict[str, Any]]:
    """The ways [m] of crane and barge: the places of blocks to come one after another, of several
    groups &drop in one where one begins when the other has ended; and of bodies that move as
    prescribed."""
    run = found.run
    b, due = run.bodies, run.bodies.release_time
    drops = [g for g in _groups(found) if g[0] >= _placed(run)]
    tours: list[list[int]] = []
    for group in sorted(drops, key=lambda g: float(due[g].min())):
        if tours and due[tours[-1]].max() <= due[group].min():
            tours[-1] += group
        else:
            tours.append(list(group))
    said: list[tuple[Array, Array, str]] = []
    for tour in tours:
        order = sorted(tour, key=lambda k: float(due[k]))
        span = f"{min(tour) + 1}–{max(tour) + 1}" if len(tour) > 1 else f"{tour[0] + 1}"
        said.append((found.place[order], due[order], f"drops {span}"))
    for k in np.flatnonzero(b.fixed):
        said.append((b.position[:, k], b.time, f"body {k + 1}"))
    return [
        {"way": (way - run.grid.low).tolist(), "when": when.tolist(), "name": name}
        for way, when, name in said
        if np.ptp(way, axis=0).any()
    ]


def marks(found: SetUp) -> list[dict[str, Any]]:
    """Where the warnings belong: their numbers, from 1, bodies, from 0, and places [m]."""
    said = []
    for number, remark in enumerate(found.warnings, 1):
        bodies, places = found.bodies_of(remark), _places(found.run, remark)
        if bodies or places:
            said.append({"number": number, "bodies": bodies[:_MARKED], "at": places})
    return said


def _places(run: Run, remark: Remark) -> list[list[float]]:
    """The middle of a side of the tank, of the surface, or of the tank that a warning concerns."""
    low, high = run.grid.low, run.grid.high
    middle = (low + high) / 2
    if remark.group == "boundary" and remark.variable[:1] in ("x", "y", "z"):
        d = "xyz".index(remark.variable[0])
        middle[d] = low[d] if "min" in remark.variable else high[d]
    elif (remark.group, remark.variable) == ("fluid", "water_level"):
        level = run.value("fluid", "water_level")
        middle[2] = middle[2] if level is None else np.clip(float(level), low[2], high[2])
    elif remark.group != "grid":
        return []
    return [(middle - low).tolist()]
