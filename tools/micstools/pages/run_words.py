"""The case and the end of a run in words."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from micstools.reading.reader import Run
from micstools.reading.schema import schema, variables
from micstools.reading.units import Units, figure
from micstools.shapes.geometry import Array

_SMALL = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
          "eleven", "twelve")  # fmt: skip
_KINDS = ("hexapod", "cube", "box", "sphere", "cylinder", "tetrapod", "dolos", "reef_cube", "rock")
_PLURALS = {"box": "boxes", "dolos": "dolosse"}


def count(n: int, thing: str, things: str | None = None) -> str:
    """As in `six blocks`."""
    number = _SMALL[n] if n < len(_SMALL) else str(n)
    return f"{number} {thing if n == 1 else things or thing + 's'}"


LIGHT = (
    "No flow was computed: blocks fell in a given water with buoyancy, added mass and a drag "
    "coefficient. Times and speeds of falls of compact blocks are within 10 to 20 %; wakes, "
    "tumbling and tilted plates are not in it, and piles are as good as without water, no better."
)


def title(run: Run, folder: Path | None = None) -> str:
    """The title of the case, else the name of a folder, by default its own; and its note."""
    said = run.value("run", "title") or (folder or run.folder).resolve().name
    return said + (f" ({run.note})" if run.note else "")


def capital(text: str) -> str:
    """With a capital letter."""
    return text[:1].upper() + text[1:]


def shapes(run: Run, units: Units) -> list[str]:
    """A sentence for each shape that is used, one for all stones of a family."""
    # The stones in use of each family of which there are several
    used, found = sorted(set(run.bodies.shape)), []
    families = [str(s.get("name")).strip() for s in run.parameters.get("shape", [])
                if str(s.get("kind")).strip() == "rock"]  # fmt: skip
    stones = {f: [name for name in used if re.fullmatch(rf"{re.escape(f)}-\d+", name)]
              for f in families}  # fmt: skip
    stones = {family: members for family, members in stones.items() if len(members) > 1}
    for family, members in stones.items():
        mass = [run.shapes[name].volume * run.shapes[name].density for name in members]
        length = [run.shapes[name].length for name in members]
        found.append(
            f"{len(members)} stones of '{family}' have masses of {units.mass.figure(min(mass))} to "
            f"{units.mass.text(max(mass))} and are {units.length.figure(min(length))} to "
            f"{units.length.text(max(length))} long ({run.shapes[members[0]].density:.0f} kg/m³)."
        )
    told = [name for members in stones.values() for name in members]
    for name in dict.fromkeys(run.bodies.shape):
        if name in told:
            continue
        shape = run.shapes[name]
        size = units.length.row(np.ptp(shape.points, axis=0), " x ")
        form = _kind(run, name)
        form = f" ({form})" if form and form != name else ""
        found.append(
            f"A block '{name}'{form} measures {size}, has a volume of "
            f"{units.volume.text(shape.volume)} and a mass of "
            f"{units.mass.text(shape.volume * shape.density)} ({shape.density:.0f} kg/m³)."
        )
    return found


def _kind(run: Run, name: str) -> str:
    """The kind of a shape by its name."""
    groups = run.parameters.get("shape", [])
    kind = next((s for s in groups if str(s.get("name")).strip() == name), {})
    return str(kind.get("kind", "")).strip()


def blocks(run: Run, units: Units) -> str:
    """How many blocks there are, and how they come in."""
    b = run.bodies
    if not b.n:
        return "There are no blocks."
    placed = len(run.parameters.get("body", []))
    fixed, free = int(b.fixed.sum()), int((~b.fixed[:placed]).sum())
    said = [count(fixed, "fixed block")] if fixed else []
    said += [f"{count(free, 'free block')} from the case's &body"] if free else []
    said += drops(run, units)
    groups = run.parameters.get("drop", [])
    last = max((t for t in b.entry_time[placed:] if np.isfinite(t)), default=0.0)
    listed = any(str(drop.get("file", "") or "").strip() for drop in groups)  # times are there
    if groups and not listed and last > 1e-9 + max(_due(drop)[-1] for drop in groups):
        said.append(f"blocks waited for room: the last came at t = {figure(last)} s")
    return " ".join(capital(text) + "." for text in said)


def drops(run: Run, units: Units, seeds: bool = True) -> list[str]:
    """A half sentence for each kind of &drop, with the `seeds` of what is random; groups that
    differ in place, time and seed alone are listed once."""
    alike: dict[str, list[dict[str, Any]]] = {}
    own = ("position", "to", "first_time", "count", "seed")
    for drop in run.parameters.get("drop", []):
        key = repr(sorted((k, repr(v)) for k, v in drop.items() if k not in own))
        alike.setdefault(key, []).append(drop)
    return [_dropped(run, group, units, seeds) for group in alike.values()]


def _dropped(run: Run, group: list[dict[str, Any]], units: Units, with_seeds: bool) -> str:
    """Drops that are alike: how many of what, when, where, and what is left to chance."""
    one = group[0]
    total = sum(int(drop.get("count", 1)) for drop in group)
    file = str(one.get("file", "") or "").strip()
    if file:
        return f"blocks are dropped at the places of {file}"
    # As in `12 tetrapods`; with the name of the shape where that is not its kind
    name = str(one.get("shape", "") or "").strip()
    kind = _kind(run, name)
    word = kind.replace("_", " ") if kind in _KINDS else "block"
    named = "" if name == kind or not name else f" '{name}'"
    said = [f"{total} {word if total == 1 else _PLURALS.get(word, word + 's')}{named}"]
    said += [*_times(group), f"dropped {_places(group, units)}"]
    said += attitude(one)
    seeds = [int(drop.get("seed", 1)) for drop in group]
    turned = str(one.get("orientation", "given")).strip() == "random" or one.get("tilt_deg")
    if with_seeds and (turned or np.any(one.get("spread", 0.0))):
        few = len(set(seeds)) == 1
        said[-1] += f" (seed {seeds[0]})" if few else f" (seeds {min(seeds)} to {max(seeds)})"
    return ", ".join(said)


def _times(group: list[dict[str, Any]]) -> list[str]:
    """When blocks are due: at once, one every so many seconds, or between two times; nothing for a
    single one at the start."""
    due = np.concatenate([_due(drop) for drop in group])
    times, many = np.unique(np.round(due, 9), return_counts=True)
    start = f" from t = {figure(times[0])} s on" if times[0] > 0 else ""
    if times.size == 1:
        at_once = "at once" if due.size > 1 else ""
        when = f"{at_once} at t = {figure(times[0])} s" if times[0] > 0 else at_once
        return [when.strip()] if when else []
    steps = np.diff(times)
    if np.allclose(steps, steps[0]) and (many == many[0]).all():
        each = "one" if many[0] == 1 else f"{many[0]} at once"
        return [f"{each} every {figure(steps[0])} s{start}"]
    return [f"from t = {figure(times[0])} to {figure(times[-1])} s"]


def _due(drop: dict[str, Any]) -> Array:
    """Times at which the blocks of a &drop are due [s]."""
    number = np.arange(max(1, int(drop.get("count", 1))))
    return np.asarray(
        float(drop.get("first_time", 0.0)) + float(drop.get("interval", 1.0)) * number
    )


def _places(group: list[dict[str, Any]], units: Units) -> str:
    """As in `at x = 14 ± 4, y = 3 ± 1.4, z = 11.2 m`, or from the first to the last of several."""
    places = np.array([drop[k] for drop in group for k in ("position", "to") if _given(drop, k)])
    spread = np.broadcast_to(np.ravel(group[0].get("spread", 0.0)).astype(float), 3)
    words = []
    for axis, low, high, by_chance in zip(
        "xyz", places.min(axis=0), places.max(axis=0), spread, strict=True
    ):
        text = f"{axis}\u00a0=\u00a0{units.place.figure(low)}"
        if high - low > 1e-9 * max(abs(low), abs(high)):
            text += f" to {units.place.figure(high)}"
        words.append(text + (f" ± {units.length.figure(by_chance)}" if by_chance else ""))
    several = (places != places[0]).any()
    return ("from " if several else "at ") + ", ".join(words) + f" {units.length.name}"


def _given(drop: dict[str, Any], name: str) -> bool:
    """Is a place of a drop given?"""
    found = drop.get(name)
    return found is not None and all(isinstance(v, (int, float)) for v in np.ravel(found).tolist())


def attitude(drop: dict[str, Any]) -> list[str]:
    """What of the attitude of a &drop is left to chance."""
    found = []
    if float(drop.get("tilt_deg", 0.0)):
        found.append(f"random tilt up to {figure(float(drop['tilt_deg']))}°")
    if str(drop.get("orientation", "given")).strip() == "random":
        found.append("random attitude")
    return found


def tank(run: Run, units: Units) -> str:
    """The tank, its water and its cells."""
    size, spacing = run.grid.high - run.grid.low, run.grid.spacing
    said = "The tank measures " + units.length.row(size, " x ", 4)
    level = run.value("fluid", "water_level")
    if run.physics == "dry":
        said += " and is dry"
    elif run.value("fluid", "single_phase"):
        said += " and is full of liquid"
    elif level is not None:
        depth = float(level) - float(run.grid.low[2])
        said += f", its water stands {units.length.text(depth, 4)} above its floor at first"
    said += "; it has " + " x ".join(str(len(f) - 1) for f in run.grid.faces) + " cells of "
    said += units.length.row(spacing, " x ") + "."
    return f"{said} {LIGHT}" if run.physics == "light" else said


def contact(run: Run) -> str:
    """How blocks touch: what a reader must know who doubts the pile."""
    model = {"surface": "exact surfaces", "spheres": "the spheres of the paper"}
    kind = run.value("contact", "model")
    said = f"Blocks touch by {model.get(kind, kind)} with a friction of "
    said += f"{run.value('contact', 'friction'):.3g} on each other and "
    said += f"{run.value('contact', 'wall_friction'):.3g} on walls and floor"
    on_bed = run.value("bed", "friction") if run.parameters.get("bed") else None
    said += f", {on_bed:.3g} on the bed" if on_bed is not None else ""
    if run.value("contact", "law") == "restitution":
        said += f", and spring back with {run.value('contact', 'restitution'):.3g} of "
        said += "their speed"
    return said + "."


def case(run: Run, units: Units) -> list[str]:
    """The whole case, a paragraph each."""
    parts = [blocks(run, units)]
    if run.bodies.n:
        parts.append(" ".join(shapes(run, units)))
    parts.append(tank(run, units))
    if run.bodies.n:
        parts.append(contact(run))
    return parts


def differing(run: Run) -> list[tuple[str, str, str]]:
    """Variables of the case that are not at their defaults: name, value, default. What has no
    default, and where blocks and drops are, is the case itself and stands elsewhere."""
    found = []
    for group in schema()["$defs"]:
        if group in ("body", "drop", "shape", "water", "grid"):
            continue
        for name, value in (run.parameters.get(group) or [{}])[0].items():
            usual = variables(group).get(name, {}).get("default")
            if usual is not None and name not in ("title", "output") and not _same(value, usual):
                found.append((f"{group}.{name}", shown(value), shown(usual)))
    return found


def _same(value: Any, usual: Any) -> bool:
    if isinstance(value, str) or isinstance(usual, str):
        return str(value).strip() == str(usual).strip()
    try:
        return bool(np.allclose(np.asarray(value, float), np.asarray(usual, float), rtol=1e-9))
    except (TypeError, ValueError):
        return bool(value == usual)


def shown(value: Any) -> str:
    """A value as in a case file."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, list):
        return ", ".join(shown(v) for v in value)
    return f"'{value.strip()}'" if isinstance(value, str) else f"{value:.6g}"
