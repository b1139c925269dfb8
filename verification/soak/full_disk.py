"""Runs on disks of many sizes that are too small: what is left can be read, and the run goes on.

usage: python verification/soak/full_disk.py [N] [--kind disk|limit] [--ranks R] [--program ./mics]

For each of N sizes between nothing and all that the run needs, a short wet run meets the end of
its disk (`disk`: a file system in memory, which only root may mount) or of a file (`limit`: that of
`ulimit -f`). Then must hold: exit code 4 and a message that names a file and the reason; every
result file can be read to its last byte and holds what an undisturbed run has there; each restart
file goes on, in the same folder once there is room and in a copy, to the same bits.
"""

import argparse
import contextlib
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "verification"))

from run_cases import Machine  # noqa: E402
from same_bits import contents, differences  # noqa: E402

CHANGING = {f"bodies/{name}" for name in ("release_time", "entry_time", "raised", "status")}
"""Datasets that are written again when a block comes in or is let go."""

CASE = """! A fixed, a free and a dropped block; every result file grows often. One second.
&run
  title = 'a full disk'
  t_end = 0.06  dt = 5.0e-3
  field_interval = 0.005  restart_interval = 0.015
/
&grid cells = 18, 12, 24  length = 0.15, 0.1, 0.2 /
&fluid water_level = 0.0913 /
&shape name = 'cube'  kind = 'cube'  size = 0.04 /
&body shape = 'cube'  position = 0.05, 0.05, 0.025  fixed = .true. /
&body shape = 'cube'  position = 0.1, 0.05, 0.1  velocity = 0.1, 0.0, -0.6 /
&drop shape = 'cube'  position = 0.05, 0.05, 0.15  first_time = 0.02 /
"""
RESULTS = ("run.h5", "fields.vtkhdf", "blocks.vtkhdf")
IN_THE_WAY = ("No space left on device", "File too large")  # what the system says


@dataclass(frozen=True)
class Workshop:
    """What all sizes have in common."""

    machine: Machine
    case: Path
    whole: Path  # results of the undisturbed run

    def largest(self, kind: str) -> int:
        """Bytes of a disk, or of the largest file, that suffice."""
        sizes = [path.stat().st_size for path in self.whole.iterdir()]
        return int(1.5 * sum(sizes)) if kind == "disk" else int(1.1 * max(sizes))

    def run(self, output: Path | None, *more: str, limit: int | None = None) -> tuple[int, str]:
        """Exit code and what was said on standard error."""

        def bound() -> None:
            if limit is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))

        where = [] if output is None else ["--output", str(output)]
        done = subprocess.run(
            [*self.machine.command, *where, *more, str(self.case)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=900,
            env={**os.environ, "OMP_WAIT_POLICY": "passive", "OMPI_ALLOW_RUN_AS_ROOT": "1",
                 "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"},
            preexec_fn=bound,
        )  # fmt: skip
        return done.returncode, done.stderr


@contextlib.contextmanager
def small_disk(size: int, at: Path) -> Iterator[None]:
    """A file system of `size` bytes in memory; needs the right to mount."""
    at.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(at)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(at)], check=True)


def enlarge(at: Path) -> None:
    subprocess.run(["mount", "-o", "remount,size=64m", str(at)], check=True)


def may_mount() -> bool:
    with tempfile.TemporaryDirectory() as folder:
        try:
            with small_disk(65536, Path(folder)):
                return True
        except (OSError, subprocess.CalledProcessError):
            return False


def unreadable(folder: Path) -> list[str]:
    """Files that cannot be read to the end, and rows that an undisturbed run does not have."""
    found = []
    for path in sorted(folder.glob("*")):
        if path.suffix not in (".h5", ".vtkhdf"):
            found.append(f"{path.name} is left over")
            continue
        try:
            contents(path)
        except (OSError, RuntimeError, KeyError) as trouble:
            found.append(f"{path.name} cannot be read: {trouble}")
    return found


def wrong_rows(folder: Path, whole: Path) -> list[str]:
    """Columns of result files that do not begin like those of the undisturbed run, or differ in
    length where a row was only half written."""
    found = []
    for name in RESULTS:
        if not (folder / name).exists():
            continue
        here, there = contents(folder / name), contents(whole / name)
        group = "series" if name == "run.h5" else "VTKHDF/Steps"
        lengths = {len(a) for key, a in here.items() if key.startswith(group) and "@" not in key}
        if len(lengths) > 1:
            found.append(f"{name}: columns of {sorted(lengths)} rows")
        for key, a in here.items():
            if "@" in key or key in CHANGING:
                continue
            b = there[key][: len(a)]
            if a.dtype != object and not np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
                found.append(f"{name}: other numbers in {key}")
    return found


def exit_status(folder: Path) -> int | None:
    if not (folder / "run.h5").exists():
        return None
    with h5py.File(folder / "run.h5", "r", locking=False) as h5:
        return int(h5["provenance"].attrs["exit_status"])


def goes_on(shop: Workshop, folder: Path, spare: Path) -> list[str]:
    """Each restart file continues in a copy, the newest then in place, to the same bits."""
    found = []
    restarts = sorted(folder.glob("restart-?.h5"), key=lambda path: path.stat().st_mtime_ns)
    tries = [(path, spare) for path in restarts] + [(path, None) for path in restarts[-1:]]
    for path, output in tries:
        if output is not None:
            shutil.rmtree(output, ignore_errors=True)
        code, said = shop.run(output, "--restart", str(path))
        how = f"--restart {path.name} {'--output' if output else 'in place'}"
        if code != 0:
            found.append(f"{how}: exit code {code}: {said.strip()}")
            continue
        other = differences(shop.whole, output or folder)
        found += [f"{how}: {line}" for line in other if not line.startswith("restart-")]
    return found


def check_size(shop: Workshop, kind: str, size: int, work: Path) -> tuple[str, list[str]]:
    """One run that meets its end at `size` bytes: what was said, and all that does not hold."""
    room, spare = work / "room", work / "spare"
    shutil.rmtree(room, ignore_errors=True)
    with contextlib.ExitStack() as stack:
        if kind == "disk":
            stack.enter_context(small_disk(size, room))
        output = room / "run"
        code, said = shop.run(output, limit=size if kind == "limit" else None)
        found = []
        if code not in (0, 4):
            found.append(f"exit code {code}")
        if code == 4 and str(output) not in said:
            found.append("the message does not name the file")
        if code == 4 and shop.machine.ranks == 1 and not any(why in said for why in IN_THE_WAY):
            found.append("the message does not name the reason")
        if output.exists():
            damaged = unreadable(output)
            found += damaged or wrong_rows(output, shop.whole)
            if not damaged and exit_status(output) not in (None, code):
                found.append(f"run.h5 says exit status {exit_status(output)} of {code}")
            if kind == "disk":
                enlarge(room)
            found += goes_on(shop, output, spare)
        return f"exit {code} {' '.join(said.split())}".replace(str(output) + "/", ""), found


def open_shop(machine: Machine, work: Path) -> Workshop:
    """Make the undisturbed run."""
    case = work / "case.nml"
    case.write_text(CASE)
    shop = Workshop(machine, case, work / "whole")
    code, said = shop.run(shop.whole)
    if code != 0:
        raise RuntimeError(f"the undisturbed run fails: {said}")
    return shop


def soak(kinds: list[str], n: int, machine: Machine, work: Path) -> int:
    """Number of sizes at which something does not hold."""
    shop = open_shop(machine, work)
    failed = 0
    for kind in kinds:
        for i in range(n):
            size = shop.largest(kind) * i // n + 4096
            said, found = check_size(shop, kind, size, work)
            print(f"{kind} {size:8d} {'FAILS' if found else 'holds'}  {said}", flush=True)
            print("".join(f"    {line}\n" for line in found), end="", flush=True)
            failed += bool(found)
    print(f"{failed} of {n * len(kinds)} sizes fail")
    return failed


def main() -> None:
    """Print a line per size; the exit code says whether any failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", type=int, nargs="?", default=200, help="sizes")
    parser.add_argument("--kind", choices=("disk", "limit"), action="append")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--program", type=Path)
    options = parser.parse_args()
    name = "mics" if options.ranks == 1 else "mics_mpi"
    machine = Machine((options.program or ROOT / name).resolve(), options.ranks, 1)
    kinds = options.kind or ["disk", "limit"]
    if not may_mount():
        kinds = [kind for kind in kinds if kind != "disk"]
    if options.ranks > 1:  # mpirun has files of its own
        kinds = [kind for kind in kinds if kind != "limit"]
    with tempfile.TemporaryDirectory() as folder:
        raise SystemExit(int(soak(kinds, options.n, machine, Path(folder)) > 0))


if __name__ == "__main__":
    main()
