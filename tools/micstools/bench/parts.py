"""The parts of the bench: each gives rows, dictionaries of what was run and what it took."""

import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from micstools.bench import dry_pile, jobs
from micstools.bench.jobs import Job
from micstools.bench.timing import Timing
from micstools.reading.reader import Run

Row = dict[str, Any]
KEYS = ("part", "job", "threads", "ranks", "size")
"""What tells rows apart."""
PILE = 64  # blocks
PILE_SECONDS = 2.0


@dataclass(frozen=True)
class Means:
    """What the bench works with."""

    programs: tuple[Path, Path]  # serial and parallel; the latter may not be there
    repeat: int
    threads: int

    @property
    def crews(self) -> list[tuple[int, int]]:
        """Threads and ranks: one, all threads, as many ranks."""
        found = [(1, 1)]
        if self.threads > 1:
            found.append((self.threads, 1))
            if self.programs[1].exists():
                found.append((1, self.threads))
        return found


def whole_jobs(means: Means) -> Iterator[Row]:
    """The two tanks of the paper from start to end, once, on all threads."""
    for name in ("blocks", "blocks_coarse"):
        job = Job(name, jobs.whole(name), means.threads)
        yield row("whole", job.name, [_fresh(partial(jobs.run, job, means.programs))],
                  threads=job.threads)  # fmt: skip


def short_jobs(means: Means) -> Iterator[Row]:
    """The start of the main job, a dam break, a dry pile."""
    texts = {"blocks": jobs.blocks(0.3), "dam_break": jobs.dam_break()}
    for name, text in texts.items():
        for threads, ranks in means.crews:
            job = Job(name, text, threads, ranks)
            runs = [_fresh(partial(jobs.run, job, means.programs)) for _ in range(means.repeat)]
            yield row("jobs", name, runs, threads=threads, ranks=ranks)
    for threads, ranks in means.crews:
        if ranks == 1:
            yield _pile("jobs", PILE, PILE_SECONDS, threads, means.repeat, means)


def growth(means: Means) -> Iterator[Row]:
    """A few steps of the main job on ever more cells, a dry pile of ever more blocks."""
    for factor in (1, 2, 4):
        job = Job(f"cells x {factor**3}", jobs.blocks(0.04, factor))
        yield row("growth", job.name, [_fresh(partial(jobs.run, job, means.programs))])
    for n in (9, 64, 512, 1000):
        yield _pile("growth", n, 0.5, 1, 1, means)


def _pile(part: str, n: int, seconds: float, threads: int, repeat: int, means: Means) -> Row:
    def work(folder: Path) -> tuple[Timing, float]:
        timing = jobs.pile(n, seconds, means.programs[0], threads, folder)
        if part != "jobs":
            return timing, float("nan")
        end = Run(folder / "result").bodies
        return timing, 1e3 * dry_pile.true_depth(end.position[-1], end.quaternion[-1])

    runs = [_fresh(work) for _ in range(repeat)]
    found = row(part, "pile", [timing for timing, _ in runs], threads=threads)
    return found | ({"depth_mm": round(runs[0][1], 3)} if part == "jobs" else {})


def _fresh(work: Callable[[Path], Any]) -> Any:
    """Work in an empty folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        return work(Path(folder))


def row(part: str, job: str, runs: list[Timing], threads: int = 1, ranks: int = 1) -> Row:
    """The fastest of some runs, and by how much the slowest took longer."""
    best = min(runs, key=lambda run: run.wall)
    numbers = {
        "simulated": best.simulated,
        "wall": best.wall,
        "cpu": best.cpu,
        "spread": max(run.wall for run in runs) / best.wall - 1,
        "ns": 1e9 * best.cpu / (best.steps * best.size),
        "step_ms": 1e3 * best.stepping / best.steps,
        "memory": best.memory,
        "memory_each": best.memory / best.size,
    }
    known = {k: float(f"{v:.4g}") for k, v in numbers.items() if v == v}
    about = {"part": part, "job": job, "threads": threads, "ranks": ranks}
    shares = {"phases": {k: round(v, 4) for k, v in best.phases.items()}} if best.phases else {}
    return about | {"size": best.size, "steps": best.steps} | known | shares


def version(program: Path) -> str:
    """The first line that a program says of itself."""
    done = subprocess.run([program, "--version"], check=True, capture_output=True, text=True)
    return done.stdout.splitlines()[0]
