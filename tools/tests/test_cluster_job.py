"""The Slurm script begins a run, and goes on from the newest restart file."""

import os
import subprocess
from pathlib import Path

from calls import program

SCRIPT = Path(__file__).parents[1] / "cluster_job.sh"


def call(work: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Call the script where `srun` only says how it was called."""
    said = "$OMP_NUM_THREADS: $GOMP_SPINCOUNT $GLIBC_TUNABLES $*"
    program(work / "srun", f'#!/bin/sh\necho "{said}"\n')
    path = {"PATH": f"{work}:{os.environ['PATH']}", "SLURM_CPUS_PER_TASK": "2"}
    return subprocess.run(
        [SCRIPT, *words], cwd=work, capture_output=True, text=True, env={**os.environ, **path}
    )


def test_begins_and_goes_on(tmp_path: Path) -> None:
    begun = call(tmp_path, "my case.nml", "out").stdout
    assert begun.endswith("mics_mpi --quiet --max-wall 11:30 --output out my case.nml\n")
    assert begun.startswith("2: 1000 glibc.malloc.hugetlb=1 ")
    (tmp_path / "out").mkdir()
    for name, age in (("restart-a.h5", 10), ("restart-b.h5", 5)):
        (tmp_path / "out" / name).touch()
        os.utime(tmp_path / "out" / name, (1e9 - age, 1e9 - age))
    assert "--restart out/restart-b.h5 my case.nml" in call(tmp_path, "my case.nml", "out").stdout


def test_refuses_wrong_use(tmp_path: Path) -> None:
    done = call(tmp_path, "case.nml")
    assert done.returncode == 2 and done.stderr.startswith("usage: ")
