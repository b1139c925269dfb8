"""Where units lie: place, attitude, deviation from the plan, rest and contacts of each; over the
runs of an ensemble the ellipse in which a unit lands, and the share within a tolerance."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from micstools import files
from micstools.reading import rest
from micstools.reading.overlap import find_contacts
from micstools.reading.reader import Run
from micstools.reading.shares import in_words, wilson
from micstools.reading.units import Unit
from micstools.shapes.geometry import Array

TOLERANCE = 0.5
"""Usual tolerance of a single unit under water, over D_n50. Source: The Rock Manual (CIRIA C683),
9.3, vertical placing tolerances of bulk armour; taken here for the plan."""
ELLIPSE = 0.9
"""Part of the landings in the ellipse, were they normally distributed."""


@dataclass(frozen=True)
class Survey:
    """Where the tank lies in the coordinates of a survey: these of the point 0, 0, 0 of the case,
    the direction of north in the plan, from +y towards +x [degrees], and their system."""

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  # easting, northing, level [m]
    north: float = 0.0
    crs: str | None = None  # as EPSG:25832

    def of(self, points: Array) -> Array:
        """East, north and level (..., 3), or east and north (..., 2), of places in the case [m]."""
        turn, found = math.radians(self.north), np.array(points, float)
        x, y = found[..., 0].copy(), found[..., 1].copy()
        found[..., 0] = x * math.cos(turn) - y * math.sin(turn)
        found[..., 1] = x * math.sin(turn) + y * math.cos(turn)
        return np.asarray(found + np.array(self.origin[: found.shape[-1]]))


@dataclass(frozen=True)
class Place:
    """What became of a unit; nan or empty for one that was not released."""

    unit: int
    name: str
    x: float
    y: float
    z: float
    heading_deg: float
    tilt_deg: float
    deviation: float
    at_rest: int
    neighbours: int
    contacts: int
    shape: str
    fixed: int
    time: float
    plan_x: float
    plan_y: float
    plan_z: float
    touching: str
    exit_time: float


MEANINGS = tomllib.loads((Path(__file__).parents[1] / "meanings.toml").read_text())
MEANING: dict[str, str] = MEANINGS["place"]
"""The columns of a table of places."""


def heading_and_tilt(quaternion: Array, north: float = 0.0) -> tuple[float, float]:
    """Heading in [0, 360) and tilt in [0, 180] degrees of an attitude w, x, y, z: the tilt turns
    about a horizontal axis, after a turn about the vertical that alone makes the heading. An
    unturned unit heads east: 90."""
    w, x, y, z = (float(v) for v in quaternion)
    tilt = 2 * math.atan2(math.hypot(x, y), math.hypot(w, z))
    turned = 2 * math.atan2(z, w)  # from +x towards +y
    heading = (90.0 - math.degrees(turned) - north) % 360.0
    return (0.0 if heading == 360.0 else heading), math.degrees(tilt)


def has_plan(run: Run) -> bool:
    """Are units meant to lie where they are let go: have they names, or does a crane lower them?"""
    drops = run.parameters.get("drop", [])
    return any(run.bodies.name) or any(drop.get("lowering_speed", 0) > 0 for drop in drops)


def planned(run: Run) -> Array:
    """Place (N, 3) of each body in the plan [m]: where it is let go, without the random shift that
    `spread` gives it. The last row before its release shows the level, and all of it in results of
    older programs; nan of one not released."""
    b = run.bodies
    rows = np.searchsorted(b.time, b.release_time + 1e-12, side="right") - 1
    released = b.released(-1)
    start = b.position[rows.clip(0), np.arange(b.n)]
    found = b.position[(rows + 1).clip(0, len(b.time) - 1), np.arange(b.n), 2]
    waits = start[:, 2] > run.grid.high[2]  # over the tank, until its level is found
    start[waits, 2] = found[waits]
    start[:, :2] = np.where(np.isfinite(b.planned), b.planned, start[:, :2])
    return np.where(released[:, None], start, np.nan)


def ends(run: Run) -> Array:
    """Place (N, 3) of each body at the end [m]; a way through a period goes on."""
    plan = planned(run)
    return np.asarray(run.into_tank(plan) + run.bodies.position[-1] - plan)


def places(run: Run, survey: Survey = Survey()) -> list[Place]:  # noqa: B008 (it is frozen)
    """Every unit at the end of a run, in the order of their numbers."""
    b, plan = run.bodies, planned(run)
    seen = find_contacts(run, len(b.time) - 1)
    present, shown = b.present(-1), survey.of(run.into_tank(plan))
    level = np.where(present[:, None], survey.of(ends(run)), math.nan)
    away = np.linalg.norm((b.position[-1] - plan)[:, :2], axis=1)
    found = []
    for k, here in enumerate(present):
        heading, tilt = heading_and_tilt(b.quaternion[-1, k], survey.north)
        beside = sorted(seen.of(k))
        stays = here and (b.fixed[k] or not math.isnan(rest.of_block(run, k).time))
        found.append(
            Place(
                unit=k + 1, name=b.name[k],
                x=float(level[k, 0]), y=float(level[k, 1]), z=float(level[k, 2]),
                heading_deg=heading if here else math.nan, tilt_deg=tilt if here else math.nan,
                deviation=float(away[k]), at_rest=int(stays), neighbours=len(beside),
                contacts=len(beside) + len(seen.walls_of(k)) + (k in seen.bed),
                shape=b.shape[k], fixed=int(b.fixed[k]),
                time=float(b.release_time[k]) if np.isfinite(plan[k, 0]) else math.nan,
                plan_x=float(shown[k, 0]), plan_y=float(shown[k, 1]), plan_z=float(shown[k, 2]),
                touching=" ".join(str(j + 1) for j in beside),
                exit_time=float(b.exit_time[k]) if np.isfinite(b.exit_time[k]) else math.nan,
            )
        )  # fmt: skip
    return found


def csv_text(found: Sequence[Place]) -> str:
    """The places as a table, a row each; what is not known is empty."""
    return files.table_text(map(row_of, found), list(MEANING))


def row_of(place: Place) -> dict[str, object]:
    """A row of a table; empty where something is not known."""
    return {name: "" if value != value else value for name, value in asdict(place).items()}


def frame(run: Run) -> pd.DataFrame:
    """The places as a table; `attrs["meaning"]` explains the columns."""
    table = pd.DataFrame([asdict(p) for p in places(run)], columns=list(MEANING))
    table.attrs["meaning"] = MEANING
    return table


@dataclass(frozen=True)
class Within:
    """Units that lie nearer to their place in the plan than a tolerance, seen from above."""

    tolerance: float  # [m]
    units: int  # free ones, released
    count: int
    interval_95: tuple[float, float]
    left_out: int = 0  # free ones that were not released

    @property
    def share(self) -> float:
        """Of the units; nan without one."""
        return self.count / self.units if self.units else math.nan


def placed(found: Sequence[Place]) -> list[Place]:
    """The free units that were released."""
    return [p for p in found if not p.fixed and p.deviation == p.deviation]


def is_within(p: Place, tolerance: float) -> bool:
    """Is a unit at its place? One out of the tank is not."""
    return p.deviation <= tolerance and p.exit_time != p.exit_time


def within(found: Sequence[Place], tolerance: float) -> Within:
    """Of all free units that were released."""
    units = placed(found)
    count = sum(is_within(p, tolerance) for p in units)
    left = sum(not p.fixed for p in found) - len(units)
    return Within(tolerance, len(units), count, wilson(count, len(units)), left)


def share_words(found: Within, length: Unit) -> str:
    """The share within a tolerance, in words."""
    left = f"; left out: {found.left_out} not released" if found.left_out else ""
    return (
        f"{in_words(found.count, found.units)} of the free units lie within "
        f"{length.text(found.tolerance)} of their place in the plan{left}."
    )


@dataclass(frozen=True)
class Landing:
    """Where a unit lands over the runs of an ensemble."""

    unit: int
    name: str
    landings: int
    x: float  # mean [m]
    y: float
    long: float  # half axes of the ellipse that holds the part ELLIPSE of normal landings [m]
    short: float
    heading_deg: float  # of the long one, from +y (north) towards +x (east), in [0, 180)
    within: Within


def ellipse(points: Array) -> tuple[Array, float, float, float]:
    """Middle (2), half axes [m] and direction of the long one [degrees from +y towards +x, below
    180] of the ellipse that holds the part ELLIPSE of a normal distribution with the mean and the
    covariance of points (n, 2): chi^2 of two degrees of freedom, -2 ln(1 - p). nan for one
    point."""
    middle = points.mean(axis=0)
    if len(points) < 2:
        return middle, math.nan, math.nan, math.nan
    values, axes = np.linalg.eigh(np.cov(points.T))
    values[0] *= values[0] > 1e-12 * values[1]  # else it is round-off
    short, long = np.sqrt(-2 * math.log(1 - ELLIPSE) * values)
    heading = math.degrees(math.atan2(*axes[:, 1])) % 180.0
    return middle, float(long), float(short), heading


def ellipse_line(
    middle: Array, long: float, short: float, heading_deg: float, n: int = 72
) -> Array:
    """Points (n + 1, 2) [m] around an ellipse."""
    turn, angle = math.radians(heading_deg), np.linspace(0, 2 * np.pi, n + 1)
    axis = np.array([math.sin(turn), math.cos(turn)])
    across = np.array([axis[1], -axis[0]])
    return np.asarray(middle + long * np.cos(angle)[:, None] * axis
                      + short * np.sin(angle)[:, None] * across)  # fmt: skip


def landings(runs: Sequence[Sequence[Place]], tolerance: float) -> list[Landing]:
    """Of each free unit that landed in one run at least. What lies within the tolerance counts also
    the runs in which the unit left the tank."""
    each: dict[int, list[Place]] = {}
    for one in runs:
        for p in one:
            if not p.fixed and (p.x == p.x or p.exit_time == p.exit_time):
                each.setdefault(p.unit, []).append(p)
    found = []
    for _, released in sorted(each.items()):
        known = [p for p in released if p.x == p.x]
        if not known:
            continue
        middle, long, short, heading = ellipse(np.array([(p.x, p.y) for p in known]))
        x, y, who = float(middle[0]), float(middle[1]), known[0]
        found.append(Landing(who.unit, who.name, len(known), x, y, long, short, heading,
                             within(released, tolerance)))  # fmt: skip
    return found
