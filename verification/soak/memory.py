"""Memory of a long run: what a small tank with blocks takes must not grow with its steps.

usage: python verification/soak/memory.py [STEPS] [--program ./mics]

A run of STEPS steps, with a row and a restart file after each, is compared with one of a twentieth
of them: it may have up to ALLOWANCE more at its peak, and no more. (Frames fill the cache of HDF5,
which is bounded: a run of 10,000 frames has 13 MB more than one of 500, one of 20,000 no more.)
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ALLOWANCE = 1.0e6  # bytes; before the first leak was mended 1,000 steps took 29 MB
DT = 1.0e-4

CASE = """&run
  title = 'memory'
  t_end = {t_end}  dt = {dt}  cfl_max = 0.0
  field_interval = 0.0  restart_interval = {dt}
/
&grid cells = 6, 6, 8  length = 0.06, 0.06, 0.08 /
&fluid water_level = 0.04 /
&shape name = 'cube'  kind = 'cube'  size = 0.02  refinement = 1 /
&body shape = 'cube'  position = 0.03, 0.03, 0.0101 /
&body shape = 'cube'  position = 0.03, 0.03, 0.0303 /
"""


def peak(program: Path, steps: int, work: Path) -> int:
    """Most memory that a run of so many steps had at once [bytes]."""
    case = work / f"{steps}.nml"
    case.write_text(CASE.format(t_end=steps * DT, dt=DT))
    command = [program, "--quiet", "--threads", "1", "--output", work / f"run-{steps}", case]
    process = subprocess.Popen([str(word) for word in command])
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{steps} steps: exit code {process.returncode}")
    return 1024 * usage.ru_maxrss


def growth(program: Path, steps: int, work: Path) -> tuple[str, list[str]]:
    """What was measured, and what does not hold."""
    few = steps // 20
    before, after = peak(program, few, work), peak(program, steps, work)
    said = f"{few} steps: {before / 1e6:.2f} MB, {steps} steps: {after / 1e6:.2f} MB at most"
    more = after - before
    return said, [f"{more / 1e6:.2f} MB more"] if more > ALLOWANCE else []


def main() -> int:
    """Command line; 1 if memory grows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("steps", type=int, nargs="?", default=10000)
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        said, found = growth(chosen.program.resolve(), chosen.steps, Path(work))
    print(said, *found)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
