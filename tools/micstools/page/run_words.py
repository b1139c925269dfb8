"""The case and the end of a run in words."""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from micstools.reader import Run

_SMALL = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
          "eleven", "twelve")  # fmt: skip


def count(n: int, thing: str, things: str | None = None) -> str:
    """As in `six blocks`."""
    number = _SMALL[n] if n < len(_SMALL) else str(n)
    return f"{number} {thing if n == 1 else things or thing + 's'}"


def millimetres(value: float, digits: int = 3) -> str:
    """A length in mm, or in m from 10 m on."""
    return f"{value:.{digits}g} m" if abs(value) >= 10 else f"{1e3 * value:.{digits}g} mm"


def title(run: Run, folder: Path | None = None) -> str:
    """The title of the case, else the name of a folder, by default its own."""
    said = str(run.value("run", "title", "") or "").strip()
    return said or (folder or run.folder).resolve().name


def capital(text: str) -> str:
    """With a capital letter."""
    return text[:1].upper() + text[1:]


def shapes(run: Run) -> list[str]:
    """A sentence for each shape that is used."""
    found = []
    for name in dict.fromkeys(run.bodies.shape):
        shape = run.shapes[name]
        size = " x ".join(f"{1e3 * edge:.3g}" for edge in np.ptp(shape.points, axis=0))
        kind = next((s for s in run.parameters.get("shape", []) if s.get("name") == name), {})
        form = str(kind.get("kind", "")).strip()
        form = f" ({form})" if form and form != name else ""
        found.append(
            f"A block '{name}'{form} is {size} mm large, has {1e6 * shape.volume:.4g} cm³ and "
            f"weighs {shape.volume * shape.density:.4g} kg ({shape.density:.0f} kg/m³)."
        )
    return found


def blocks(run: Run) -> str:
    """How many blocks there are, and how they come in."""
    b = run.bodies
    free = b.dropped
    if not b.n:
        return "There are no blocks."
    fixed = int(b.fixed.sum())
    said = capital(count(b.n - fixed, "free block"))
    said += f" and {count(fixed, 'fixed one')}" if fixed else ""
    due = [t for t in b.release_time[free] if np.isfinite(t)]
    if len(due) > 1 and max(due) > min(due):
        said += f", let go between {min(due):.3g} and {max(due):.3g} s"
    return said + "." + "".join(f" {capital(text)}." for text in drops(run))


def drops(run: Run) -> list[str]:
    """A half sentence for each &drop."""
    found = []
    for drop in run.parameters.get("drop", []):
        x, y, z = (float(v) for v in drop["position"])
        n = int(drop.get("count", 1))
        said = f"{count(n, 'block is', 'blocks are')} dropped at x = {1e3 * x:.4g}, "
        said += f"y = {1e3 * y:.4g}, z = {1e3 * z:.4g} mm"
        said += f", one every {drop.get('interval', 1.0):.3g} s" if n > 1 else ""
        said += "".join(f", {words}" for words in chance(drop))
        said += f" (seed {drop.get('seed', 1)})" if chance(drop) else ""
        found.append(said)
    return found


def chance(drop: dict[str, Any]) -> list[str]:
    """What of a &drop is left to chance."""
    found = []
    spread = [float(v) for v in np.ravel(drop.get("spread", 0.0))]
    if any(spread):
        sizes = ", ".join(f"{1e3 * v:.3g}" for v in spread)
        found.append(f"moved by chance up to ± ({sizes}) mm")
    if float(drop.get("tilt_deg", 0.0)):
        found.append(f"tilted by chance up to {drop['tilt_deg']:.3g}°")
    if str(drop.get("orientation", "given")).strip() == "random":
        found.append("turned anyhow")
    return found


def tank(run: Run) -> str:
    """The tank, its water and its cells."""
    size, spacing = run.grid.high - run.grid.low, run.grid.spacing
    said = "The tank is " + " x ".join(f"{v:.4g}" for v in size) + " m"
    level = run.value("fluid", "water_level", None)
    if str(run.value("run", "physics", "coupled")).strip() == "dry":
        said += " and dry"
    elif bool(run.value("fluid", "single_phase", False)):
        said += " and full of liquid"
    elif level is not None:
        said += f", its water {millimetres(float(level) - float(run.grid.low[2]))} deep at first"
    said += "; it has " + " x ".join(str(len(f) - 1) for f in run.grid.faces) + " cells of "
    return said + " x ".join(f"{1e3 * v:.3g}" for v in spacing) + " mm."


def contact(run: Run) -> str:
    """How blocks touch: what a reader must know who doubts the pile."""
    model = {"surface": "exact surfaces", "spheres": "the spheres of the paper"}
    kind = str(run.value("contact", "model", "surface")).strip()
    said = f"Blocks touch by {model.get(kind, kind)} with a friction of "
    said += f"{run.value('contact', 'friction', 0.6):.3g} on each other and "
    said += f"{run.value('contact', 'wall_friction', 0.4):.3g} on walls and floor"
    if str(run.value("contact", "law", "restitution")).strip() == "restitution":
        said += f", and spring back with {run.value('contact', 'restitution', 0.3):.3g} of "
        said += "their speed"
    return said + "."


def case(run: Run) -> list[str]:
    """The whole case, a paragraph each."""
    parts = [blocks(run)]
    if run.bodies.n:
        parts.append(" ".join(shapes(run)))
    parts.append(tank(run))
    if run.bodies.n:
        parts.append(contact(run))
    return parts


def differing(run: Run) -> list[tuple[str, str, str]]:
    """Variables of the case that are not at their defaults: name, value, default. What has no
    default, and where blocks and drops are, is the case itself and stands elsewhere."""
    found = []
    for group, known in _defaults().items():
        if group in ("body", "drop", "shape", "water", "grid"):
            continue
        for name, value in (run.parameters.get(group) or [{}])[0].items():
            usual = known.get(name)
            if usual is not None and name not in ("title", "output") and not _same(value, usual):
                found.append((f"{group}.{name}", shown(value), shown(usual)))
    return found


def _defaults() -> dict[str, dict[str, Any]]:
    """Default of each variable of each group, from the schema that is made of the program."""
    kinds = json.loads((files("micstools") / "mics-case.schema.json").read_text())["$defs"]
    return {
        group: {name: entry.get("default") for name, entry in kind.get("properties", {}).items()}
        for group, kind in kinds.items()
    }


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
