"""The page of an ensemble: where blocks will lie and how far they scatter, how much piles differ,
whether the runs were enough, and every pile to look at; the shares of the paper's patterns where
blocks drop on its three fixed ones."""

import json
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from micstools import files
from micstools.pages import charts, motion, run_page, run_words, views
from micstools.pages.html import Markup, data, document, download, markup, section, table, tag
from micstools.pages.parts import north_note, number, player
from micstools.pages.run_words import count
from micstools.piles import drawing, pile, pile_ensemble, placing
from micstools.piles.options import Options
from micstools.piles.pile_ensemble import MEANING, PATTERNS, Ensemble, Pile
from micstools.reading import health, places
from micstools.reading.health import Check
from micstools.reading.overlap import present_bodies, without_machines
from micstools.reading.places import Survey
from micstools.reading.reader import Run
from micstools.reading.shares import in_words
from micstools.reading.units import Units, figure

_SAID = {
    "A": "runs every dropped block ends off the floor (pattern A)",
    "B": "at least one more comes down to it (B)",
    "neither": "a block finds no room or stays above the water (neither)",
}
_SMALL = 220  # pixels of a small picture


@dataclass(frozen=True)
class Quantity:
    """A number that is shown as a histogram."""

    name: str
    kind: str  # what it is, as `Units` names it
    value: Callable[[Pile], float]

    def heading(self, units: Units) -> str:
        """Its name and unit."""
        unit = units.of_kind(self.kind).name
        return f"{self.name} [{unit}]" if unit else self.name


_QUANTITIES = (
    Quantity("height of the pile", "length", lambda p: p.numbers.height),
    Quantity("layer thickness", "length", lambda p: p.numbers.layer_thickness),
    Quantity("plan area covered", "area", lambda p: p.numbers.plan_area),
    Quantity("footprint", "area", lambda p: p.numbers.footprint),
    Quantity("contacts per block", "number", lambda p: p.numbers.coordination),
    Quantity("void share of the layer", "number", lambda p: p.numbers.layer_porosity),
    Quantity("layer thickness by a ball of D_n/2", "length", lambda p: p.numbers.thickness_ball),
    Quantity("layer coefficient by that ball", "number", lambda p: p.numbers.coefficient_ball),
    Quantity("time to rest", "time", lambda p: p.numbers.time_to_rest),
    Quantity("hardest contact", "force", lambda p: p.numbers.contact_force),
)


def page(ensemble: Ensemble, told: Options = Options()) -> str:  # noqa: B008 (it is frozen)
    """The page of an ensemble as text."""
    run, north = ensemble.example.run, told.north
    title = f"{run_words.title(run, ensemble.folder)}: {count(len(ensemble.piles), 'run')}"
    return document(
        title,
        tag("h1", title),
        *(tag("p", sentence(part), class_="lead") for part in ensemble.parts),
        tag("p", assumptions(ensemble)),
        *([_plan(ensemble, told.survey)] if ensemble.whole else []),
        *([] if ensemble.about.get("start") else [_landings(ensemble, told)]),
        *([_patterns(ensemble)] if ensemble.has_patterns else []),
        *([_histograms(ensemble)] if ensemble.whole else []),
        _wall(ensemble),
        north_note(north),
        _running(ensemble),
        _health(ensemble),
        _case(ensemble, run),
        _table(ensemble),
        data("piles", _scenes(ensemble, north)),
        more=("ensemble",),
    )


def sentence(ensemble: Ensemble) -> str:
    """Where the blocks of one choice lie, the shares of the patterns where these mean something,
    and the height of the piles."""
    units, total = ensemble.units, len(ensemble.piles)
    head = f"With {ensemble.name}: " if ensemble.name else ""
    where = ensemble.placing
    said = [placing.words(where, units)] if where else ["No block was let go."]
    if ensemble.has_patterns:
        shares = pile_ensemble.pattern_shares(ensemble.piles)
        each = [f"in {in_words(shares[k]['count'], total)} {words}" for k, words in _SAID.items()]
        said.append(f"{run_words.capital(', '.join(each))} (in brackets: share and 95 % interval).")
    elif missing := total - len(ensemble.whole):
        said.append(f"In {in_words(missing, total)} runs not all blocks found room.")
    said.append(_heights([p.numbers.height for p in ensemble.whole], units))
    words = head + " ".join(said)
    for unit in ("%", units.length.name):
        words = words.replace(f" {unit}", f"\u00a0{unit}")
    return words


def _heights(heights: list[float], units: Units) -> str:
    """The heights [m] of the complete piles in words."""
    length = units.length
    if not heights:
        return "No pile has all its blocks, so there is no mean pile."
    if len(heights) == 1:
        return f"The one complete pile is {length.text(heights[0])} high."
    low, median, high = np.percentile(heights, [5, 50, 95])
    return (
        f"Half of the {len(heights)} complete piles are higher than {length.text(median)}, and "
        f"90 % are between {length.figure(low)} and {length.text(high)} high."
    )


def assumptions(ensemble: Ensemble) -> str:
    """What the shares rest on."""
    run = ensemble.example.run
    varied = sorted({name for choice in ensemble.choices for name in choice})
    # Friction and restitution, where they were the same in all runs
    known = {"friction": "friction of blocks", "wall_friction": "friction of walls and floor"}
    if run.value("contact", "law") == "restitution":
        known["restitution"] = "restitution"
    kept = [f"{words} {run.value('contact', name):.3g}" for name, words in known.items()
            if f"contact.{name}" not in varied]  # fmt: skip
    said = ["This rests on what was assumed: " + ", ".join(kept)]
    said += run_words.drops(run, ensemble.units, seeds=False)
    cells = " x ".join(str(len(f) - 1) for f in run.grid.faces)
    model = run.value("contact", "model")
    said.append(f"contact '{model}'")
    if run.physics == "coupled":
        coupling = run.value("numerics", "coupling")
        said[-1] += f", {cells} cells, coupling '{coupling}'"
    if loads := ensemble.about.get("start"):
        said.append(f"{count(len(loads), 'load')}, taken in turn, whose units are not compared")
    if varied:
        said.append("varied: " + "; ".join(_varied(ensemble, name) for name in varied))
    said += [ensemble.left_words] if ensemble.left_out else []
    return "; ".join(said) + "."


def _varied(ensemble: Ensemble, name: str) -> str:
    values = dict.fromkeys(str(choice[name]) for choice in ensemble.choices if name in choice)
    return f"{name} = {', '.join(values)}"


def _patterns(ensemble: Ensemble) -> Markup:
    """Bars of the shares, for each choice of the varied variables."""
    rows: list[list[object]] = []
    for part in ensemble.parts:
        piles, name = part.piles, part.name or "all runs"
        shares = pile_ensemble.pattern_shares(piles)
        for k, (pattern, share) in enumerate(shares.items()):
            low, high = (100 * v for v in share["interval_95"])
            seen = f"{share['count']} of {len(piles)}".replace(" ", "\u00a0")
            bar = _bar(100 * (share["share"] or 0.0), low, high)
            first = name if k == 0 else ""
            interval = f"{low:.0f} to {high:.0f} %".replace(" ", "\u00a0")
            rows.append([first, tag("b", pattern), seen, bar, interval])
    meaning = "; ".join(f"{name}: {words}" for name, words in MEANING.items())
    return section(
        "patterns",
        "How often which pattern",
        table(["", "pattern", "runs", "share and 95 % interval", ""], rows, numbers=False),
        tag("p", meaning + ".", class_="note"),
    )


def _bar(share: float, low: float, high: float) -> Markup:
    """A share in percent as a bar, its interval as a line over it."""
    drawn = [
        tag("rect", class_="ground", x=0, y=2, width=100, height=12),
        tag("rect", class_="bar", x=0, y=2, width=f"{share:.2f}", height=12),
        tag("path", class_="whisker", d=f"M{low:.2f} 8H{high:.2f}M{low:.2f} 4V12M{high:.2f} 4V12"),
    ]
    return tag("svg", *drawn, viewBox="0 0 100 16", preserveAspectRatio="none", class_="share",
               role="img", aria_label=f"{share:.0f} %")  # fmt: skip


def _plan(ensemble: Ensemble, survey: Survey) -> Markup:
    """The mean pile from above, for each choice of the varied variables to one scale of height."""
    whole = [part for part in ensemble.parts if part.whole]
    found = [pile_ensemble.maps(part) for part in whole]
    top, length = max(float(maps.high.max()) for maps in found), ensemble.units.length
    run, area = ensemble.example.run, ensemble.area
    areas = [placing.drop_area(list(ensemble.runs.values())), *([area] if area.given else [])]
    note = f"Of the {len(ensemble.whole)} piles with all their blocks, fixed blocks included. "
    note += "Dashed: where blocks are let go, half a block wider."
    note += " Solid line: the wanted area." if area.given else ""
    if speed := np.hypot(*run.current[:2]):
        note += f" Arrow: current, {speed:.3g}\u00a0m/s."
    parts: list[Markup] = []
    for part, maps in zip(whole, found, strict=True):
        if part.name:
            parts.append(tag("h3", f"{part.name}: {count(len(part.whole), 'pile')}"))
        drawn = [("probability that a block lies over a point [%]", 100 * maps.cover, 100.0)]
        drawn += [(f"{name} [{length.name}]", length.of(values), length.of(top)) for name, values in
                  {"mean height above floor or bed": maps.mean,
                   "height that 90 % of the piles exceed": maps.low,
                   "height that 10 % of the piles exceed": maps.high}.items()]  # fmt: skip
        figures = [tag("figure", tag("img", alt=name, src=drawing.uri(drawing.over_plan(
                   values, high, name, run, survey, areas))), class_="sheet")
                   for name, values, high in drawn]  # fmt: skip
        parts.append(tag("div", *figures, class_="maps"))
    return section("plan", "Where blocks will lie", *parts, tag("p", note, class_="note"))


def _landings(ensemble: Ensemble, told: Options) -> Markup:
    """Where each unit lands, for each choice of the varied variables."""
    length, place, parts = ensemble.units.length, ensemble.units.place, []
    heads: list[object] = ["unit", "landings", f"mean x, y [{length.name}]",
                           f"half axes of the ellipse [{length.name}]", "long one heads [°]",
                           "within the tolerance"]  # fmt: skip
    for part in ensemble.parts:
        each, tolerance = pile_ensemble.places_of(part, told.survey, told.tolerance)
        if not (found := places.landings(each, tolerance)):
            continue
        plan = places.has_plan(part.example.run)
        rows: list[list[object]] = [
            [
                f"{k.unit} {k.name}".strip(),
                k.landings,
                f"{place.figure(k.x)}, {place.figure(k.y)}",
                f"{length.figure(k.long)}, {length.figure(k.short)}",
                number(k.heading_deg, ".0f"),
                *([in_words(k.within.count, k.within.units)] if plan else []),
            ]
            for k in found
        ]
        said = [part.name] if part.name else []
        if plan:
            within = places.within([p for one in each for p in one], tolerance)
            said.append(places.share_words(within, length))
        columns = heads if plan else heads[:-1]
        parts += [tag("p", ": ".join(said)), table(columns, rows)]
    note = f"The ellipse holds {100 * places.ELLIPSE:.0f} % of normally distributed landings with "
    way = "north towards east" if told.north else "+y towards +x"
    note += f"the same mean and covariance; headings go from {way}. In brackets: share and "
    note += "its 95 % interval."
    return section("landings", "Where each unit lands", *parts, tag("p", note, class_="note"))


def _histograms(ensemble: Ensemble) -> Markup:
    note = "Bars count complete piles; thick line: the median; dashed: 5 and 95 % of the piles."
    parts: list[Markup] = []
    for part in ensemble.parts:
        if part.whole:
            parts += [*_heading(part), *_spreads(part)]
    return section("numbers", "How much piles differ", *parts, tag("p", note, class_="note"))


def _heading(part: Ensemble) -> list[Markup]:
    """The name of a choice, where there are several."""
    return [tag("h3", part.name)] if part.name else []


def _spreads(ensemble: Ensemble) -> list[Markup]:
    """Histograms and a table of the numbers of one choice."""
    drawn: list[Markup] = []
    rows: list[list[object]] = []
    for quantity in _QUANTITIES:
        unit, name = ensemble.units.of_kind(quantity.kind), quantity.heading(ensemble.units)
        values = [unit.of(quantity.value(p)) for p in ensemble.whole]
        spread = pile_ensemble.spread_of(values)
        if spread is None:
            continue
        marks = [(spread["5 %"], "5 %"), (spread["median"], "median"), (spread["95 %"], "95 %")]
        known = np.array([v for v in values if v == v])
        drawn.append(charts.histogram(known, name, marks))
        rows.append([name, *(figure(value, 4) for value, _ in marks)])
    return [
        tag("div", *drawn, class_="charts"),
        table(["of the complete piles", "5 %", "median", "95 %"], rows),
    ]


def _wall(ensemble: Ensemble) -> Markup:
    """A small picture of every pile, by pattern; a click shows it in three dimensions."""
    marks = {k: words for part in ensemble.parts
             for k, words in pile_ensemble.remarkable(part).items()}  # fmt: skip
    # The box around the piles of all runs, with a margin, within the tank
    boxes = np.array([p.numbers.box for p in ensemble.piles])
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    grid, margin = ensemble.example.run.grid, 0.08 * float((high - low).max())
    frame = np.maximum(low - margin, grid.low), np.minimum(high + margin, grid.high)
    parts: list[Markup] = []
    for name, piles in _groups(ensemble):
        entries = []
        for p in piles:
            colours = views.block_colours(p.run.bodies.dropped, p.run.bodies.n)
            sheet = views.Sheet(*frame, views.bed_of(p.run), _SMALL)
            seen = sheet.picture(present_bodies(p.run, -1), colours, "front")[0]
            words = f"run {p.number}, {ensemble.units.length.text(p.numbers.height)} high"
            image = tag("img", src=views.uri(seen, 48), alt=f"pile of {words}")
            said = markup(image, words, *(tag("b", mark) for mark in marks.get(p.number, [])))
            entries.append(tag("li", tag("button", said, type="button", data_pile=p.number)))
        parts.append(tag("h3", f"{name}, {count(len(piles), 'run')}"))
        parts.append(tag("ul", *entries, class_="wall"))
    close = tag("button", "Close", class_="close", type="button")
    shown = tag(
        "dialog",
        tag("div", tag("h3", ""), close, class_="head"),
        player("player", "a pile; arrow keys turn it, + and - zoom"),
        tag("p", "", class_="about note"),
        id="shown",
    )
    words = "Seen from the front. A click opens a pile, to turn and to look at from all sides. "
    words += "The most typical one is nearest in height to the mean pile, the least farthest."
    return section("wall", "Every pile", tag("p", words, class_="note no-print"), *parts, shown)


def _groups(ensemble: Ensemble) -> list[tuple[str, list[Pile]]]:
    """The piles by pattern, or those with all their blocks and the others."""
    if ensemble.has_patterns:
        found = [(f"{k}: {MEANING[k]}", [p for p in ensemble.piles if p.pattern == k])
                 for k in PATTERNS]  # fmt: skip
    else:
        partly = [p for p in ensemble.piles if not p.complete]
        found = [("All blocks let go", ensemble.whole), ("Blocks without room", partly)]
    return [(name, piles) for name, piles in found if piles]


def _scenes(ensemble: Ensemble, north: float | None) -> dict[str, Any]:
    """The last row of every run for the player; the tank and the shapes once, or for each choice
    where they are varied."""
    varied = {name.split(".")[0] for choice in ensemble.choices for name in choice}
    parts = ensemble.parts if varied & {"shape", "grid", "bed"} else [ensemble]
    parts = [part for part in parts if part.piles]
    return {
        "tanks": [motion.tank(part.example.run, north) for part in parts],
        "runs": {
            p.number: _shown(p, ensemble) | {"tank": n}
            for n, part in enumerate(parts)
            for p in part.piles
        },
    }


def _shown(p: Pile, ensemble: Ensemble) -> dict[str, Any]:
    scene = motion.blocks(p.run, np.array([len(p.run.bodies.time) - 1]))
    level = pile.still_level(p.run)
    scene["water"] = None if level is None else {"level": level - float(p.run.grid.low[2])}
    n = p.numbers
    about = [f"seed {p.row['seed']}", f"ended: {p.row['outcome']}",
             f"at rest after {number(n.time_to_rest, '.3g', 's')}",
             f"{n.coordination:.2f} contacts per block",
             f"{count(n.on_floor, 'dropped block')} on the floor",
             f"folder {p.row['folder']}"]  # fmt: skip
    pattern = f"pattern {p.pattern}, " if ensemble.has_patterns else ""
    return {
        "title": f"Run {p.number}: {pattern}{ensemble.units.length.text(n.height)} high",
        "about": "; ".join(about) + ".",
        "scene": scene,
    }


def _running(ensemble: Ensemble) -> Markup:
    """Estimates after each run, with their intervals: were the runs enough?"""
    parts: list[Markup] = []
    for part in ensemble.parts:
        if part.piles:
            parts += [*_heading(part), *_estimates(part)]
    return section("running", "Were the runs enough?", *parts)


def _estimates(ensemble: Ensemble) -> list[Markup]:
    """How the share of the commonest pattern and the median height of one choice went."""
    said, drawn = [], []
    runs = count(len(ensemble.piles), "run")
    if ensemble.has_patterns:
        shares = pile_ensemble.pattern_shares(ensemble.piles)
        name = max(("A", "B"), key=lambda k: shares[k]["count"])
        steps = np.array(list(pile_ensemble.running(ensemble.piles, name)))
        percent = steps * np.array([1, 100, 100, 100])
        names = ("number of runs", f"share of pattern {name} [%]")
        drawn.append(charts.band(percent, names, (0, 100)))
        low, high = (100 * v for v in steps[-1, 2:])
        said.append(f"the share of {name} lies between {low:.0f} and {high:.0f} %")
    length = ensemble.units.length
    heights = [length.of(p.numbers.height) for p in ensemble.whole]
    known = [
        [n, float(np.median(heights[:n])), *pile_ensemble.median_interval(heights[:n])]
        for n in range(6, len(heights) + 1)
    ]
    if known:
        low, high = known[-1][2:]
        said.append(f"the median height lies between {figure(low)} and {figure(high)} "
                    f"{length.name}")  # fmt: skip
    if len(known) > 1:
        names = ("number of complete piles", f"median height [{length.name}]")
        drawn.append(charts.band(np.array(known), names))
    if not said:
        return [
            tag(
                "p",
                f"{run_words.capital(runs)}: an interval of the median needs six complete piles.",
            )
        ]
    words = f"After {runs} {' and '.join(said)}, with 95 % confidence; four times as many would "
    words += "about halve that width."
    return [tag("p", words), tag("div", *drawn, class_="charts")]


def _health(ensemble: Ensemble) -> Markup:
    """The worst run in each check."""
    each: dict[str, list[tuple[int, Check]]] = {}
    for p in ensemble.piles:
        for check in health.checks(p.run, ensemble.units):
            each.setdefault(check.name, []).append((p.number, check))
    rows: list[list[object]] = []
    for found in each.values():
        # What is not good comes before what is not known, and this before what is good
        bad = {False: 2, None: 1, True: 0}
        number, worst = max(found, key=lambda f: (bad[f[1].good], np.nan_to_num(f[1].share)))
        rows.append([*run_page.check_row(worst), f"run {number}"])
    outcomes: dict[str, int] = {}
    for row in ensemble.about["table"]:
        outcomes[row["outcome"]] = outcomes.get(row["outcome"], 0) + 1
    for name, n in outcomes.items():
        rows.append([f"runs that ended: {name}", str(n), "", "", ""])
    said = table(["of all runs, the worst", "found", "wanted", "", "where"], rows, numbers=False)
    return section("health", "Health of the computations", said)


def _case(ensemble: Ensemble, run: Run) -> Markup:
    about = ensemble.about
    p = run.provenance
    words = [tag("p", text) for text in run_words.case(run, ensemble.units)]
    which = f"As in run {ensemble.example.number}; seeds differ from run to run."
    words.append(tag("p", which, class_="note"))
    command = f"mics-tools ensemble case.nml --runs {about['runs']} --seed {about['seed']}"
    if about.get("start"):
        command += f" --start {shlex.join(about['start'])}"
    if about.get("spread") is not None:
        command += f" --spread {about['spread']:g}"
    if about.get("tilt_deg") is not None:
        command += f" --tilt {about['tilt_deg']:g}"
    for name in sorted({name for choice in ensemble.choices for name in choice}):
        command += f" --vary {_varied(ensemble, name).replace(' = ', '=').replace(', ', ',')}"
    text = str(about["case"])
    source = f"mics {p.get('version', '?')}, git revision {p.get('git_revision', '?')}, "
    return section(
        "case",
        "The case, and how to get this again",
        *words,
        tag("p", source + f"{p.get('compiler', '?')}. Save ",
            download("case.nml", "text/plain", text, "case.nml"), " and run"),
        tag("pre", command),
        tag("details", tag("summary", "The case file"), tag("pre", text)),
    )  # fmt: skip


def _table(ensemble: Ensemble) -> Markup:
    """The figures of each run, and the files to take along."""
    found = pile_ensemble.rows(ensemble)
    content = json.dumps(files.known(pile_ensemble.summary(ensemble)), indent=1)
    varied = sorted({name for choice in ensemble.choices for name in choice})
    shown, patterns = ensemble.units, ensemble.has_patterns
    rows: list[list[object]] = [
        [
            p.number,
            *(str(p.row.get(name, "")) for name in varied),
            *([p.pattern] if patterns else []),
            f"{p.numbers.blocks} of "
            f"{len(without_machines(p.run, dict(enumerate(p.run.bodies.name))))}",
            number(100 * ensemble.area.share_outside(placing.ends(p.run)), ".0f"),
            *(shown.of_kind(q.kind).figure(q.value(p)) for q in _QUANTITIES),
        ]
        for p in ensemble.piles
    ]
    heads: list[object] = ["run", *varied, *(["pattern"] if patterns else []), "blocks",
                           "outside [%]", *(q.heading(shown) for q in _QUANTITIES)]  # fmt: skip
    name = ensemble.folder.resolve().name
    links = tag("p", "To take along: ",
                download(f"{name}.csv", "text/csv",
                         files.table_text(found, list(found[0])), "all numbers as CSV"), ", ",
                download(f"{name}.json", "application/json", content, "and as JSON"), ".",
                class_="no-print")  # fmt: skip
    return section("table", "Each run", table(heads, rows), links)
