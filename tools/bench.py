"""Time three jobs and write the table: the main job, a dam break and a dry pile.

usage: python tools/bench.py [--out build/bench.json] [--repeat 3] [--threads 1] [--program ./mics]

Each job is run `--repeat` times; the table shows the fastest and how much longer the slowest
took, and the load of the machine beforehand, for other programs at work spoil figures. Reading
and writing are included. `ns` is the CPU time of a cell and step, or of a block and substep. With
more than one thread it tells first how much work that many programs of one thread get done at
once: the two virtual cores of a rented machine are often halves of one, and then no program gains.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import f90nml

sys.path.insert(0, str(Path(__file__).resolve().parent))

from micstools import command  # noqa: E402
from micstools.reader import Run  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
JOBS = {"blocks": 0.3, "dam_break": 0.2}
"""Case files of input/, and the simulated seconds that are timed."""
PILE = 64
"""Blocks of the dry pile, which `bench_contact.py` runs for two simulated seconds."""


@dataclass(frozen=True)
class Timing:
    """One run of a job."""

    wall: float  # [s]
    cpu: float  # [s]
    simulated: float  # [s]
    steps: int  # of the water, or substeps of contact
    size: int  # cells, or blocks

    @property
    def ns(self) -> float:
        """CPU time per step and cell or block [ns]."""
        return 1e9 * self.cpu / (self.steps * self.size)


def case(name: str, seconds: float, program: Path, threads: int, work: Path) -> Timing:
    """Run the first seconds of a case file of input/."""
    text = f90nml.read(ROOT / "input" / f"{name}.nml")
    text["run"]["t_end"] = seconds
    path, output = work / f"{name}.nml", work / name
    text.write(path)
    words = [str(program), "--quiet", "--threads", str(threads), "--output", str(output), str(path)]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(words, check=True, cwd=ROOT)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    cells = 1
    for number in text["grid"]["cells"]:
        cells *= number
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Timing(wall, cpu, seconds, len(Run(output).series.time) - 1, cells)


def pile(program: Path, threads: int) -> Timing:
    """Run the dry pile."""
    words = [sys.executable, str(ROOT / "tools" / "bench_contact.py"), "--n", str(PILE)]
    words += ["--threads", str(threads), "--program", str(program)]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    row = json.loads(done.stdout)
    return Timing(row["wall_s"], row["cpu_s"], row["time"], row["steps"], PILE)


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


def row(name: str, timings: list[Timing]) -> dict[str, object]:
    """What the table says of a job."""
    best = min(timings, key=lambda timing: timing.wall)
    spread = max(timing.wall for timing in timings) / best.wall - 1.0
    numbers = {**asdict(best), "ns": best.ns, "spread": spread}
    return {"job": name, **{k: float(f"{v:.4g}") for k, v in numbers.items()}}


def version(program: Path) -> str:
    """The first line that the program says of itself."""
    done = subprocess.run([str(program), "--version"], check=True, capture_output=True, text=True)
    return done.stdout.splitlines()[0]


def processor() -> str:
    """The name of the processor, where the system tells."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main() -> None:
    """Run, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "bench.json")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    given = parser.parse_args()
    program, load, rows = given.program.resolve(), os.getloadavg()[0], []
    at_once = work_at_once(given.threads) if given.threads > 1 else 1.0
    if given.threads > 1:
        print(f"{given.threads} programs at once do {at_once:.2f} times the work of one")
    print(
        f"{'job':12} {'size':>7} {'steps':>6} {'wall s':>8} {'CPU s':>8} {'ns':>8} {'slowest':>8}"
    )
    for name in [*JOBS, "pile"]:
        timings = []
        for _ in range(given.repeat):
            with tempfile.TemporaryDirectory() as work:
                timings.append(
                    case(name, JOBS[name], program, given.threads, Path(work))
                    if name in JOBS
                    else pile(program, given.threads)
                )
        found = row(name, timings)
        rows.append(found)
        print(
            f"{name:12} {found['size']:7.0f} {found['steps']:6.0f} {found['wall']:8.2f} "
            f"{found['cpu']:8.2f} {found['ns']:8.0f} {found['spread']:+8.0%}",
            flush=True,
        )
    about = {"version": version(program), "processor": processor(), "threads": given.threads}
    about |= {"cores": os.cpu_count(), "load_before": load, "repeat": given.repeat}
    about["work_at_once"] = round(at_once, 2)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(json.dumps({**about, "jobs": rows}, indent=2) + "\n")
    print(f"load before: {load:.1f}; written to {given.out}")


if __name__ == "__main__":
    command.run_script(main)
