"""The page of a run: the fall to play, the pile to scale, what the blocks felt, whether the numbers
can be trusted, and how to get them again."""

from dataclasses import dataclass

import numpy as np

from micstools import block_numbers, kicks, pile, pile_numbers
from micstools.balance import EXCESS_LIMIT
from micstools.block_numbers import BlockNumbers
from micstools.energy import ENERGY_LIMIT, largest_excess, made_by_contact
from micstools.geometry import Array
from micstools.overlap import Overlap, Placed, overlap, present_bodies
from micstools.page import charts, motion, run_words
from micstools.page.charts import Curve
from micstools.page.html import Markup, data, document, download, facts, markup, section, table, tag
from micstools.page.parts import north_note, number, player, swatch
from micstools.page.run_words import count, millimetres
from micstools.page.views import Sheet, bed_of, block_colours
from micstools.pile_numbers import PileNumbers
from micstools.reader import Run

_START = """
const runPlayer = startPlayer(document.getElementById('player'));
if (runPlayer) runPlayer.load(read('scene'));
"""
DRIFT = 1e-9  # of the liquid: what rounding explains
_CELLS = 10.0  # along a block, as the readme asks for
_MANY = 16  # blocks with a curve of their own
_OVERLAP = 0.01  # of a block's length
_MADE = 3e-3  # of a block's weight times its length


Row = tuple[str, str, str, bool | None]
"""Of the health: what, found, wanted, and whether it is as wanted (None: not known)."""


@dataclass(frozen=True)
class Found:
    """What the parts of the page share."""

    numbers: PileNumbers
    overlap: Overlap
    blocks: list[BlockNumbers]
    step: float  # of the plan area [m]


def page(run: Run, north: float | None = None) -> str:
    """The page of a run as text; without blocks it tells of the case and of the numbers only.
    `north`: its direction in the plan, degrees from +y towards +x."""
    title = run_words.title(run)
    case = section("case", "The case", *(tag("p", words) for words in run_words.case(run)))
    last = (_settings(run), _provenance(run))
    if not run.bodies.n:
        lead = (
            f"A run of {run.series.time[-1]:.3g} s without blocks; mics-tools plot draws its water."
        )
        return document(title, tag("h1", title), tag("p", lead, class_="lead"), case,
                        _health(run), *last, script="")  # fmt: skip
    step = pile_numbers.usual_step(run)
    found = Found(pile_numbers.numbers(run, step), overlap(run), block_numbers.of_blocks(run), step)
    return document(
        title,
        tag("h1", title),
        tag("p", outcome(run, found), class_="lead"),
        player("player", "the fall of the blocks; arrow keys turn it, + and - zoom, space plays"),
        north_note(north),
        _facts(run, found),
        case,
        _pile(run),
        _blocks(run, found),
        _health(run, found),
        *last,
        data("scene", motion.scene(run, north)),
        script=_START,
    )


def outcome(run: Run, found: Found) -> str:
    """How the run ended, in a sentence or two."""
    b = run.bodies
    n, end = len(found.blocks), float(b.time[-1])
    missing = int((~b.fixed).sum()) - n
    if missing:
        said = f"After {end:.3g} s {count(missing, 'block is', 'blocks are')} still to come and "
        said += f"{count(n, 'block was', 'blocks were')} let go"
    elif found.numbers.time_to_rest == found.numbers.time_to_rest:
        said = f"After {found.numbers.time_to_rest:.3g} s {count(n, 'free block')} "
        said += "lies still" if n == 1 else "lie still"
    else:
        said = f"After {end:.3g} s {count(n, 'free block')} still "
        said += "moves" if n == 1 else "move"
    low = found.numbers.on_floor
    top = found.numbers.top - float(run.grid.low[2])
    return (
        f"{said}; the pile is {millimetres(top)} high, and "
        f"{count(low, 'free block touches', 'free blocks touch')} the floor."
    )


def _facts(run: Run, found: Found) -> Markup:
    n, b = found.numbers, run.bodies
    size = run.grid.high - run.grid.low
    hardest = max((k.contact_force for k in found.blocks), default=float("nan"))
    return facts(
        [
            ("top of the pile", millimetres(n.top - float(run.grid.low[2])), "above the floor"),
            ("plan covered", f"{100 * n.plan_area / (size[0] * size[1]):.0f} %",
             f"{1e4 * n.plan_area:.4g} cm²"),
            ("time to rest", number(n.time_to_rest, ".3g", "s"), f"of {b.time[-1]:.3g} s"),
            ("contacts per block", f"{n.coordination:.2f}", "with other blocks"),
            ("first impact", number(n.impact_speed, ".3g", "m/s"), "the fastest"),
            ("hardest contact", number(hardest, ".3g", "N"), "mean of a step"),
        ]
    )  # fmt: skip


def _pile(run: Run) -> Markup:
    """The pile of the end from three sides."""
    bodies = present_bodies(run, -1)
    level = _last_level(run)
    sheet = Sheet(run.grid.low, _upper_corner(run, bodies, level), bed_of(run))
    colours = block_colours(run.bodies.dropped, run.bodies.n)
    drawn = [sheet.drawing(bodies, colours, view, level) for view in ("front", "side", "top")]
    words = "All views have one scale; blocks bear their numbers, fixed ones are grey."
    words += " The dashed line is the water level." if level is not None else ""
    return section("pile", "The pile at the end", tag("div", *drawn, class_="views"),
                   tag("p", words, class_="note"))  # fmt: skip


def _upper_corner(run: Run, bodies: dict[int, Placed], level: float | None) -> Array:
    """Of what is shown: the tank, but for much air above the pile and the water."""
    tops = [float(body.points[:, 2].max()) for body in bodies.values()]
    low, high = run.grid.low, np.array(run.grid.high)
    needed = max([*tops, *([level] if level is not None else [])], default=float(high[2]))
    high[2] = min(high[2], max(needed, low[2]) + 0.1 * float((high - low).max()))
    return high


def _last_level(run: Run) -> float | None:
    """The mean level of the water at the end; the one it should have where no field was written."""
    return pile.water_level(run).found if pile.has_level(run) else pile.still_level(run)


def _blocks(run: Run, found: Found) -> Markup:
    colours = block_colours(run.bodies.dropped, run.bodies.n)
    heads: list[object] = ["block", "released [s]", "at rest [s]", "first impact [m/s]",
                           "largest contact force [N]", "in weights", "largest force of water [N]",
                           "turned [°]", "x, y, z at the end [mm]"]  # fmt: skip
    rows: list[list[object]] = [
        [
            swatch(colours[k.block], k.block),
            number(k.released),
            number(k.at_rest),
            number(k.impact_speed),
            number(k.contact_force),
            number(k.contact_force / k.weight),
            number(k.fluid_force),
            number(k.turned, ".0f"),
            ", ".join(f"{1e3 * v:.1f}" for v in k.place),
        ]
        for k in found.blocks
    ]
    note = "Forces are means over a time step; the force of the water includes buoyancy."
    return section("blocks", "Fall and forces of each block", table(heads, rows),
                   tag("p", note, class_="note"), *_curves(run))  # fmt: skip


def _curves(run: Run) -> list[Markup]:
    """Charts against time and their key, of the first blocks where there are many."""
    b = run.bodies
    shown = [int(k) for k in b.dropped if b.present(-1)[k]][:_MANY]
    if not shown:
        return []
    wanted = [
        (1e3 * (b.position[..., 2] - run.grid.low[2]), "height of the centroid [mm]"),
        (np.linalg.norm(b.velocity, axis=2), "speed [m/s]"),
        (b.fluid_force[..., 2], "vertical force of the water [N]"),
        (np.linalg.norm(b.contact_force, axis=2), "contact force [N]"),
    ]
    drawn = [
        charts.lines(_each(run, shown, values), "time [s]", name)
        for values, name in wanted
        if np.isfinite(values).any()
    ]
    few = f"The first {_MANY} of {b.dropped.size} blocks." if b.dropped.size > _MANY else ""
    names = [(order, f"block {k + 1}") for order, k in enumerate(shown)]
    return [tag("div", *drawn, class_="charts"), charts.key(names), tag("p", few, class_="note")]


def _each(run: Run, shown: list[int], values: Array) -> list[Curve]:
    """A curve for each block from its release on."""
    b = run.bodies
    found = []
    for order, k in enumerate(shown):
        here = b.time >= b.release_time[k] - 1e-12
        found.append(Curve(b.time[here], values[here, k], order))
    return found


def _health(run: Run, found: Found | None = None) -> Markup:
    """Whether the numbers can be trusted, those of the blocks, too, where there are any."""
    s = run.series
    rows: list[list[object]] = [[*row[:3], mark(row[3])] for row in _checks(run, found)]
    drawn = []
    if found:
        drawn.append(charts.lines([Curve(s.time, 1e3 * s.max_overlap, 6)], "time [s]",
                                  "largest overlap [mm]"))  # fmt: skip
    if np.isfinite(s.liquid_volume_drift).any():
        drawn.append(charts.lines([Curve(s.time, s.liquid_volume_drift, 2)], "time [s]",
                                  "drift of the liquid volume [-]"))  # fmt: skip
    return section(
        "health",
        "Health of the computation",
        table(["", "found", "wanted", ""], rows, numbers=False),
        tag("div", *drawn, class_="charts"),
    )


def mark(good: bool | None) -> Markup:
    """Is a number as it should be? None: it is not known."""
    if good is None:
        return tag("span", "–")
    return tag("span", "✓ good", class_="good") if good else tag("span", "! look", class_="look")


def overlap_limit(run: Run) -> float:
    """What no overlap should exceed at any time [m]."""
    return 3 * _OVERLAP * _smallest(run)


def energy_limit(run: Run) -> float:
    """What contact may make in a step by rounding and by the length of its substeps [J]; infinite
    where nothing has weight."""
    g = float(np.linalg.norm(run.gravity))
    return _MADE * float(run.bodies.mass.min()) * g * _smallest(run) if g > 0 else np.inf


def divergence_limit(run: Run) -> float:
    """What the case allows [1/s]."""
    return float(run.value("numerics", "divergence_tolerance", 1e-6))


def _checks(run: Run, found: Found | None) -> list[Row]:
    s, code = run.series, int(run.provenance.get("exit_status", -1))
    rows: list[Row] = [("end of the run", _ending(code), "regular end", code == 0)]
    if found:
        rows += _overlaps(run, found)
    if np.isfinite(s.liquid_volume_drift).any():
        drift = float(np.nanmax(np.abs(s.liquid_volume_drift)))
        rows.append(("drift of the liquid volume", f"{drift:.1e}", f"below {DRIFT:.0e}",
                     drift < DRIFT))  # fmt: skip
        if np.isfinite(s.volume_excess_max).any():
            rows.append(_excess(float(np.nanmax(s.volume_excess_max))))
        rows.append(_energy(run))
        worst = float(np.nanmax(s.divergence_max[1:], initial=0.0))
        limit = divergence_limit(run)
        rows.append(("largest divergence", f"{worst:.1e} 1/s", f"below {limit:.0e} 1/s",
                     worst < limit))  # fmt: skip
        if kick := kicks.largest(run):
            wanted = f"below {kicks.LIMIT:g} g over {kick.window:.2g} s"
            name = "largest acceleration of an untouched block"
            rows.append((name, f"{kick}", wanted, kick.good))
        if found:
            cells = _smallest(run) / float(run.grid.spacing.max())
            rows.append(("cells along the smallest block", f"{cells:.3g}", f"{_CELLS:.0f} or more",
                         cells >= _CELLS - 1e-9))  # fmt: skip
    return rows


def _excess(most: float) -> Row:
    """Largest difference of the fluid of a cell from its open volume [V]."""
    good = most <= EXCESS_LIMIT
    wanted = f"up to {EXCESS_LIMIT:.0e}"
    if not good:
        wanted += (
            ": cells hold more or less fluid than fits beside the blocks, so the level of the water"
            " is not exact; in a closed tank overlaps of blocks do this"
        )
    return "largest excess of fluid in a cell, of its volume", f"{most:.1e}", wanted, good


def _energy(run: Run) -> Row:
    """Largest energy of fluid and blocks over what was put in."""
    name = "largest energy of fluid and blocks over what was put in, of what was set free"
    wanted = f"up to {100 * ENERGY_LIMIT:.0f} %"
    if not (excess := largest_excess(run)):
        return name, "not known", f"{wanted}; known where only weight does work", None
    if not excess.good:
        wanted += ": the steps make energy, take a smaller dt or cfl_max"
    return name, f"{excess}", wanted, excess.good


def _overlaps(run: Run, found: Found) -> list[Row]:
    highest = float(np.nanmax(run.series.max_overlap))
    made, most = float(made_by_contact(run).max()), energy_limit(run)
    energy = ("largest energy that contact made in a step", f"{made:.1e} J", f"below {most:.1e} J",
              made < most)  # fmt: skip
    rows: list[Row] = [
        (name, millimetres(value), f"below {millimetres(limit)}", value < limit)
        for name, value, limit in (
            (
                "overlap of the true shapes at the end",
                found.overlap.largest,
                _OVERLAP * _smallest(run),
            ),
            ("largest overlap at any time", highest, overlap_limit(run)),
        )
    ]
    return [*rows, energy]


def _smallest(run: Run) -> float:
    """Length of the smallest block [m]."""
    return min(run.shapes[name].length for name in run.bodies.shape)


def _ending(code: int) -> str:
    known = {0: "regular", 3: "numerics, or a drop without room", 4: "trouble with files",
             130: "stopped by a user", 143: "stopped", -1: "still running, or killed"}  # fmt: skip
    return f"{known.get(code, 'unknown')} (code {code})"


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
