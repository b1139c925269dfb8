"""Two programs and one result folder: exactly one of them goes on.

50 times, two to four runs are started at the same instant into one folder: a new one, an empty one,
one with older results, or one to be continued from its restart file, in place or by a copy. One
must run to its end with the bits of an undisturbed run, the others must end with code 2 and name
the folder and the process that has it; older results stay.
"""

import random
import re
import shutil
import socket
import time
from collections.abc import Iterator
from pathlib import Path

from run_soak import Given
from same_bits import LOCK, differences
from soak.shop import Shop, open_shop

CASE = Path(__file__).with_suffix(".nml").read_text()
STARTS = ("new", "empty", "used", "in place", "copy into used")


def options_of(start: str, shop: Shop, folder: Path) -> list[str]:
    """Make the folder what it has to be; what the program is then told."""
    if start == "empty":
        folder.mkdir()
    if start in ("used", "in place", "copy into used"):
        shutil.copytree(shop.whole, folder)
    if start == "in place":
        return ["--restart", str(folder / "restart-a.h5")]
    if start == "copy into used":
        return ["--restart", str(shop.whole / "restart-a.h5"), "--output", str(folder)]
    return ["--output", str(folder)]


def wrong_loser(code: int, said: str, folder: Path, others: set[int]) -> str:
    """What is wrong with the end of a program that did not get the folder; empty if nothing."""
    found = re.search(r"in use by pid (\d+) on (\S+);", said)
    if code != 2 or not found or str(folder) not in said:
        return f"exit code {code}: {said.strip()}"
    if int(found[1]) not in others or found[2] != socket.gethostname():
        return f"names the wrong process: {said.strip()}"
    return ""


def trial(shop: Shop, start: str, programs: int, folder: Path) -> list[str]:
    """All that does not hold when so many programs start at once."""
    options = options_of(start, shop, folder)
    runs = [shop.start(*options) for _ in range(programs)]
    ends = {run.pid: (run.communicate(timeout=300)[1], run.returncode) for run in runs}
    winners = [pid for pid, (_, code) in ends.items() if code == 0]
    found = [] if len(winners) == 1 else [f"{len(winners)} programs ran to their end"]
    for pid, (said, code) in ends.items():
        wrong = "" if code == 0 else wrong_loser(code, said, folder, ends.keys() - {pid})
        found += [wrong] if wrong else []
    found += shop.unlike(folder)
    older = folder.with_name(f"{folder.name}.bak-1")
    if older.exists() != (start in ("used", "copy into used")):
        found.append(f"{older.name} is {'' if older.exists() else 'not '}there")
    if older.exists():
        found += [f"{older.name}: {line}" for line in differences(shop.whole, older)]
    return found


def late_comer(shop: Shop, folder: Path) -> list[str]:
    """Programs that come when the first has rows: all are refused, results can be read."""
    first = shop.start("--output", str(folder))
    while not (folder / "run.h5").exists() and first.poll() is None:
        time.sleep(0.001)
    found = []
    for options in (
        ["--output", str(folder)],
        ["--restart", str(shop.whole / "restart-a.h5"), "--output", str(folder)],
    ):
        late = shop.start(*options)
        said = late.communicate(timeout=300)[1]
        wrong = wrong_loser(late.returncode, said, folder, {first.pid})
        found += [wrong] if wrong else []
    first.communicate(timeout=300)
    found += [] if first.returncode == 0 else [f"the first: exit code {first.returncode}"]
    return found + differences(shop.whole, folder)


def killed(shop: Shop, folder: Path) -> list[str]:
    """A killed run leaves its lock file, which holds nobody up."""
    first = shop.start("--output", str(folder))
    while not (folder / "restart-a.h5").exists() and first.poll() is None:
        time.sleep(0.001)
    first.kill()
    first.communicate(timeout=300)
    found = [] if (folder / LOCK).exists() else [f"no {LOCK} to test with"]
    again = shop.start("--restart", str(folder / "restart-a.h5"))
    said = again.communicate(timeout=300)[1]
    found += [] if again.returncode == 0 else [f"after a kill: {said.strip()}"]
    found += [f"{LOCK} is left over"] if (folder / LOCK).exists() else []
    return found + shop.unlike(folder)


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Every start in turn."""
    shop, draw = open_shop(given.machine(), work, CASE), random.Random(given.seed)
    for i in range(given.n or 50):
        how = (*STARTS, "late", "killed")[i % (len(STARTS) + 2)]
        programs, folder = draw.choice((2, 2, 3, 4)), work / f"trial-{i}" / "run"
        folder.parent.mkdir()
        if how in STARTS:
            found = trial(shop, how, programs, folder)
        else:
            found = (late_comer if how == "late" else killed)(shop, folder)
        yield f"{how:15} {programs}", found
        shutil.rmtree(folder.parent)
