"""Time the program and write the table: jobs, growth, whole runs.

usage: python tools/bench.py [--out build/bench.json] [--repeat 3] [--threads N] [--only PART ...]
                             [--whole] [--against OLD.json] [--program ./mics]

Parts: `jobs` (the start of the main job, a dam break, a dry pile; on one thread, on all, on as many
ranks), `growth` (ever more cells and blocks: time and memory of each) and, when asked for, `whole`
(the tanks of the paper to their end: minutes).

Each job is run `--repeat` times; the table shows the fastest and how much longer the slowest took.
`each` is the CPU time of a cell and step, or of a block and substep. Told are the load beforehand
and how much work that many programs get done at once: two virtual cores are often halves of one.
"""

import argparse
import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from micstools import command  # noqa: E402
from micstools.bench import parts, table  # noqa: E402
from micstools.bench.timing import bandwidth, processor, work_at_once  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
PARTS = {"jobs": parts.short_jobs, "growth": parts.growth, "whole": parts.whole_jobs}
USUAL = ("jobs", "growth")


def main() -> None:
    """Run, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--out", type=Path, default=ROOT / "build" / "bench.json")
    add("--repeat", type=int, default=3)
    add("--threads", type=int, default=os.cpu_count() or 1)
    add("--only", nargs="+", choices=PARTS, default=USUAL, help=f"default: {' '.join(USUAL)}")
    add("--whole", action="store_true", help="besides: the tanks of the paper to their end")
    add("--against", type=Path, metavar="OLD.json", help="an older bench to put this one beside")
    add("--program", type=Path, default=ROOT / "mics", help="mics_mpi is taken from its folder")
    given = parser.parse_args()
    program = given.program.resolve()
    means = parts.Means((program, program.with_name("mics_mpi")), given.repeat, given.threads)
    old = table.read(given.against) if given.against else None
    found = {
        "version": parts.version(program), "processor": processor(), "cores": os.cpu_count(),
        "threads": given.threads, "repeat": given.repeat, "load_before": os.getloadavg()[0],
        "work_at_once": round(work_at_once(given.threads), 2),
        "bandwidth": float(f"{bandwidth():.3g}"),
    }  # fmt: skip
    print(
        f"{found['processor']}: {given.threads} programs at once do {found['work_at_once']} times "
        f"the work of one,\none adds {found['bandwidth'] / 1e9:.1f} GB/s in memory; "
        f"load before: {found['load_before']:.1f}\n{table.HEAD}"
    )
    rows: list[parts.Row] = []
    given.out.parent.mkdir(parents=True, exist_ok=True)
    for name in dict.fromkeys([*given.only, *(["whole"] if given.whole else [])]):
        for row in PARTS[name](means):
            print(table.line(row), flush=True)
            rows.append(row)
            given.out.write_text(json.dumps({**found, "rows": rows}, indent=2) + "\n")
    print(f"written to {given.out}")
    if old:
        print(table.beside({**found, "rows": rows}, old))


if __name__ == "__main__":
    command.run_script(main)
