"""Restart files come in pairs: the other one is named; only what is on the disk gets its name."""

import shutil
import subprocess
from pathlib import Path

import pytest

from run_cases import ROOT

MICS = ROOT / "mics"
CASE = """&run t_end = 0.04  dt = 0.01  restart_interval = 0.01 /
&grid cells = 8, 8, 8  length = 1, 1, 1 /
&fluid water_level = 0.5 /
"""


def mics(work: Path, *words: str, before: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    """Run the program, perhaps under another one, on the case of this file."""
    (work / "case.nml").write_text(CASE)
    return subprocess.run(
        [*before, str(MICS), "--threads", "1", "--quiet", *words, "case.nml"],
        cwd=work,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize("harm", ["cut", "changed", "gone"])
@pytest.mark.parametrize(("bad", "good"), ["ab", "ba"])
def test_other_file_is_named(bad: str, good: str, harm: str, tmp_path: Path) -> None:
    """One file is no good: the message tells the command with the other one, and that goes on."""
    assert mics(tmp_path).returncode == 0
    file = tmp_path / "mics-out" / f"restart-{bad}.h5"
    data = file.read_bytes()
    at = len(data) // 2
    harmed = {"cut": data[:at], "changed": data[:at] + b"x" * 2000 + data[at + 2000 :]}
    file.unlink()
    if harm != "gone":
        file.write_bytes(harmed[harm])
    done = mics(tmp_path, "--restart", f"mics-out/restart-{bad}.h5")
    assert done.returncode == 4, done.stderr
    hint = f"; the other one is there: --restart mics-out/restart-{good}.h5"
    assert done.stderr.startswith(f"mics: mics-out/restart-{bad}.h5: ")
    assert done.stderr.endswith(hint + "\n"), done.stderr
    done = mics(tmp_path, "--restart", f"mics-out/restart-{good}.h5")
    assert (done.returncode, done.stderr) == (0, "")


def test_no_other_file(tmp_path: Path) -> None:
    done = mics(tmp_path, "--restart", "mics-out/restart-a.h5")
    assert done.returncode == 4
    assert "the other one" not in done.stderr


def test_disk_refuses(tmp_path: Path) -> None:
    """A disk that cannot store a restart file (fsync fails): code 4, the older file stays whole."""
    fault = ("strace", "-f", "-qq", "-o", "/dev/null", "-e", "inject=fsync:error=EIO:when=3")
    if not shutil.which("strace") or subprocess.run([*fault, "true"]).returncode != 0:
        pytest.skip("no strace, or it may not be used")
    done = mics(tmp_path, before=fault)
    assert done.returncode == 4, done.stderr
    assert "restart-a.h5.part: cannot store: Input/output error" in done.stderr
    left = sorted(path.name for path in (tmp_path / "mics-out").glob("restart*"))
    assert left == ["restart-a.h5", "restart-b.h5"]
    for name in left:
        assert mics(tmp_path, "--restart", f"mics-out/{name}").returncode == 0
