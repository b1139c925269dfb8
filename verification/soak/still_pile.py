"""A pile that lies still in water stays still, for as long as anybody waits.

usage: python verification/soak/still_pile.py [SECONDS] [--settle SECONDS] [--program ./mics]

Three cubes, one upon two, come to rest in a small tank; then SECONDS (an hour) are simulated, with
`&contact sleep` on and off. From the end of the time to settle to the end of the run no block may
creep faster than 1e-6 m/s, its corners not by its turning either, and the liquid must stay.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from micstools.reading.reader import Run  # noqa: E402

MOST_CREEP = 1.0e-6  # m/s
MOST_DRIFT = 1.0e-9  # of the liquid, relative
EDGE = 0.02  # m

CASE = """&run
  title = 'still pile'
  t_end = {t_end}  dt = 0.05  cfl_max = 0.5
  field_interval = 0.0  history_interval = {row}  restart_interval = 0.0
/
&grid cells = 15, 5, 10  length = 0.15, 0.05, 0.1 /
&fluid water_level = 0.07 /
&contact sleep = {sleep} /
&shape name = 'cube'  kind = 'cube'  size = 0.02 /
&body shape = 'cube'  position = 0.064, 0.025, 0.01 /
&body shape = 'cube'  position = 0.086, 0.025, 0.01 /
&body shape = 'cube'  position = 0.075, 0.025, 0.0301 /
"""


def creep(
    program: Path, seconds: float, settle: float, sleep: bool, work: Path
) -> tuple[str, bool]:
    """What a run showed, and whether it lay still."""
    case, began = work / f"{sleep}.nml", time.monotonic()
    word = ".true." if sleep else ".false."
    row = min(10.0, seconds / 10)
    case.write_text(CASE.format(t_end=seconds + settle, row=row, sleep=word))
    folder = work / f"run-{sleep}"
    command = [program, "--quiet", "--threads", "1", "--output", folder, case]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        return f"sleep = {word}: exit code {done.returncode}: {done.stderr.strip()}", False
    run = Run(folder)
    first = int((run.bodies.time >= settle).argmax())
    past = float(run.bodies.time[-1] - run.bodies.time[first])
    moved = abs(run.bodies.position[-1] - run.bodies.position[first]).max() / past
    turned = EDGE * abs(run.bodies.quaternion[-1] - run.bodies.quaternion[first]).max() / past
    farthest = abs(run.bodies.position[first:] - run.bodies.position[first]).max()
    drift = abs(run.series.liquid_volume_drift).max()
    said = (
        f"sleep = {word}: {past:.0f} s: creep {moved:.1e} m/s, turning {turned:.1e} m/s, "
        f"farthest {farthest:.1e} m, drift of the liquid {drift:.1e}, "
        f"{len(run.bodies.time)} rows, {time.monotonic() - began:.0f} s of wall time"
    )
    return said, max(moved, turned) < MOST_CREEP and drift < MOST_DRIFT


def main() -> int:
    """Command line; 1 if a pile crept."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", type=float, nargs="?", default=3600.0)
    parser.add_argument("--settle", type=float, default=5.0)
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    chosen = parser.parse_args()
    program, failed = chosen.program.resolve(), False
    with tempfile.TemporaryDirectory() as work, ThreadPoolExecutor(2) as pool:
        runs = [
            pool.submit(creep, program, chosen.seconds, chosen.settle, sleep, Path(work))
            for sleep in (True, False)
        ]
        for run in runs:
            said, still = run.result()
            print(said, "" if still else "FAILS", flush=True)
            failed = failed or not still
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
