"""Commands and programs as a user calls them, and stand-ins for programs."""

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from micstools import cli

ROOT = Path(__file__).parents[2]
MICS = ROOT / "mics"
needs_mics = pytest.mark.skipif(not os.access(MICS, os.X_OK), reason="./mics is not built")


def mics_tools(words: Sequence[str]) -> int:
    """The exit code of `mics-tools` with these words."""
    with pytest.raises(SystemExit) as end:
        cli.main(list(words))
    return int(end.value.code or 0)


def python(
    *words: object, tools: Path = ROOT / "tools", **more
) -> subprocess.CompletedProcess[str]:
    """What Python says to these words, with the `tools` in its reach, on one thread."""
    own = {**os.environ, "PYTHONPATH": str(tools), "OMP_NUM_THREADS": "1"}
    usual = {"capture_output": True, "text": True, "timeout": 200, "env": own}
    return subprocess.run([sys.executable, *map(str, words)], **usual | more)


def plan_of(folder: Path, case: str) -> str:
    """What `./mics --check` plans for a good case whose files lie in a folder."""
    done = subprocess.run([MICS, "--check"], cwd=folder, input=case, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


class NotYet(RuntimeError):
    """A page that is being left has no answer."""


def until(work: Callable[[], Any], patience: float = 120.0) -> Any:
    """The first answer that is true."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        with contextlib.suppress(NotYet):
            if found := work():
                return found
        time.sleep(0.05)
    raise AssertionError("it does not come")


def program(path: Path, text: str) -> Path:
    """A file that can be called."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def stand_in(path: Path, run: str, check: str = "pass") -> Path:
    """A program in the place of mics: what it does with the `text` of a case and the `folder` of
    its results, and with --check; the tools and what is beside the tests are in its reach."""
    folders = [str(folder) for folder in Path(__file__).parents[:2]]
    head = f"#!{sys.executable}\nimport sys\nfrom pathlib import Path\nsys.path[:0] = {folders}\n"
    words = f"words = sys.argv[1:]\nif '--check' in words:\n    {check}\n    sys.exit()\n"
    case = "text, folder = Path(words[-1]).read_text(), Path(words[words.index('--output') + 1])\n"
    return program(path, head + words + case + run)


@contextlib.contextmanager
def going_on(*words: object, **how: Any) -> Iterator[subprocess.Popen]:
    """A program that runs, killed in the end."""
    with subprocess.Popen([str(word) for word in words], **how) as running:
        try:
            yield running
        finally:
            running.kill()
