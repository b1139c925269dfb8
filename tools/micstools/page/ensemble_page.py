"""The page of an ensemble: how often which pile, where blocks will lie, whether the runs were
enough, and every pile to look at."""

import csv
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from micstools import kicks, pile, pile_ensemble
from micstools.balance import EXCESS_LIMIT
from micstools.energy import ENERGY_LIMIT, made_by_contact
from micstools.overlap import present_bodies
from micstools.page import charts, motion, run_page, run_words, views
from micstools.page.html import (
    Markup,
    data,
    document,
    download,
    markup,
    section,
    table,
    tag,
)
from micstools.page.parts import north_note, number, player
from micstools.page.run_words import count, millimetres
from micstools.pile_ensemble import MEANING, PATTERNS, Ensemble, Maps, Pile
from micstools.reader import Run
from micstools.shares import in_words

_START = """
const piles = read('piles'), dialog = document.getElementById('shown');
let pilePlayer;
document.querySelectorAll('[data-pile]').forEach(button => button.addEventListener('click', () => {
  dialog.showModal();
  pilePlayer = pilePlayer || startPlayer(document.getElementById('player'));
  const pile = piles.runs[button.dataset.pile];
  dialog.querySelector('h3').textContent = pile.title;
  dialog.querySelector('.about').textContent = pile.about;
  if (pilePlayer) pilePlayer.load({ ...piles.tanks[pile.tank], ...pile.scene });
}));
dialog.querySelector('.close').addEventListener('click', () => dialog.close());
"""
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
    value: Callable[[Pile], float]


_QUANTITIES = (
    Quantity("top of the pile [mm]", lambda p: _top(p)),
    Quantity("plan area covered [cm²]", lambda p: 1e4 * p.numbers.plan_area),
    Quantity("contacts per block", lambda p: p.numbers.coordination),
    Quantity("porosity of the box around the pile", lambda p: p.numbers.porosity),
    Quantity("time to rest [s]", lambda p: p.numbers.time_to_rest),
    Quantity("hardest contact [N]", lambda p: p.numbers.contact_force),
)


def page(ensemble: Ensemble, north: float | None = None) -> str:
    """The page of an ensemble as text. `north`: its direction in the plan, degrees from +y towards
    +x."""
    run = ensemble.example.run
    title = f"{run_words.title(run, ensemble.folder)}: {count(len(ensemble.piles), 'run')}"
    return document(
        title,
        tag("h1", title),
        *(tag("p", sentence(part), class_="lead") for part in ensemble.parts),
        tag("p", assumptions(ensemble)),
        _patterns(ensemble),
        *([_plan(ensemble), _histograms(ensemble)] if ensemble.whole else []),
        _wall(ensemble),
        north_note(north),
        _running(ensemble),
        _health(ensemble),
        _case(ensemble, run),
        _table(ensemble),
        data("piles", _scenes(ensemble, north)),
        script=_START,
    )


def sentence(ensemble: Ensemble) -> str:
    """Shares of the patterns of one choice and the height of the piles, each with its interval."""
    total, shares = len(ensemble.piles), pile_ensemble.pattern_shares(ensemble.piles)
    said = [f"in {in_words(shares[name]['count'], total)} {words}" for name, words in _SAID.items()]
    if ensemble.name:
        said[0] = f"with {ensemble.name} {said[0]}"
    words = f"{run_words.capital(', '.join(said))} (in brackets: share and 95 % interval). "
    words += _heights([_top(p) for p in ensemble.whole])
    return words.replace(" %", "\u00a0%").replace(" mm", "\u00a0mm")


def _top(p: Pile) -> float:
    """Height of a pile above the floor of the tank [mm]."""
    return 1e3 * (p.numbers.top - float(p.run.grid.low[2]))


def _heights(tops: list[float]) -> str:
    """The tops [mm] of the complete piles in words."""
    if not tops:
        return "No pile has all its blocks, so there is no mean pile."
    if len(tops) == 1:
        return f"The one complete pile is {tops[0]:.3g} mm high."
    low, median, high = np.percentile(tops, [5, 50, 95])
    return (
        f"Half of the {len(tops)} complete piles are higher than {median:.3g} mm, and 90 % have "
        f"their top between {low:.3g} and {high:.3g} mm."
    )


def assumptions(ensemble: Ensemble) -> str:
    """What the shares rest on."""
    run = ensemble.example.run
    varied = sorted({name for choice in ensemble.choices for name in choice})
    said = ["This rests on what was assumed: " + _friction(run, varied)]
    by_chance = [w for drop in run.parameters.get("drop", []) for w in run_words.chance(drop)]
    said += [f"blocks {words}" for words in dict.fromkeys(by_chance)]
    cells = " x ".join(str(len(f) - 1) for f in run.grid.faces)
    model = str(run.value("contact", "model", "surface")).strip()
    coupling = str(run.value("numerics", "coupling", "monolithic")).strip()
    said.append(f"{cells} cells, contact '{model}', coupling '{coupling}'")
    if varied:
        said.append("varied: " + "; ".join(_varied(ensemble, name) for name in varied))
    if ensemble.left_out:
        names = ", ".join(f"{k} ({v})" for k, v in ensemble.left_out.items())
        said.append(f"left out for want of an outcome: runs {names}")
    return "; ".join(said) + "."


def _friction(run: Run, varied: list[str]) -> str:
    """Friction and restitution, where they were the same in all runs."""
    known = [
        ("friction", "friction of blocks", 0.6),
        ("wall_friction", "friction of walls and floor", 0.4),
    ]
    if str(run.value("contact", "law", "restitution")).strip() == "restitution":
        known.append(("restitution", "restitution", 0.3))
    return ", ".join(
        f"{words} {run.value('contact', name, usual):.3g}"
        for name, words, usual in known
        if f"contact.{name}" not in varied
    )


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


def _plan(ensemble: Ensemble) -> Markup:
    """The mean pile from above, for each choice of the varied variables to one scale of height."""
    whole = [part for part in ensemble.parts if part.whole]
    found = [pile_ensemble.maps(part) for part in whole]
    top = 1e3 * max(float(maps.high.max()) for maps in found)
    size = ensemble.example.run.grid
    extent = " x ".join(millimetres(v) for v in (size.high - size.low)[:2])
    note = f"Seen from above, x to the right, y up; the plan is {extent}. Of the "
    note += f"{len(ensemble.whole)} piles with all their blocks, fixed blocks included."
    parts: list[Markup] = []
    for part, maps in zip(whole, found, strict=True):
        if part.name:
            parts.append(tag("h3", f"{part.name}: {count(len(part.whole), 'pile')}"))
        parts.append(tag("div", *_maps(maps, top), class_="maps"))
    return section("plan", "Where blocks will lie", *parts, tag("p", note, class_="note"))


def _maps(found: Maps, top: float) -> list[Markup]:
    """Cover and height of a mean pile, on a scale that ends at `top` [mm]."""
    return [
        views.plan_map(100 * found.cover, 100.0, "probability that a block lies over a point", "%"),
        views.plan_map(1e3 * found.mean, top, "mean height", "mm"),
        views.plan_map(1e3 * found.low, top, "height that 90 % of the piles exceed", "mm"),
        views.plan_map(1e3 * found.high, top, "height that 10 % of the piles exceed", "mm"),
    ]


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
        values = [quantity.value(p) for p in ensemble.whole]
        spread = pile_ensemble.spread_of(values)
        if spread is None:
            continue
        marks = [(spread["5 %"], "5 %"), (spread["median"], "median"), (spread["95 %"], "95 %")]
        known = np.array([v for v in values if v == v])
        drawn.append(charts.histogram(known, quantity.name, marks))
        rows.append([quantity.name, *(f"{value:.4g}" for value, _ in marks)])
    return [
        tag("div", *drawn, class_="charts"),
        table(["of the complete piles", "5 %", "median", "95 %"], rows),
    ]


def _wall(ensemble: Ensemble) -> Markup:
    """A small picture of every pile, by pattern; a click shows it in three dimensions."""
    marks = {k: words for part in ensemble.parts
             for k, words in pile_ensemble.remarkable(part).items()}  # fmt: skip
    parts: list[Markup] = []
    for pattern in PATTERNS:
        piles = [p for p in ensemble.piles if p.pattern == pattern]
        if piles:
            entries = [_thumbnail(p, marks.get(p.number, [])) for p in piles]
            parts.append(tag("h3", f"{pattern}: {MEANING[pattern]}, {count(len(piles), 'run')}"))
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


def _thumbnail(p: Pile, marks: list[str]) -> Markup:
    b, grid = p.run.bodies, p.run.grid
    bodies = present_bodies(p.run, -1)
    colours = views.block_colours(b.dropped, b.n)
    sheet = views.Sheet(grid.low, grid.high, views.bed_of(p.run), _SMALL)
    address = views.uri(sheet.picture(bodies, colours, "front")[0], 48)
    words = f"run {p.number}, top {millimetres(1e-3 * _top(p))}"
    image = tag("img", src=address, alt=f"pile of {words}")
    said = markup(image, words, *(tag("b", mark) for mark in marks))
    button = tag("button", said, type="button", data_pile=p.number)
    return tag("li", button)


def _scenes(ensemble: Ensemble, north: float | None) -> dict[str, Any]:
    """The last row of every run for the player; the tank and the shapes once, or for each choice
    where they are varied."""
    varied = {name.split(".")[0] for choice in ensemble.choices for name in choice}
    parts = ensemble.parts if varied & {"shape", "grid", "bed"} else [ensemble]
    parts = [part for part in parts if part.piles]
    return {
        "tanks": [motion.tank(part.example.run, north) for part in parts],
        "runs": {
            p.number: _shown(p) | {"tank": n} for n, part in enumerate(parts) for p in part.piles
        },
    }


def _shown(p: Pile) -> dict[str, Any]:
    scene = motion.blocks(p.run, np.array([len(p.run.bodies.time) - 1]))
    level = pile.still_level(p.run)
    scene["water"] = None if level is None else {"level": level}
    n = p.numbers
    about = [f"seed {p.row['seed']}", f"ended: {p.row['outcome']}",
             f"at rest after {number(n.time_to_rest, '.3g', 's')}",
             f"{n.coordination:.2f} contacts per block",
             f"{count(n.on_floor, 'dropped block')} on the floor",
             f"folder {p.row['folder']}"]  # fmt: skip
    top = millimetres(1e-3 * _top(p))
    return {
        "title": f"Run {p.number}: pattern {p.pattern}, top {top}",
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
    """How the share of the commonest pattern and the median of the top of one choice went."""
    shares = pile_ensemble.pattern_shares(ensemble.piles)
    name = max(("A", "B"), key=lambda k: shares[k]["count"])
    steps = np.array(list(pile_ensemble.running(ensemble.piles, name)))
    percent = steps * np.array([1, 100, 100, 100])
    names = ("number of runs", f"share of pattern {name} [%]")
    drawn = [charts.band(percent, names, (0, 100))]
    tops = [_top(p) for p in ensemble.whole]
    known = [
        [n, float(np.median(tops[:n])), *pile_ensemble.median_interval(tops[:n])]
        for n in range(6, len(tops) + 1)
    ]
    if len(known) > 1:
        names = ("number of complete piles", "median top [mm]")
        drawn.append(charts.band(np.array(known), names))
    low, high = (100 * v for v in steps[-1, 2:])
    said = (
        f"After {count(len(ensemble.piles), 'run')} the share of {name} is known to lie between "
        f"{low:.0f} and {high:.0f} %; four times as many runs would about halve that width."
    )
    return [tag("p", said), tag("div", *drawn, class_="charts")]


def _health(ensemble: Ensemble) -> Markup:
    """The worst of all runs, against what a run should keep."""
    rows: list[list[object]] = []
    series = {p.number: p.run.series for p in ensemble.piles}
    for words, values, limit, form in (
        ("largest overlap of true shapes [mm]", _worst(series, "max_overlap", 1e3),
         1e3 * run_page.overlap_limit(ensemble.example.run), ".3g"),
        ("largest drift of the liquid volume", _worst(series, "liquid_volume_drift", 1.0),
         run_page.DRIFT, ".1e"),
        ("largest excess of fluid in a cell, of its volume",
         _worst(series, "volume_excess_max", 1.0), EXCESS_LIMIT, ".1e"),
        ("largest energy over what was put in, of what was set free",
         _worst(series, "energy_excess", 1.0), ENERGY_LIMIT, ".1e"),
        ("largest divergence [1/s]", _worst(series, "divergence_max", 1.0),
         run_page.divergence_limit(ensemble.example.run), ".1e"),
        ("largest energy that contact made in a step [J]",
         {p.number: float(made_by_contact(p.run).max()) for p in ensemble.piles},
         run_page.energy_limit(ensemble.example.run), ".1e"),
        ("largest acceleration of an untouched block [g]", _kicks(ensemble),
         kicks.LIMIT, ".2g"),
    ):  # fmt: skip
        if values:
            where = max(values, key=lambda k: values[k])
            found, wanted = f"{values[where]:{form}}", f"below {limit:{form}}"
            mark = run_page.mark(values[where] < limit)
            rows.append([words, found, wanted, mark, f"run {where}"])
    outcomes: dict[str, int] = {}
    for row in ensemble.about["table"]:
        outcomes[row["outcome"]] = outcomes.get(row["outcome"], 0) + 1
    for name, n in outcomes.items():
        rows.append([f"runs that ended: {name}", str(n), "", "", ""])
    said = table(["of all runs, the worst", "found", "wanted", "", "where"], rows, numbers=False)
    return section("health", "Health of the computations", said)


def _kicks(ensemble: Ensemble) -> dict[int, float]:
    """The largest acceleration of untouched blocks [g] of the runs whose rows tell it."""
    found = {p.number: kicks.largest(p.run) for p in ensemble.piles}
    return {k: one.acceleration for k, one in found.items() if one and one.good is not None}


def _worst(series: dict[int, Any], name: str, scale: float) -> dict[int, float]:
    found = {k: np.abs(getattr(s, name)[1:]) for k, s in series.items()}
    return {k: scale * float(np.nanmax(v)) for k, v in found.items() if np.isfinite(v).any()}


def _case(ensemble: Ensemble, run: Run) -> Markup:
    about = ensemble.about
    p = run.provenance
    words = [tag("p", text) for text in run_words.case(run)]
    which = f"As in run {ensemble.example.number}; seeds differ from run to run."
    words.append(tag("p", which, class_="note"))
    command = f"mics-tools ensemble case.nml --runs {about['runs']} --seed {about['seed']}"
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
    file = io.StringIO()
    writer = csv.DictWriter(file, list(found[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    content = json.dumps(pile_ensemble.summary(ensemble), indent=1)
    varied = sorted({name for choice in ensemble.choices for name in choice})
    rows: list[list[object]] = [
        [
            p.number,
            *(str(p.row.get(name, "")) for name in varied),
            p.pattern,
            f"{p.numbers.blocks} of {p.run.bodies.n}",
            f"{_top(p):.1f}",
            f"{1e4 * p.numbers.plan_area:.1f}",
            f"{p.numbers.coordination:.2f}",
            number(p.numbers.porosity),
            number(p.numbers.time_to_rest),
            number(p.numbers.contact_force),
        ]
        for p in ensemble.piles
    ]
    heads: list[object] = ["run", *varied, "pattern", "blocks", "top [mm]", "plan [cm²]",
                           "contacts", "porosity", "at rest [s]", "hardest [N]"]  # fmt: skip
    name = ensemble.folder.resolve().name
    links = tag("p", "To take along: ",
                download(f"{name}.csv", "text/csv", file.getvalue(), "all numbers as CSV"), ", ",
                download(f"{name}.json", "application/json", content, "and as JSON"), ".",
                class_="no-print")  # fmt: skip
    return section("table", "Each run", table(heads, rows), links)
