"""The program holds no fused multiply-add: its results hang on the numbers, not on what the
compiler happened to fuse (`-ffp-contract=off` and, as gcc 12 fuses in straight code all the same,
`-fno-tree-slp-vectorize`)."""

import re
import shutil
import subprocess

import pytest

from run_cases import ROOT

FUSED = re.compile(r"\bv?f(n?m(add|sub)|m(addsub|subadd)|(n?m(la|ls)))\w*\s")
OBJDUMP = shutil.which("objdump")


@pytest.mark.skipif(OBJDUMP is None, reason="no objdump")
@pytest.mark.parametrize("program", ["mics", "mics_mpi"])
def test_no_fused_multiply_add(program: str) -> None:
    binary = ROOT / program
    if not binary.exists():
        pytest.skip(f"./{program} is not built")
    code = subprocess.run(
        [str(OBJDUMP), "-d", "--no-show-raw-insn", str(binary)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "mulpd" in code or "mulsd" in code or "fmul" in code
    assert FUSED.findall(code) == []
