"""Run verification cases and their checks.

usage: python verification/run_cases.py [CASE ...] [--program ./mics] [--ranks N] [--threads N]

Every *.nml of a case folder is run into OUT/<case>/<name of the file>; then the folder's check.py
gets all of these result folders. The exit code is the number of cases that failed.

A prepare.py in the folder is run first, in OUT/<case>: it writes the initial states that the case
files name, and may write further case files there.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = ROOT / "verification" / "cases"
MPI_SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


@dataclass(frozen=True)
class Machine:
    """Which program runs a case and on how much of the computer."""

    program: Path = ROOT / "mics"
    ranks: int = 1
    threads: int = 0  # 0: the program's own choice

    @property
    def command(self) -> list[str]:
        """Everything before the program's own arguments that belong to a case."""
        start = []
        if self.program.name.startswith("mics_mpi"):
            start = ["mpirun", "--bind-to", "none", "--oversubscribe", "-n", str(self.ranks)]
        threads = ["--threads", str(self.threads)] if self.threads else []
        return [*start, str(self.program), "--quiet", *threads]

    @property
    def patience(self) -> dict[str, str]:
        """Threads that share a core must not spin while they wait."""
        crowded = self.ranks * max(1, self.threads) > (os.cpu_count() or 1)
        return {"OMP_WAIT_POLICY": "passive"} if crowded else {}


def prepare(name: str, work: Path) -> list[Path]:
    """Make what a case needs in a folder; all its case files. They run in that folder."""
    work.mkdir(parents=True, exist_ok=True)
    script = CASES / name / "prepare.py"
    if script.exists():
        subprocess.run([sys.executable, str(script)], cwd=work, check=True)
    return sorted([*(CASES / name).glob("*.nml"), *work.glob("*.nml")])


def run(case: Path, output: Path, machine: Machine, *options: str) -> float:
    """Run one case file into a fresh folder; the seconds it took."""
    shutil.rmtree(output, ignore_errors=True)
    output.parent.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    done = subprocess.run(
        [*machine.command, *options, "--output", str(output.resolve()), str(case.resolve())],
        cwd=output.parent,
        env={**os.environ, **MPI_SETTINGS, **machine.patience},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{case.name} ended with code {done.returncode}\n{done.stderr[-2000:]}")
    return time.perf_counter() - began


def names() -> list[str]:
    """All cases that have a check."""
    return sorted(path.parent.name for path in CASES.glob("*/check.py"))


def verify(name: str, out: Path, machine: Machine) -> tuple[bool, str]:
    """Run all files of a case and its check; whether it holds, and the report."""
    folders, lines = [], []
    for case in prepare(name, out / name):
        folder = out / name / case.stem
        seconds = run(case, folder, machine)
        lines.append(f"{name}/{case.name}: {seconds:.1f} s")
        folders.append(str(folder))
    check = [sys.executable, str(CASES / name / "check.py"), *folders]
    done = subprocess.run(check, capture_output=True, text=True, check=False)
    return done.returncode == 0, "\n".join([*lines, done.stdout + done.stderr])


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", default=names(), help="default: all")
    parser.add_argument("--program", type=Path, default=ROOT / "mics")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "cases")
    given = parser.parse_args()
    machine = Machine(given.program.resolve(), given.ranks, given.threads)
    failed = 0
    for name in given.case:
        try:
            holds, report = verify(name, given.out, machine)
        except RuntimeError as problem:
            holds, report = False, str(problem)
        print(report, flush=True)
        failed += not holds
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
