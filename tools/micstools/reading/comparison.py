"""Two runs beside each other: what their cases differ in, when their blocks part, how they end."""

from dataclasses import dataclass

import numpy as np

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, attitude_change_deg

PART = 0.01  # of a block's length: farther from each other, blocks have parted


@dataclass(frozen=True)
class BlockDifference:
    """One block in two runs."""

    block: int  # from 1
    parted: float  # when it was first farther apart than `PART` of its length [s]; nan: never
    distance: float  # of the centroids at the end [m]
    angle: float  # between the attitudes at the end [degrees]


def parameters(one: Run, two: Run) -> list[tuple[str, str, str]]:
    """Name and values of each variable that differs; groups of a name are counted from 1."""
    found = []
    for group in dict.fromkeys([*one.parameters, *two.parameters]):
        first, second = one.parameters.get(group, []), two.parameters.get(group, [])
        for k in range(max(len(first), len(second))):
            a = first[k] if k < len(first) else {}
            b = second[k] if k < len(second) else {}
            place = f"{group}[{k + 1}]" if max(len(first), len(second)) > 1 else group
            found += [
                (f"{place}.{name}", _said(a, name), _said(b, name))
                for name in dict.fromkeys([*a, *b])
                if _said(a, name) != _said(b, name)
            ]
    return found


def _said(group: dict[str, object], name: str) -> str:
    return str(group[name]).strip() if name in group else "-"


def same_bits(one: Run, two: Run) -> bool:
    """Do the blocks of both runs move alike, bit by bit?"""
    a, b = one.bodies, two.bodies
    names = ("time", "position", "quaternion", "velocity", "fluid_force", "contact_force")
    return all(np.array_equal(getattr(a, n), getattr(b, n), equal_nan=True) for n in names)


def blocks(one: Run, two: Run) -> list[BlockDifference]:
    """Each free block that both runs have with the same shape."""
    a, b = one.bodies, two.bodies
    both = [k for k in range(min(a.n, b.n)) if a.shape[k] == b.shape[k] and not a.fixed[k]]
    return [
        BlockDifference(
            block=k + 1,
            parted=_parting(one, two, k),
            distance=float(np.linalg.norm(a.position[-1, k] - b.position[-1, k])),
            angle=float(attitude_change_deg(a.quaternion[-1, k], b.quaternion[-1, k])),
        )
        for k in both
    ]


def _parting(one: Run, two: Run, k: int) -> float:
    """When a block (from 0) of one run first was far from that of the other."""
    a, b = one.bodies, two.bodies
    time = a.time[a.time <= b.time[-1] + 1e-12]
    other = np.stack([np.interp(time, b.time, b.position[:, k, d]) for d in range(3)], axis=1)
    apart: Array = np.linalg.norm(a.position[: len(time), k] - other, axis=1)
    far = np.flatnonzero(apart > PART * 2 * one.shapes[a.shape[k]].radius)
    return float(time[far[0]]) if far.size else float("nan")
