"""The page of a run: the fall to play, the pile to scale, what the blocks felt, whether the numbers
can be trusted, and how to get them again."""

import re
from dataclasses import dataclass

import numpy as np

from micstools.pages import charts, motion, run_words
from micstools.pages.charts import Curve
from micstools.pages.html import (
    Markup,
    data,
    document,
    download,
    facts,
    markup,
    section,
    table,
    tag,
)
from micstools.pages.parts import north_note, number, player, swatch
from micstools.pages.run_words import count
from micstools.pages.views import Sheet, bed_of, block_colours
from micstools.piles import drawing, layer, maps, pile, pile_numbers
from micstools.piles.handover import Handover
from micstools.piles.options import Options
from micstools.piles.pile_numbers import PileNumbers
from micstools.reading import block_numbers, health, places, rest, scales, units
from micstools.reading.block_numbers import BlockNumbers
from micstools.reading.health import Check
from micstools.reading.overlap import present_bodies, without_machines
from micstools.reading.places import Within
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import SI, Units, figure

_START = """
const runPlayer = startPlayer(document.getElementById('player'));
if (runPlayer) runPlayer.load(read('scene'));
for (const box of document.querySelectorAll('.filter')) box.addEventListener('input', () => {
  for (const row of box.closest('section').querySelectorAll('.units tbody tr'))
    row.hidden = !row.textContent.toLowerCase().includes(box.value.toLowerCase());
});
"""
_MANY = 100  # blocks with a curve of their own


@dataclass(frozen=True)
class Found:
    """What the parts of the page share."""

    numbers: PileNumbers
    blocks: list[BlockNumbers]
    units: Units


def page(run: Run, told: Options = Options()) -> str:  # noqa: B008 (it is frozen)
    """The page of a run as text; without blocks it tells of the case and of the numbers only."""
    title, north = run_words.title(run), told.north
    chosen = units.of_run(run)
    case = section("case", "The case", *(tag("p", words) for words in run_words.case(run, chosen)))
    last = (_settings(run), _provenance(run))
    for name in ("position", "quaternion", "velocity", "fluid_force", "contact_force"):
        values = getattr(run.bodies, name)
        if not (np.abs(values) < 1e20).all() and not np.isnan(values).all():  # none: a dry run
            raise BadRun(f"{run.folder}/run.h5: bodies/{name} holds what is no number")
    if not run.bodies.n:
        lead = (
            f"A run of {run.series.time[-1]:.3g} s without blocks; mics-tools plot draws its water."
        )
        return document(title, tag("h1", title), tag("p", lead, class_="lead"), case,
                        _health(run, chosen), *last, script="")  # fmt: skip
    numbers = pile_numbers.numbers(run, maps.usual_step(run), told=told)
    found = Found(numbers, block_numbers.of_blocks(run), chosen)
    corner, sides = _pile(run, chosen)
    return document(
        title,
        tag("h1", title),
        tag("p", outcome(run, found), class_="lead"),
        player("player", "the fall of the blocks; arrow keys turn it, + and - zoom, space plays"),
        north_note(north),
        corner,
        _facts(run, found),
        case,
        sides,
        _places(Handover(run, told), chosen),
        _blocks(run, found),
        _health(run, chosen),
        *last,
        data("scene", motion.scene(run, north)),
        script=_START,
    )


def outcome(run: Run, found: Found) -> str:
    """How the run ended, in a sentence or two."""
    b = run.bodies
    rests, end = rest.of_blocks(run), f"After {figure(float(b.time[-1]))} s "
    n = len(rests)
    missing = int((b.to_come(-1) & ~b.fixed).sum())
    moving = sum(k.time != k.time for k in rests)
    if missing:
        said = f"{end}{count(missing, 'block is', 'blocks are')} still to come and "
        said += f"{count(n, 'block was', 'blocks were')} let go"
    elif moving:
        of_all = f"{count(moving, 'of', 'of')} {count(n, 'free block')}"
        said = end + (of_all if n > moving else count(n, "free block"))
        said += " still moves" if moving == 1 else " still move"
    elif n:
        said = f"After {figure(found.numbers.time_to_rest)} s {count(n, 'free block')} "
        said += "lies still" if n == 1 else "lie still"
    else:
        said = "All blocks are fixed"
    if gone := int((b.status > 2).sum()):
        said += f", {count(gone, 'block is', 'blocks are')} left out or out of the tank"
    low, ground = found.numbers.on_floor, _ground(run)
    return (
        f"{said}; the pile reaches {found.units.length.text(found.numbers.height)} above the "
        f"{ground} under it, and {count(low, 'free block touches', 'free blocks touch')} the "
        f"{ground}."
    )


def _ground(run: Run) -> str:
    """What blocks lie on."""
    return "bed" if len(run.bed[1]) else "floor"


def _facts(run: Run, found: Found) -> Markup:
    n, b, shown = found.numbers, run.bodies, found.units
    hardest = max(found.blocks, key=lambda k: np.nan_to_num(k.contact_force), default=None)
    blow = f"block {hardest.block}, mean of a step" if hardest else ""
    mass = float(b.mass[list(without_machines(run, present_bodies(run, -1)))].sum())
    return facts(
        [
            ("blocks", n.blocks, f"{shown.mass.text(mass)} in all"),
            ("height of the pile", shown.length.text(n.height), f"above the {_ground(run)}"),
            ("layer thickness", shown.length.text(n.layer_thickness),
             f"on average; porosity {percent(n.layer_porosity)}"),
            ("plan covered", shown.area.text(n.plan_area),
             f"{percent(n.plan_area / (n.footprint or np.nan))} of a footprint of "
             f"{shown.area.text(n.footprint)}"),
            ("time to rest", shown.time.text(n.time_to_rest), f"of {shown.time.text(b.time[-1])}"),
            ("contacts per block", f"{n.coordination:.2f}", "with other blocks"),
            ("fastest first impact", shown.speed.text(n.impact_speed), "of a free block"),
            ("hardest contact", shown.force.text(n.contact_force), blow),
            ("hardest impact", shown.force.text(n.peak_force), "impulse over contact_time"),
        ]
    )  # fmt: skip


def percent(share: float) -> str:
    """A share in percent; a dash where it is not known."""
    return "–" if share != share else f"{100 * share:.0f} %"


def _pile(run: Run, shown: Units) -> tuple[Markup, Markup]:
    """The pile of the end from a corner, for paper, and from three sides."""
    bodies = present_bodies(run, -1)
    # The mean level of the water at the end; the one it should have where no field was written
    level = pile.water_level(run).found if pile.has_level(run) else pile.still_level(run)
    # Of what is shown: the tank, but for much air above the pile and the water
    tops = [float(body.points[:, 2].max()) for body in bodies.values()]
    low, high = run.grid.low, np.array(run.grid.high)
    needed = max([*tops, *([level] if level is not None else [])], default=float(high[2]))
    high[2] = min(high[2], max(needed, low[2]) + 0.1 * float((high - low).max()))
    sheet = Sheet(run.grid.low, high, bed_of(run))
    colours = block_colours(run.bodies.dropped, run.bodies.n)
    drawn = [
        sheet.drawing(bodies, colours, view, shown.length, level)
        for view in ("front", "side", "top")
    ]
    words = "All views have one scale; blocks bear their numbers where enough of them is seen, "
    words += "fixed ones are grey."
    words += " The dashed line is the water level." if level is not None else ""
    return sheet.corner(bodies, colours), section(
        "pile", "The pile at the end", tag("div", *drawn, class_="views"),
        tag("p", words, class_="note"),
    )  # fmt: skip


_FILTER = tag("input", class_="filter no-print", type="search", placeholder="show units with …",
              aria_label="show units with these letters")  # fmt: skip


def _places(given: Handover, shown: Units) -> Markup:
    """Where units lie, and the layer that they form; where there is a plan, beside that."""
    length, found, within = shown.length, given.places, given.within
    heads: list[object] = ["unit", *(["name"] if any(p.name for p in found) else []),
                           f"x, y, z [{length.name}]", "heading [°]", "tilt [°]",
                           *([f"deviation [{length.name}]"] if within else []),
                           "at rest", "touches"]  # fmt: skip
    rows: list[list[object]] = [
        [
            p.unit,
            *([p.name] if "name" in heads else []),
            ", ".join(shown.place.column((p.x, p.y, p.z))),
            number(p.heading_deg, ".0f"),
            number(p.tilt_deg, ".0f"),
            *((["fixed"] if p.fixed else shown.place.column([p.deviation])) if within else []),
            "yes" if p.at_rest else "no",
            p.touching or "–",
        ]
        for p in found
    ]
    take = tag("p", "To take along: ", download("places.csv", "text/csv", places.csv_text(found),
               "all places as CSV"), "; mics-tools places writes GeoJSON, DXF and the drawings.",
               class_="no-print")  # fmt: skip
    meaning = [tag("li", f"{name}: {words.removesuffix(' [m]')}") for name, words in
               (*places.MEANING.items(), *layer.DEFINITIONS.items())]  # fmt: skip
    defined = tag(
        "details",
        tag("summary", "What these numbers mean; in files in SI units"),
        tag("ul", *meaning),
    )
    return section("places", "Where units lie", *(tag("p", words) for words in given.words(shown)),
                   *_drawings(given), *(_farther_off(given, within, shown) if within else []),
                   _FILTER, table(heads, rows, kind="units"), take, defined)  # fmt: skip


def _drawings(given: Handover) -> list[Markup]:
    """Plan and section."""
    if not given.measured:
        return []
    drawn = (
        (drawing.plan(given), "plan, planned beside built"),
        (drawing.section(given), "section"),
    )
    return [tag("figure", tag("img", src=drawing.uri(found), alt=words), tag("figcaption", words),
                class_="sheet") for found, words in drawn]  # fmt: skip


def _farther_off(given: Handover, within: Within, shown: Units) -> list[Markup]:
    """The units out of tolerance, the farthest first."""
    off = [p for p in places.placed(given.places) if not places.is_within(p, within.tolerance)]
    off.sort(key=lambda p: -p.deviation)
    if not off:
        return []
    rows: list[list[object]] = [
        [f"{p.unit} {p.name}".strip(), *shown.place.column(
         (p.deviation, p.x - p.plan_x, p.y - p.plan_y, p.z - p.plan_z)), number(p.tilt_deg, ".0f")]
        for p in off
    ]  # fmt: skip
    heads: list[object] = ["out of tolerance", f"deviation [{shown.length.name}]", "to the east",
                           "to the north", "up", "tilt [°]"]  # fmt: skip
    return [table(heads, rows)]


def _blocks(run: Run, found: Found) -> Markup:
    colours = block_colours(run.bodies.dropped, run.bodies.n)
    length, force = found.units.length, found.units.force
    heads: list[object] = ["block", "released [s]", "at rest [s]", "first impact [m/s]",
                           f"largest contact force [{force.name}]", "in weights",
                           f"largest force of water [{force.name}]", "turned [°]",
                           f"x, y, z at the end [{length.name}]"]  # fmt: skip
    names = [f"{k.block}\u00a0{run.bodies.name[k.block - 1]}".strip() for k in found.blocks]
    measured = [
        (k.released, k.at_rest, k.impact_speed, force.of(k.contact_force),
         k.contact_force / (k.weight or np.nan), force.of(k.fluid_force))
        for k in found.blocks
    ]  # fmt: skip
    figures = zip(*map(SI.number.column, zip(*measured, strict=True)), strict=True)
    rows: list[list[object]] = [
        [swatch(colours[k.block], name), *figured, number(k.turned, ".0f"),
         ", ".join(found.units.place.column(k.place))]
        for k, name, figured in zip(found.blocks, names, figures, strict=True)
    ]  # fmt: skip
    note = "At rest: the time after which a block stays where it ends. Forces are means over a "
    note += "time step; the force of the water includes buoyancy."
    return section("blocks", "Fall and forces of each block", _FILTER,
                   table(heads, rows, kind="units"),
                   tag("p", note, class_="note"), *curves(run, found.units))  # fmt: skip


def curves(run: Run, shown: Units) -> list[Markup]:
    """Charts against time and their key, of the first blocks where there are many."""
    b, force = run.bodies, shown.force
    chosen = [int(k) for k in b.dropped if b.present(-1)[k]][:_MANY]
    if not chosen:
        return []
    wanted = [
        (shown.length.of(b.position[..., 2] - run.grid.low[2]),
         f"height of the centroid over the floor of the tank [{shown.length.name}]"),
        (np.linalg.norm(b.velocity, axis=2), "speed [m/s]"),
        (force.of(b.fluid_force[..., 2]), f"vertical force of the water [{force.name}]"),
        (force.of(np.linalg.norm(b.contact_force, axis=2)), f"contact force [{force.name}]"),
    ]  # fmt: skip
    since = [b.time >= b.release_time[k] - 1e-12 for k in chosen]
    order = {int(k): n for n, k in enumerate(b.dropped)}  # as the player colours them
    drawn = []
    for values, name in wanted:
        each = [Curve(b.time[rows], values[rows, k], order[k])
                for k, rows in zip(chosen, since, strict=True)]  # fmt: skip
        if np.isfinite(values).any():
            drawn.append(charts.lines(each, "time [s]", name))
    few = f"The first {_MANY} of {b.dropped.size} blocks." if b.dropped.size > _MANY else ""
    names = [(order[k], b.name[k] or f"block {k + 1}") for k in chosen]
    return [tag("div", *drawn, class_="charts"), charts.key(names), tag("p", few, class_="note")]


def _health(run: Run, shown: Units) -> Markup:
    """Whether the numbers can be trusted, those of the blocks, too, where there are any."""
    s = run.series
    rows = [check_row(check) for check in health.checks(run, shown)]
    drawn = []
    if run.bodies.n:
        share = 100 * s.max_overlap / scales.smallest(run)
        name = "largest overlap [% of the smallest block's length]"
        drawn.append(charts.lines([Curve(s.time, share, 6)], "time [s]", name))
    if np.isfinite(s.liquid_volume_drift).any():
        drawn.append(charts.lines([Curve(s.time, s.liquid_volume_drift, 2)], "time [s]",
                                  "drift of the liquid volume [-]"))  # fmt: skip
    return section(
        "health",
        "Health of the computation",
        table(["", "found", "wanted", ""], rows, numbers=False),
        tag("div", *drawn, class_="charts"),
    )


def check_row(check: Check) -> list[object]:
    """A check as a row of a table; below what was found stands what to do where it needs that."""
    todo = tag("div", f"→ {check.todo}", class_="todo") if check.todo else None
    return [check.name, markup(_whole(check.found), todo), _whole(check.wanted), mark(check.good)]


def _whole(text: str) -> str:
    """Text whose times and percentages stay on one line."""
    text = re.sub(r"t = ([\d.e+-]+) s", "t\u00a0=\u00a0\\1\u00a0s", text)
    return text.replace(" %", "\u00a0%")


def mark(good: bool | None) -> Markup:
    """Is a number as it should be? None: it is not known."""
    if good is None:
        return tag("span", "–")
    return tag("span", "✓ good", class_="good") if good else tag("span", "! look", class_="look")


def _settings(run: Run) -> Markup:
    rows: list[list[object]] = [list(row) for row in run_words.differing(run)]
    if not rows:
        said = tag("p", "Nothing: all else is at its default.")
    else:
        said = table(["variable", "here", "default"], rows, numbers=False)
    note = "Tank, cells, shapes and places of the blocks have no defaults and stand in the case."
    return section("settings", "What differs from the defaults", said,
                   tag("p", note, class_="note"))  # fmt: skip


def _provenance(run: Run) -> Markup:
    p = run.provenance
    threads, ranks = p.get("threads", 1), int(p.get("ranks", 1))
    seconds = float(run.series.wall_time[-1])
    pairs = [
        ("program", f"mics {p.get('version', '?')}, git revision {p.get('git_revision', '?')}"),
        ("compiled by", f"{p.get('compiler', '?')} {p.get('flags', '')}"),
        ("run on", f"{count(int(ranks), 'process', 'processes')} of "
         f"{count(int(threads), 'thread')}, {seconds:.0f} s"),
        ("started, finished", f"{p.get('started', '?')}, {p.get('finished', '') or '–'}"),
    ]  # fmt: skip
    rows: list[list[object]] = [[name, value] for name, value in pairs]
    text = str(p["namelist"])
    repeat = f"./mics --threads {threads} --output again case.nml"
    return section(
        "again",
        "Where this comes from, and how to get it again",
        table(["", ""], rows, numbers=False),
        tag("p", "Save ", download("case.nml", "text/plain", text, "case.nml"),
            " and run the same version of the program; the results have the same bits on any "
            "number of threads."),
        tag("pre", repeat),
        tag("details", tag("summary", "The case file as it was read"), tag("pre", markup(text))),
    )  # fmt: skip
