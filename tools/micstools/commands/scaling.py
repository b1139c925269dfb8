"""What more processes would give."""

import argparse
import math
from pathlib import Path

from micstools import scaling
from micstools.command import RUN_HELP, results_of
from micstools.commands.base import Command
from micstools.reader import BadRun


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("run", type=Path, help=RUN_HELP + "; of one process with one thread")
    add("--ranks", default="1,2,4,8,64,512,1000", metavar="N,N,...", help="(%(default)s)")
    add("--cells", metavar="NX,NY,NZ", help="of another tank of that kind")
    add("--weak", type=int, metavar="N", help="N x N x N cells for each process instead")
    add("--latency", type=float, metavar="US", help="of a message [us], default: "
        f"{1e6 * scaling.USNIC.latency:g}, {scaling.USNIC.name}")  # fmt: skip
    add("--bandwidth", type=float, metavar="GBIT", help="of a node [Gbit/s], default: "
        f"{8e-9 * scaling.USNIC.bandwidth:g}")  # fmt: skip
    add("--per-node", type=int, default=scaling.USNIC.per_node, help="processes (%(default)s)")


def _whole(option: str, word: str) -> list[int]:
    """Numbers of processes or cells."""
    try:
        found = [int(part) for part in word.split(",")]
    except ValueError:
        found = [0]
    if min(found) < 1:
        raise BadRun(f"{option} {word}: must be whole numbers above zero")
    return found


def _network(given: argparse.Namespace) -> scaling.Network:
    plain = scaling.USNIC
    if given.latency is None and given.bandwidth is None:
        return scaling.Network(plain.name, plain.latency, plain.bandwidth, given.per_node)
    latency = plain.latency if given.latency is None else 1e-6 * given.latency
    bandwidth = plain.bandwidth if given.bandwidth is None else 1e9 / 8 * given.bandwidth
    if not (latency >= 0 and bandwidth > 0 and given.per_node > 0):
        raise BadRun("--latency, --bandwidth and --per-node must be positive")
    return scaling.Network("a network", latency, bandwidth, given.per_node)


def _scaling(given: argparse.Namespace) -> int:
    measured, network = scaling.read(results_of(given.run)), _network(given)
    ranks = _whole("--ranks", given.ranks)
    cells = list(measured.counted.domain.cells)
    if given.cells:
        cells = _whole("--cells", given.cells)
        if len(cells) != 3:
            raise BadRun(f"--cells {given.cells}: must be NX,NY,NZ")
    print(
        f"{network.name}: {1e6 * network.latency:.3g} us, {8e-9 * network.bandwidth:.4g} Gbit/s "
        f"for {network.per_node} processes"
    )
    try:
        if given.weak:
            steps = scaling.weak(measured, given.weak, ranks, network)
        else:
            print(f"{math.prod(cells)} cells")
            steps = scaling.strong(measured, cells, ranks, network)
    except ValueError as problem:
        raise BadRun(str(problem)) from problem
    print(scaling.table(steps, bool(given.weak)))
    return 0


SCALING = Command(
    "scaling",
    "Foretell the time of a step on more processes, from a run on one and the cost of messages.",
    (
        "scaling mics-out --cells 800,400,80",
        "scaling mics-out --weak 64 --latency 1.3 --bandwidth 200 --per-node 64",
    ),
    _arguments,
    _scaling,
)
