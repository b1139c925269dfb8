"""Who writes to a folder of results, how far a run is, and how it is stopped."""

import fcntl
import os
import re
import signal
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from micstools.reading.reader import BadRun, Run

_HOLDER = re.compile(r"(?:pid )?(\d{1,9}) on (\S+)")
_RUNNING = -1  # exit status in the file while a run goes on, or after it was killed
_RECENT = 20  # rows at the end that give the pace
_WORDS = {0: "finished", 2: "refused", 3: "ended with numerical trouble", 4: "ended with trouble "
          "with its files", 130: "stopped", 143: "stopped"}  # fmt: skip


@dataclass(frozen=True)
class Holder:
    """The process that holds a lock file."""

    pid: int
    host: str

    @property
    def here(self) -> bool:
        """Is it one of this machine?"""
        return self.host == os.uname().nodename


def holder(lock: Path) -> Holder | None:
    """Who holds a lock file; none where nobody does. A file that was left behind means nothing: the
    system lets a lock go when its program ends."""
    if not lock.is_file():  # a pipe would keep us waiting
        return None
    try:
        with lock.open(errors="replace") as file:
            found = _HOLDER.search(file.read(200))
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return Holder(int(found[1]), found[2]) if found else Holder(0, "")
    except OSError:
        return None
    return None


@dataclass(frozen=True)
class State:
    """How far a run is."""

    words: str
    running: bool
    time: float = 0.0  # simulated [s]
    end: float = float("nan")  # [s]
    left: float = float("nan")  # wall time to the end at the pace of the last rows [s]
    wall: float = 0.0  # since the start [s]
    code: int | None = None  # exit status, None: it runs, or was killed

    @property
    def share(self) -> float:
        """Of the simulated time, from 0 to 1."""
        return float(np.clip(self.time / self.end, 0, 1)) if self.end > 0 else 0.0


def state(run: Run, before: Holder | None = None) -> State:
    """How far a run is, and whether its program lives, or did `before` the run was read."""
    time, wall = run.series.time, run.series.wall_time
    code = int(run.provenance.get("exit_status", _RUNNING))
    end = float(run.value("run", "t_end"))
    now, passed = (float(time[-1]), float(wall[-1])) if time.size else (0.0, 0.0)
    if code != _RUNNING:
        words = _WORDS.get(code, f"ended with code {code}")
        if code == 0 and now < end - 1e-9:
            words = "settled"
        return State(words, False, now, end, float("nan"), passed, code)
    who = before or holder(run.folder / "run.lock")
    words = "running" if who else "was killed"
    if who and not who.here:
        words += f" on {who.host}"
    left = _left(time, wall, end) if who else float("nan")
    return State(words, who is not None, now, end, left, passed)


def _left(time: np.ndarray, wall: np.ndarray, end: float) -> float:
    """Wall time to the end [s] at the mean pace of the last rows."""
    t, w = time[-_RECENT:], wall[-_RECENT:]
    if t.size < 2 or t[-1] <= t[0]:
        return float("nan")
    return float((w[-1] - w[0]) / (t[-1] - t[0]) * (end - t[-1]))


def ask_to_stop(folder: Path) -> str:
    """Let the run of a folder write its restart file and end: a file `stop` asks it to."""
    _living(folder)
    (folder / "stop").touch()
    return "asked to stop: it writes its restart file after the step, and ends"


def stop_at_once(folder: Path) -> str:
    """End the run of a folder without a restart file of this moment. What it wrote stays."""
    who = _living(folder)
    if not who.here:
        raise BadRun(f"the run is on {who.host}: only a stop with a restart file reaches it")
    _signal(who, folder / "run.lock", signal.SIGKILL)
    return "stopped at once; what was written stays"


def stop_ensemble(folder: Path, running: list[Path]) -> str:
    """End an ensemble: it tells its runs, which write their restart files. Where it is on another
    machine, or nobody holds the lock, the results that are `running` are asked one by one."""
    who = holder(folder / "ensemble.lock")
    if who and who.here:
        _signal(who, folder / "ensemble.lock", signal.SIGTERM)
        return "asked to stop: every run writes its restart file; the same command goes on"
    for path in running:
        ask_to_stop(path)
    return f"{len(running)} runs asked to stop"


def _signal(who: Holder, lock: Path, number: signal.Signals) -> None:
    """Send a signal to the process that a lock file names, if it is one of ours: `mics` or Python,
    with the file open. Anybody may have written the file."""
    wanted = "mics" if lock.name == "run.lock" else "python"
    process = Path("/proc", str(who.pid))
    try:
        handle = os.pidfd_open(who.pid)
    except (OSError, AttributeError) as problem:  # it has ended; or this is no Linux
        raise BadRun(f"{lock}: process {who.pid} cannot be reached") from problem
    try:
        known = (process / "exe").readlink().name.startswith(wanted)
        if not known or not any(_same(end, lock) for end in (process / "fd").iterdir()):
            raise BadRun(f"{lock}: process {who.pid} is another program: nothing is stopped")
        signal.pidfd_send_signal(handle, number)
    except OSError as problem:
        raise BadRun(f"{lock}: process {who.pid} cannot be reached") from problem
    finally:
        os.close(handle)


def _same(one: Path, other: Path) -> bool:
    with suppress(OSError):
        return one.samefile(other)
    return False


def _living(folder: Path) -> Holder:
    who = holder(folder / "run.lock")
    if who is None:
        raise BadRun(f"{folder}: no run is going on there")
    return who


def clock(seconds: float) -> str:
    """Wall time as h:mm:ss, a dash where it is not known."""
    if not np.isfinite(seconds):
        return "–"
    s = round(seconds)
    return f"{s // 3600}:{s // 60 % 60:02d}:{s % 60:02d}"
