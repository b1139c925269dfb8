"""Runs on disks of many sizes that are too small: what is left can be read, and the run goes on.

For each of 200 sizes between nothing and all that the run needs, a short wet run meets the end of
its disk (`disk`: a file system in memory, which only root may mount) or of a file (`limit`: that of
`ulimit -f`). Then must hold: exit code 4 and a message that names a file and the reason; every
result file can be read to its last byte and holds what an undisturbed run has there; each restart
file goes on, in the same folder once there is room and in a copy, to the same bits. Words: disk,
limit.
"""

import contextlib
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from run_soak import Given
from soak.shop import Shop, exit_status, goes_on, open_shop, wrong_files

IN_THE_WAY = ("No space left on device", "File too large")  # what the system says


def largest(shop: Shop, kind: str) -> int:
    """Bytes of a disk, or of the largest file, that suffice."""
    sizes = [path.stat().st_size for path in shop.whole.iterdir()]
    return int(1.5 * sum(sizes)) if kind == "disk" else int(1.1 * max(sizes))


@contextlib.contextmanager
def small_disk(size: int, at: Path) -> Iterator[None]:
    """A file system of `size` bytes in memory; needs the right to mount."""
    at.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(at)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(at)], check=True)


def may_mount() -> bool:
    with tempfile.TemporaryDirectory() as folder:
        try:
            with small_disk(65536, Path(folder)):
                return True
        except (OSError, subprocess.CalledProcessError):
            return False


def check_size(shop: Shop, kind: str, size: int, work: Path) -> tuple[str, list[str]]:
    """One run that meets its end at `size` bytes: what was said, and all that does not hold."""
    room, spare = work / "room", work / "spare"
    shutil.rmtree(room, ignore_errors=True)
    with contextlib.ExitStack() as stack:
        if kind == "disk":
            stack.enter_context(small_disk(size, room))
        output = room / "run"
        ends = (size, resource.RLIM_INFINITY)
        bound = partial(resource.setrlimit, resource.RLIMIT_FSIZE, ends)
        code, said = shop.run("--output", output, limit=bound if kind == "limit" else None)
        found = []
        if code not in (0, 4):
            found.append(f"exit code {code}")
        if code == 4 and str(output) not in said:
            found.append("the message does not name the file")
        if code == 4 and shop.machine.ranks == 1 and not any(why in said for why in IN_THE_WAY):
            found.append("the message does not name the reason")
        if output.exists():
            damaged = wrong_files(shop, output, killed=False)
            found += damaged
            if not damaged and exit_status(output) not in (None, code):
                found.append(f"run.h5 says exit status {exit_status(output)} of {code}")
            if kind == "disk":
                bigger = ["mount", "-o", "remount,size=64m", str(room)]
                subprocess.run(bigger, check=True)
            found += goes_on(shop, output, spare)
        return f"exit {code} {' '.join(said.split())}".replace(str(output) + "/", ""), found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Every size of each kind."""
    shop, n = open_shop(given.machine(), work), given.n or 200
    for kind in given.words or ("disk", "limit"):
        if kind == "disk" and not may_mount() or kind == "limit" and given.ranks > 1:
            continue  # mpirun has files of its own
        for i in range(n):
            size = largest(shop, kind) * i // n + 4096
            said, found = check_size(shop, kind, size, work)
            yield f"{kind} {size:8d} {said}", found
