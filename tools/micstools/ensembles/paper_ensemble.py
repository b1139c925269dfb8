"""The fifty drops of Yoshikawa et al. (2008) anew, and what moves the shares of their patterns.

Of the piles that stay under water the paper tells two: A, all dropped blocks upon the three fixed
ones, and B, often a fourth block on the floor, "about equally often". It tells as well which block
it was that rolled down to the floor: the third or the fourth.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from micstools.cases import settings
from micstools.piles import pile_ensemble
from micstools.piles.pile_ensemble import Pile
from micstools.reading.overlap import find_contacts
from micstools.reading.reader import BadRun, Run
from micstools.reading.shares import in_words
from micstools.shapes.geometry import quaternion_from_axis, quaternion_product

UPWARDS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Choice:
    """One way to make the drops: what differs from the case as it is."""

    name: str  # of its folder
    words: str
    set_to: tuple[str, ...] = ()  # settings, group.variable=value
    options: tuple[str, ...] = ()  # of `mics-tools ensemble`
    bodies: Callable[[str], str] = field(default=lambda text: text)  # of the text of the case

    def text(self, case: str) -> str:
        """The case with what differs."""
        return settings.set_variables(self.bodies(case), map(settings.parse, self.set_to))


def _of_body(text: str, name: str, k: int) -> list[float]:
    """A variable of a &body, counted from 0."""
    found: list[float] | None = settings.value(text, "body", name, k)
    if found is None:
        raise BadRun(f"the case has no &body {k + 1} with a {name}: it is not the paper's")
    return found


def fixed_at(distance: float) -> Callable[[str], str]:
    """The outer of three fixed blocks at +- `distance` [m] from the middle one."""

    def moved(text: str) -> str:
        for k, sign in ((0, -1), (2, 1)):
            x, *others = _of_body(text, "position", 1)
            place = [round(x + sign * distance, 9), *others]
            text = settings.set_group(text, "body", {"position": place}, k)
        return text

    return moved


def fixed_turned(*degrees: float) -> Callable[[str], str]:
    """Each fixed block turned about the upright through its centre [degrees]."""

    def turned(text: str) -> str:
        for k, angle in enumerate(degrees):
            old = np.array(_of_body(text, "quaternion", k))
            new = quaternion_product(quaternion_from_axis(UPWARDS, angle), old)
            text = settings.set_group(text, "body", {"quaternion": [float(q) for q in new]}, k)
        return text

    return turned


CHOICES = (
    Choice("as_it_is", "as it is"),
    Choice("spheres", "contact spheres of the paper", ("contact.model='spheres'",)),
    Choice("mics", "coupling of the paper", ("numerics.coupling='mics'",)),
    Choice("friction_04", "friction 0.4", ("contact.friction=0.4",)),
    Choice("friction_08", "friction 0.8", ("contact.friction=0.8",)),
    Choice("floor_02", "friction of floor and walls 0.2", ("contact.wall_friction=0.2",)),
    Choice("floor_06", "friction of floor and walls 0.6", ("contact.wall_friction=0.6",)),
    Choice("restitution_01", "restitution 0.1", ("contact.restitution=0.1",)),
    Choice("restitution_06", "restitution 0.6", ("contact.restitution=0.6",)),
    Choice("places_65", "fixed blocks 65 mm apart", bodies=fixed_at(0.065)),
    Choice("places_80", "fixed blocks 80 mm apart", bodies=fixed_at(0.08)),
    Choice("turned", "all fixed blocks turned by 60 degrees", bodies=fixed_turned(60, 60, 60)),
    Choice("mixed", "the middle fixed block turned by 60 degrees", bodies=fixed_turned(0, 60, 0)),
    Choice("shift_2", "shifts up to 2 mm", options=("--spread", "0.002")),
    Choice("shift_10", "shifts up to 10 mm", options=("--spread", "0.01")),
    Choice("tilt_5", "tilts up to 5 degrees", options=("--tilt", "5")),
    Choice("tilt_15", "tilts up to 15 degrees", options=("--tilt", "15")),
)
"""What the paper leaves open, or chose itself."""


def first_on_floor(run: Run) -> int | None:
    """Number of the drop, from 1, of the first one that lies on the floor in the end, if any."""
    seen = find_contacts(run, -1)
    return next((n for n, k in enumerate(run.bodies.dropped, 1) if seen.on_floor(int(k))), None)


def row(words: str, piles: Iterable[Pile]) -> dict[str, Any]:
    """The shares of one way: patterns, A of those under water, which drop came to the floor."""
    piles = list(piles)
    counted = Counter(p.pattern for p in piles)
    under = counted["A"] + counted["B"]
    drops = Counter(first_on_floor(p.run) for p in piles if p.pattern == "B")
    tops = [p.numbers.top for p in piles if p.pattern != "neither"]
    return {
        "what": words,
        "runs": len(piles),
        "A": counted["A"],
        "B": counted["B"],
        "neither": counted["neither"],
        "A of those under water": in_words(counted["A"], under) if under else "-",
        "first on the floor": ", ".join(f"drop {n}: {m}" for n, m in sorted(drops.items())) or "-",
        "top [mm]": f"{1e3 * float(np.median(tops)):.0f}" if tops else "-",
    }


def row_of(words: str, folder: Path) -> dict[str, Any]:
    """The same of the folder of an ensemble."""
    return row(words, pile_ensemble.open_ensemble(folder).piles)


def as_markdown(rows: list[dict[str, Any]]) -> str:
    """A table for people."""
    lines = ["| " + " | ".join(rows[0]) + " |", "|" + " --- |" * len(rows[0])]
    lines += ["| " + " | ".join(str(v) for v in found.values()) + " |" for found in rows]
    return "\n".join(lines) + "\n"
