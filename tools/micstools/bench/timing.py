"""How long a program takes, on which machine."""

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Timing:
    """One run of a job."""

    wall: float  # [s]
    cpu: float  # [s]
    memory: float  # largest resident [bytes]
    simulated: float  # [s]
    steps: int  # of the water, or substeps of contact
    size: int  # cells, or blocks
    stepping: float = float("nan")  # [s] of the wall time, without start and output
    phases: dict[str, float] = field(default_factory=dict)  # shares of `stepping`


AS_ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
"""Else Open MPI refuses to start in a container."""


def mpirun(ranks: int) -> list[str]:
    """The words before a program that is to run on some ranks; none for one."""
    words = ["mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(ranks)]
    return words if ranks > 1 else []


ALONE = """import os, resource, subprocess, sys
code, told = subprocess.call(sys.argv[2:]), sys.argv[1]
used = resource.getrusage(resource.RUSAGE_CHILDREN)
with open(told + os.environ.get("OMPI_COMM_WORLD_RANK", ""), "w") as file:
    print(used.ru_utime + used.ru_stime, used.ru_maxrss, file=file)
sys.exit(code)
"""


def alone(told: Path, *words: object) -> list[str]:
    """A command by a small Python, which writes the CPU seconds and the largest memory [kB] into a
    file; its name ends with the rank. Linux counts what the calling process holds as taken by what
    it starts."""
    return [sys.executable, "-I", "-S", "-c", ALONE, *map(str, (told, *words))]


def timed(
    words: Sequence[object], folder: Path, excused: str | None = None
) -> tuple[float, float, float]:
    """Run a program: wall and CPU seconds, its own and its children's, and largest memory of one of
    them [bytes]. An exit code other than 0 is an error, unless the program says what is
    `excused`."""
    with tempfile.NamedTemporaryFile("r") as told:
        began = time.perf_counter()
        done = subprocess.run(
            alone(Path(told.name), *words),
            cwd=folder,
            env=os.environ | AS_ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        wall = time.perf_counter() - began
        used = [float(word) for word in told.read().split()]
    if done.returncode and not (excused and excused in done.stdout):
        last = done.stdout.strip().splitlines()[-1:] or ["nothing said"]
        raise subprocess.SubprocessError(f"{words[0]} ended with {done.returncode}: {last[0]}")
    return wall, used[0], used[1] * (1 if sys.platform == "darwin" else 1024)


def processor() -> str:
    """The name of the processor, where the system tells."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def work_at_once(n: int) -> float:
    """How many times the work of one program n programs do at once that only count; n where each
    has a core of its own."""
    words = [sys.executable, "-c", "n = 0\nfor i in range(20_000_000): n += i"]
    walls = []
    for programs in (1, n):
        began = time.perf_counter()
        for running in [subprocess.Popen(words) for _ in range(programs)]:
            running.wait()
        walls.append(time.perf_counter() - began)
    return n * walls[0] / walls[1]


def bandwidth() -> float:
    """Bytes a second that one core adds up from and to memory, best of five [1/s].

    In a process of its own: the largest memory of a program begins with that of who starts it."""
    words = [sys.executable, "-c", ADD_IN_MEMORY]
    return float(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


ADD_IN_MEMORY = """
import time
import numpy as np

a, b = np.ones(20_000_000), np.ones(20_000_000)
c, best = np.zeros_like(a), float("inf")
for _ in range(5):
    began = time.perf_counter()
    np.add(a, b, out=c)
    best = min(best, time.perf_counter() - began)
print(3 * a.nbytes / best)
"""
