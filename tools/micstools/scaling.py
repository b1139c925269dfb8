"""What more processes on a network would give: the time of a step from what one process measured.

A step of P processes takes the work of the largest block, the work that every process does in full
(contact of the blocks, levels of the multigrid that are put together on all) and the messages, one
after the other: latency and length over bandwidth for layers, as many rounds as P has doublings for
what all take part in. Nothing is hidden behind work, and memory is as fast as for one process.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np

from micstools import messages
from micstools.reader import BadRun

SHARED_WORK = ("solid shares", "transport", "velocity and pressure")
OWN_WORK = "blocks"
HALF_SWEEP = 1.0e-9  # s, a cell of a half sweep of the multigrid on one core, measured
SWEEPS = 17  # half sweeps of a cycle on a coarse level, other work counted as one each
COARSER = 8 / 7  # cells of a level and all below it, over those of the level


@dataclass(frozen=True)
class Network:
    """What a message costs."""

    name: str
    latency: float  # s
    bandwidth: float  # of a node [B/s]
    per_node: int = 16  # processes that share it


USNIC = Network("Cisco usNIC, 40 Gb/s Ethernet", 1.93e-6, 37.23e9 / 8)
"""Half a round trip and largest rate of Open MPI 1.8.1 by NetPIPE: J. Squyres, "MPI over 40Gb
Ethernet", Cisco blogs, 2014."""


@dataclass(frozen=True)
class Measured:
    """A step on one process with one thread."""

    counted: messages.Counted
    per_cell: float  # s
    own: float  # s, that every process needs in full


@dataclass(frozen=True)
class Step:
    """Seconds of a step, by what they are for."""

    ranks: int
    pieces: tuple[int, int, int]
    cells: int  # of the largest block
    work: float
    own: float
    coarse: float
    halo: float
    gather: float
    reduction: float

    @property
    def total(self) -> float:
        """All of it."""
        return self.work + self.own + self.coarse + self.halo + self.gather + self.reduction


def read(folder: Path) -> Measured:
    """A run on one process and one thread."""
    try:
        counted = messages.read(folder)
    except ValueError as problem:
        raise BadRun(str(problem)) from problem
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        threads = int(h5["provenance"].attrs["threads"])
        timers = h5["timers"]
        seconds = dict(zip(timers["name"].asstr()[:], timers["seconds"][:], strict=True))
    if counted.ranks * threads != 1 or counted.steps == 0:
        raise BadRun(f"{folder}: not a run of one process with one thread and a step")
    shared = sum(float(seconds.get(name, 0.0)) for name in SHARED_WORK)
    cells = math.prod(counted.domain.cells)
    return Measured(
        counted,
        shared / counted.steps / cells,
        float(seconds.get(OWN_WORK, 0.0)) / counted.steps,
    )


def resized(domain: messages.Domain, cells: Sequence[int]) -> messages.Domain:
    """The same spacing on other cells."""
    return replace(domain, cells=(cells[0], cells[1], cells[2]))


def step(measured: Measured, domain: messages.Domain, ranks: int, network: Network) -> Step:
    """A step of so many processes on a domain."""
    counted = measured.counted
    fine = messages.blocks(domain, ranks)
    largest = int(fine.size.prod(axis=1).max())
    rate = network.bandwidth / min(ranks, network.per_node)
    spent = dict.fromkeys(messages.KINDS, 0.0)
    for each in messages.passes(domain, counted.asked, ranks):
        if each.kind == "gather":
            length = float((each.messages * each.length).sum())
            time = _rounds(ranks) * network.latency + length / rate
        elif each.messages.max() == 0:
            continue
        elif each.kind in ("reduction", "broadcast") or not _to_neighbours(each):
            time = _rounds(ranks) * (network.latency + float(each.length.max()) / rate)
        else:
            time = network.latency + float((each.messages * each.length).max()) / rate
        spent[each.kind] += each.calls * time / counted.steps
    coarse = 0.0
    if ranks > 1:
        *_, level = messages.levels(domain, fine)
        cycles = sum(each.calls for each in counted.asked if each.what == "cycle")
        coarse = cycles / counted.steps * float(level.cells.prod())
        coarse *= SWEEPS * COARSER * HALF_SWEEP
    return Step(
        ranks,
        fine.pieces,
        largest,
        measured.per_cell * largest,
        measured.own,
        coarse,
        spent["halo"] + spent["search"],
        spent["gather"],
        spent["reduction"] + spent["broadcast"],
    )


def _rounds(ranks: int) -> int:
    return math.ceil(math.log2(ranks))


def _to_neighbours(each: messages.Pass) -> bool:
    """Layers go to neighbours; a part of a search in which all take part has one message each."""
    return each.kind == "halo" or bool(np.any(each.messages != 1))


def strong(
    measured: Measured, cells: Sequence[int], ranks: Sequence[int], network: Network
) -> list[Step]:
    """The same cells on more and more processes."""
    domain = resized(measured.counted.domain, cells)
    return [step(measured, domain, n, network) for n in ranks]


def weak(measured: Measured, block: int, ranks: Sequence[int], network: Network) -> list[Step]:
    """A cube of so many cells along an edge for each process, put side by side."""
    found = []
    for n in ranks:
        edge = round(n ** (1 / 3))
        pieces = (edge, edge, n // edge**2) if n % edge**2 == 0 else (1, 1, n)
        domain = resized(measured.counted.domain, [block * p for p in pieces])
        found.append(step(measured, domain, n, network))
    return found


def table(steps: Sequence[Step], is_weak: bool) -> str:
    """The times as text; efficiency against the first line."""
    lines = [
        "| processes | pieces | cells of one | ms of a step | work | own | coarse | halo | gather "
        "| reductions | efficiency |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    first = steps[0]
    for each in steps:
        ideal = first.total if is_weak else first.total * first.ranks / each.ranks
        parts = (each.total, each.work, each.own, each.coarse, each.halo, each.gather)
        numbers = " | ".join(f"{1e3 * t:.3g}" for t in (*parts, each.reduction))
        pieces = " x ".join(map(str, each.pieces))
        share = f"{100 * ideal / each.total:.0f} %"
        lines.append(f"| {each.ranks} | {pieces} | {each.cells} | {numbers} | {share} |")
    return "\n".join(lines)
