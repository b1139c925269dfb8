"""The form of a pile: how much of a box is void, how steep its sides are, how its blocks lie."""

from itertools import permutations, product

import numpy as np
from contourpy import contour_generator

from micstools.reading.overlap import Placed
from micstools.shapes.geometry import Array, rotation_matrix, volume_in_box
from micstools.shapes.shape import Shape

_CREST, _TOE = 0.9, 0.1  # of the height: a side runs between them
_SAMPLES = 20_000  # random attitudes that tell what random is


def around(bodies: list[Placed], low: Array, high: Array) -> tuple[Array, Array]:
    """The box around blocks, no larger than the tank."""
    points = np.concatenate([body.points for body in bodies])
    return np.maximum(points.min(axis=0), low), np.minimum(points.max(axis=0), high)


def porosity(bodies: list[Placed], low: Array, high: Array, bed: float = 0.0) -> float:
    """Share of the box between `low` and `high` (3) [m] that no block fills, of what the `bed`
    leaves of it: the volume of bed in the box [m3]. Exact; where blocks overlap they count twice.
    nan where the bed leaves nothing."""
    filled = sum(_volume_within(body, low, high) for body in bodies)
    room = float(np.prod(high - low)) - bed
    return float(1 - filled / room) if room > 0 else float("nan")


def _volume_within(body: Placed, low: Array, high: Array) -> float:
    """Volume of a block between `low` and `high` (3) [m3]; only a block across a side is cut."""
    first, last = body.points.min(axis=0), body.points.max(axis=0)
    if (first >= low).all() and (last <= high).all():
        return body.shape.volume
    if (first > high).any() or (last < low).any():
        return 0.0
    return volume_in_box(body.tets, low, high)


def layer(top: Array, ground: Array) -> tuple[float, float]:
    """Mean and largest height [m] of the top of a pile (ny, nx) above the `ground` (ny, nx) under
    it, where it covers that; nan without a pile."""
    thick = (top - ground)[np.isfinite(top)]
    return (float(thick.mean()), float(thick.max())) if thick.size else (np.nan, np.nan)


def footprint(top: Array, step: float) -> float:
    """Area [m2] of the smallest convex plan that holds all that a pile covers, from its height map
    (ny, nx) of squares of `step` [m]."""
    y, x = np.nonzero(np.isfinite(top))
    if not x.size:
        return 0.0
    corners = np.concatenate([np.stack([x + i, y + j], axis=1) for i in (0, 1) for j in (0, 1)])
    line = hull(np.unique(corners, axis=0))
    (a, b), (c, d) = line.T, np.roll(line, -1, axis=0).T
    return 0.5 * abs(float((a * d - b * c).sum())) * step**2


def hull(points: Array) -> Array:
    """Corners (k, 2) of the convex hull of points (n, 2) that are sorted by their first, then their
    second coordinate: A. M. Andrew (1979), two chains."""
    chains = []
    for ordered in (points, points[::-1]):
        chain: list[Array] = []
        for p in ordered:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return np.array(chains, float)


def _turn(a: Array, b: Array, c: Array) -> float:
    """Twice the area of a triangle (2) each, positive where it turns left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def outline(top: Array, low: Array, step: float) -> list[Array]:
    """Closed lines (k, 2) [m] around what a pile covers, seen from above, from its height map
    (ny, nx) of squares of `step` [m] from the corner `low`: outer ones counter-clockwise, holes
    clockwise, each half a square off at most."""
    covered = np.pad(np.isfinite(top), 1).astype(float)
    found = contour_generator(z=covered).lines(0.5)
    return [low[:2] + (np.asarray(line, float) - 0.5) * step for line in found]


def slopes(height: Array, step: float) -> tuple[float, float, float, float]:
    """Angles [degrees] of the sides of a pile towards -x, +x, -y, +y, from a map (ny, nx) of its
    height above the ground [m]: of the line through the outermost squares that reach 90 % and 10 %
    of it, seen from the side. 90: upright; nan: the pile lies against the end of the map."""
    height = np.nan_to_num(height, nan=0.0)
    along_x, along_y = height.max(axis=0), height.max(axis=1)
    left, right, front, back = (
        _slope(profile, step) for profile in (along_x, along_x[::-1], along_y, along_y[::-1])
    )
    return left, right, front, back


def _slope(profile: Array, step: float) -> float:
    """Angle [degrees] of the side at the beginning of a profile of heights."""
    highest = profile.max()
    if highest <= 0:
        return float("nan")
    toe = int(np.flatnonzero(profile >= _TOE * highest)[0])
    crest = int(np.flatnonzero(profile >= _CREST * highest)[0])
    if toe == 0:
        return float("nan")
    rise = float(profile[crest] - profile[toe])
    return float(np.degrees(np.arctan2(rise, (crest - toe) * step))) if crest > toe else 90.0


def symmetries(shape: Shape) -> Array:
    """Turns (k, 3, 3) about axes of the body, by right angles, that leave a shape as it is."""
    corners = shape.points[np.unique(shape.edges)]
    found = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.eye(3)[list(order)] * np.array(signs)[:, None]
        far = np.linalg.norm((corners @ turn.T)[:, None] - corners, axis=2).min(axis=1)
        if np.linalg.det(turn) > 0 and far.max(initial=0.0) < 1e-4 * shape.radius:
            found.append(turn)
    return np.array(found)


def attitude_randomness(shape: Shape, quaternions: Array) -> float:
    """How differently blocks of a shape lie, from their attitudes (n, 4): the mean angle between
    two of them over that between random ones. 0: all alike; about 1: at random; nan: one block.
    Attitudes that look the same, as a cube turned by 90 degrees, are the same."""
    if len(quaternions) < 2:
        return float("nan")
    turns = symmetries(shape)
    rotation = rotation_matrix(quaternions)
    angles = [_angles(rotation[k], rotation[k + 1 :], turns) for k in range(len(rotation) - 1)]
    draws = np.random.default_rng(1).normal(size=(_SAMPLES, 4))
    usual = _angles(np.eye(3), rotation_matrix(draws), turns)
    return float(np.concatenate(angles).mean() / usual.mean())


def _angles(one: Array, others: Array, turns: Array) -> Array:
    """Smallest angle [rad] of a turn from attitude `one` (3, 3) to each of `others` (n, 3, 3)."""
    between = np.einsum("ji,njk->nik", one, others)
    trace = np.einsum("nik,ski->ns", between, turns).max(axis=1)
    return np.asarray(np.arccos(np.clip((trace - 1) / 2, -1, 1)))
