"""Time the dry pile of hexapods and measure it.

usage: python tools/bench_contact.py [--n 64] [--time 2] [--box 0.3] [--seed 1] [--threads 1]
                                     [--dt 0.1] [--contact-time 0.008]
                                     [--program ./mics]

N hexapods (edge of a cube 20 mm, 2300 kg/m3) on a loose grid with random attitudes fall into a
square tank and pile up; friction 0.5, restitution 0.3, exact surfaces. Blocks stay awake without
`--sleep`. Prints one JSON line: CPU and wall seconds of the whole run, substeps of contact (`dt` is
the mean one), and of the pile at the end heights of the centroids, share of solid below the 80th
percentile of these, depth of surface points inside other blocks (`pen_late_mm`: the largest over
the last half second), and blocks outside the tank.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from micstools import command  # noqa: E402
from micstools.bench import jobs  # noqa: E402
from micstools.bench.dry_pile import measure  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=64)
    parser.add_argument("--time", type=float, default=2.0, help="simulated seconds")
    parser.add_argument("--box", type=float, default=0.3, help="side of the tank [m]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--dt", type=float, default=0.1, help="history step [s]")
    parser.add_argument("--contact-time", type=float, default=0.008, help="of a single impact [s]")
    parser.add_argument("--sleep", action="store_true", help="let blocks at rest sleep")
    parser.add_argument("--every", type=int, default=1, help="depth at every so many late rows")
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    given = parser.parse_args()
    kept = ("dt", "contact_time", "sleep", "box", "seed")
    case = {name: getattr(given, name) for name in kept}
    with tempfile.TemporaryDirectory() as name:
        program, folder = given.program.resolve(), Path(name)
        took = jobs.pile(given.n, given.time, program, given.threads, folder, **case)
        run = Run(folder / "result")
        steps = took.steps
        found = {
            "version": str(run.provenance.get("version", "")), "n_blocks": given.n,
            "box": given.box, "time": given.time, "dt": given.time / steps, "steps": steps,
            "history_dt": given.dt, "contact_time": given.contact_time, "sleep": given.sleep,
            "threads": given.threads, "wall_s": took.wall, "cpu_s": took.cpu,
            "memory_mb": took.memory / 1e6, "wall_per_block_step": took.wall / (given.n * steps),
            "cpu_per_block_step": took.cpu / (given.n * steps),
            "wall_per_sim_s": took.wall / given.time, **measure(run, given.box, given.every),
        }  # fmt: skip
    rounded = {k: float(f"{v:.5g}") if isinstance(v, float) else v for k, v in found.items()}
    print(json.dumps(rounded))


if __name__ == "__main__":
    command.run_script(main)
