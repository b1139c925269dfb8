"""How many messages a run on many processes sends, told from what any run has asked.

Results are the same on any number of processes, so the number of solver iterations, and with it
all that is asked, is too: `/timers` of a run on one process tells what many will send. What depends
on their number is how the domain is cut and which levels of the multigrid stay cut, and that is
worked out here as the program does it. Only the rounds of a search for connected cells (kind
`search`) depend on how these lie across the processes: they are those of the run that was read.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import f90nml
import h5py
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
KINDS = ("halo", "gather", "reduction", "broadcast", "search")
LEAST_CELLS = 4  # of a block in a direction that is cut
WEIGHT = (18.0, 9.0, 6.0)  # of a halo layer beside a cell, in each direction
ALIKE = 1.9  # ratio of spacings that are coarsened together
VECTOR = 8  # pairs of cells to a multiple of which the lines of a level are filled up
BOX = 24  # bytes that tell first and last cell of a block


@dataclass(frozen=True)
class Domain:
    """What of a case decides how it is cut."""

    cells: tuple[int, int, int]
    spacing: tuple[float, float, float]  # m
    periodic: tuple[bool, bool, bool]


@dataclass(frozen=True)
class Asked:
    """The same thing, asked so many times: `detail` is bytes of a cell, width and direction (from
    1) of layers, and bytes, 0, 0 of anything else."""

    what: str
    detail: tuple[int, int, int]
    calls: int


@dataclass(frozen=True)
class Counted:
    """What a run says of its messages; arrays follow `KINDS`."""

    ranks: int
    steps: int
    domain: Domain
    asked: list[Asked]
    messages: Ints  # of all processes together
    message_bytes: Ints
    messages_most: Ints  # of the one that sends most
    message_bytes_most: Ints


@dataclass(frozen=True)
class Sent:
    """What each process sends: arrays (ranks, kinds)."""

    messages: Ints
    message_bytes: Ints


@dataclass(frozen=True)
class Pass:
    """Something that passes between the processes so many times, all of them at once."""

    kind: str
    calls: int
    messages: Ints  # of each process in a call
    length: Ints  # of such a message [bytes]


@dataclass(frozen=True)
class Blocks:
    """The blocks of a level, one for each process: arrays (ranks, 3), cells counted from 1."""

    pieces: tuple[int, int, int]
    first: Ints
    last: Ints
    neighbours: Ints  # below and above, 0 to 2; none where a direction is not cut

    @property
    def size(self) -> Ints:
        """Cells in each direction."""
        return self.last - self.first + 1


@dataclass(frozen=True)
class Level:
    """A level of the multigrid and what each process holds of it."""

    cells: Ints
    paired: NDArray[np.bool_]
    blocks: Blocks
    cut: bool  # else every process holds all of it


def read(folder: Path) -> Counted:
    """What a finished run says of its messages in `/timers` of `run.h5`."""
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        timers, provenance = h5["timers"], h5["provenance"].attrs
        if "asked_what" not in timers:
            raise ValueError(f"{folder}: the run did not count its messages")
        text = provenance["parameters"]
        case = f90nml.reads(text.decode() if isinstance(text, bytes) else str(text))
        rows = zip(
            timers["asked_what"].asstr()[:],
            timers["asked_detail"][:],
            timers["asked_calls"][:],
            strict=True,
        )
        asked = [Asked(w, (int(d[0]), int(d[1]), int(d[2])), round(float(n))) for w, d, n in rows]
        names = ("messages", "message_bytes", "messages_most", "message_bytes_most")
        counts = [np.rint(timers[name][:]).astype(np.int64) for name in names]
        return Counted(
            int(provenance["ranks"]), int(timers.attrs["steps"]), _domain(case), asked, *counts
        )


def _domain(case: f90nml.Namelist) -> Domain:
    cells, length = case["grid"]["cells"], case["grid"]["length"]
    sides = [case["boundary"][f"{axis}_min"] for axis in "xyz"]
    return Domain(
        (int(cells[0]), int(cells[1]), int(cells[2])),
        (length[0] / cells[0], length[1] / cells[1], length[2] / cells[2]),
        (sides[0] == "periodic", sides[1] == "periodic", sides[2] == "periodic"),
    )


def _cuts(n: int, pieces: int, grain: int) -> list[int]:
    """Last cell of each piece, and 0 before; a half is rounded up as Fortran does."""
    cuts = [grain * math.floor(n * place / (pieces * grain) + 0.5) for place in range(pieces)]
    return [*cuts, n]


def _grain(n: int, pieces: int) -> int:
    """Power of two whose multiples are the cuts; 0 if there is none."""
    grain = 0
    for power in range(5):
        lengths = np.diff(_cuts(n, pieces, 2**power))
        if pieces > 1 and min(lengths) < LEAST_CELLS:
            continue
        if power > 2 and grain and max(lengths) > max(np.diff(_cuts(n, pieces, grain))):
            continue
        grain = 2**power
    return grain


def best_pieces(domain: Domain, ranks: int) -> tuple[int, int, int]:
    """Pieces in each direction: least cells of the largest block, its halo counted."""
    best, least = None, math.inf
    lengths: dict[tuple[int, int], int] = {}
    for x in range(1, ranks + 1):
        for y in range(1, ranks // x + 1):
            pieces = (x, y, ranks // (x * y))
            if math.prod(pieces) != ranks:
                continue
            for n, p in zip(domain.cells, pieces, strict=True):
                if (n, p) not in lengths:
                    g = _grain(n, p)
                    lengths[n, p] = int(max(np.diff(_cuts(n, p, g)))) if g else 0
            longest = [lengths[n, p] for n, p in zip(domain.cells, pieces, strict=True)]
            if 0 in longest:
                continue
            halo = 1.0 + sum(
                w / m for w, m, p in zip(WEIGHT, longest, pieces, strict=True) if p > 1
            )
            if halo * math.prod(longest) < least:
                best, least = pieces, halo * math.prod(longest)
    if best is None:
        raise ValueError(f"{domain.cells} cells cannot be cut for {ranks} processes")
    return best


def blocks(domain: Domain, ranks: int) -> Blocks:
    """The blocks of cells of the finest level, in the order of the processes."""
    pieces = best_pieces(domain, ranks)
    rank = np.arange(ranks)
    place = np.stack(
        [rank % pieces[0], rank // pieces[0] % pieces[1], rank // (pieces[0] * pieces[1])], axis=1
    )
    first, last = np.empty((ranks, 3), np.int64), np.empty((ranks, 3), np.int64)
    neighbours = np.zeros((ranks, 3), np.int64)
    for d in range(3):
        n, p = domain.cells[d], pieces[d]
        cuts = np.array(_cuts(n, p, _grain(n, p)))
        first[:, d], last[:, d] = cuts[place[:, d]] + 1, cuts[place[:, d] + 1]
        if p > 1:
            ends = 0 + (place[:, d] == 0) + (place[:, d] == p - 1)
            neighbours[:, d] = 2 if domain.periodic[d] else 2 - ends
    return Blocks(pieces, first, last, neighbours)


def levels(domain: Domain, fine: Blocks) -> Iterator[Level]:
    """The levels of the multigrid from fine to coarse, to the first that is put together on all
    processes; for that one `blocks` are the parts that come together."""
    n, h, part = np.array(domain.cells), np.array(domain.spacing), fine
    while True:
        paired = (n > 1) & (h / ALIKE < min(h[n > 1], default=0.0))
        cut = len(part.first) > 1 and _stays_cut(domain, n, paired, part)
        yield Level(n, paired, part, cut)
        if not cut:
            return
        part = Blocks(
            part.pieces,
            np.where(paired, (part.first + 1) // 2, part.first),
            np.where(paired, (part.last + 1) // 2, part.last),
            part.neighbours,
        )
        n, h = np.where(paired, (n + 1) // 2, n), np.where(paired, 2 * h, h)


def _stays_cut(domain: Domain, n: Ints, paired: NDArray[np.bool_], part: Blocks) -> bool:
    wraps = domain.periodic[0] and n[0] > 1 and n[0] % 2 == 1
    odd, thick = part.first % 2 == 1, part.size > 2
    return bool(odd[:, 0].all() and (odd & thick | ~paired).all() and not wraps)


def predict(counted: Counted, ranks: int) -> Sent:
    """What each of so many processes sends in the steps of a run."""
    messages = np.zeros((ranks, len(KINDS)), np.int64)
    sizes = np.zeros_like(messages)
    for each in passes(counted.domain, counted.asked, ranks):
        kind = KINDS.index(each.kind)
        messages[:, kind] += each.calls * each.messages
        sizes[:, kind] += each.calls * each.messages * each.length
    return Sent(messages, sizes)


def passes(domain: Domain, asked: list[Asked], ranks: int) -> Iterator[Pass]:
    """All that passes between so many processes for what is asked."""
    if ranks == 1:
        return
    fine = blocks(domain, ranks)
    for each in asked:
        if each.what == "cycle":
            yield from _cycles(domain, fine, each.calls)
        elif each.what == "setup":
            yield from _setups(domain, fine, each.calls)
        elif each.detail[2]:
            count = fine.neighbours[:, each.detail[2] - 1]
            yield Pass(each.what, each.calls, count, _layer(fine.size, *each.detail))
        else:
            count = np.full(ranks, int(each.what != "broadcast"))
            count[0] = 1
            yield Pass(each.what, each.calls, count, np.full(ranks, each.detail[0]))


def _layer(size: Ints, cell_bytes: int, width: int, direction: int) -> Ints:
    """Bytes of the layers that leave a block through one side."""
    across = np.delete(size, direction - 1, axis=1) + 2 * width
    return np.asarray(cell_bytes * width * across.prod(axis=1))


def _cycles(domain: Domain, fine: Blocks, calls: int) -> Iterator[Pass]:
    """What cycles of the multigrid send."""
    for number, level in enumerate(levels(domain, fine)):
        if level.cut:
            # load, three half sweeps, on coarser levels four more, prolong, four or eight
            yield from _fills(level.blocks, calls * (9 if number == 0 else 17))
        else:
            yield from _gathers(level.blocks.size, 4, calls)


def _setups(domain: Domain, fine: Blocks, calls: int) -> Iterator[Pass]:
    """What new coefficients of its levels send."""
    for level in levels(domain, fine):
        if level.cut:
            yield from _fills(level.blocks, calls)
            continue
        for d in range(3):
            faces = level.blocks.size.copy()
            faces[:, d] += level.blocks.last[:, d] == level.cells[d]
            yield from _gathers(faces, 8, calls)


def _gathers(size: Ints, cell_bytes: int, calls: int) -> Iterator[Pass]:
    """Blocks of all processes put together: where they lie, then what they hold."""
    one = np.ones(len(size), np.int64)
    yield Pass("gather", calls, one, BOX * one)
    yield Pass("gather", calls, one, cell_bytes * size.prod(axis=1))


def _fills(block: Blocks, calls: int) -> Iterator[Pass]:
    """Layers of a level, direction by direction: ends of lines, or whole lines of pairs, filled
    up; in single precision."""
    size = block.size + 2
    pairs = (block.last[:, 0] + 1) // 2 - (block.first[:, 0] + 1) // 2 + 1
    line = 2 * (VECTOR * ((pairs + VECTOR - 1) // VECTOR) + 2)
    lengths = (4 * size[:, 1] * size[:, 2], 4 * line * size[:, 2], 4 * line * size[:, 1])
    for d, length in enumerate(lengths):
        yield Pass("halo", calls, block.neighbours[:, d], length)
