"""Runs the members of an ensemble, several at once: in threads of this process, or by
dask.distributed on workers that the queue of a cluster starts."""

import contextlib
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

from micstools.ensembles import ensemble_queue
from micstools.ensembles.ensemble import Member, State, state
from micstools.ensembles.ensemble_queue import Queue

NO_WAY_ON = "cannot go on"
"""What the program says of files from which, or in which, a run cannot go on."""

_living: set[subprocess.Popen[bytes]] = set()
_stopping = threading.Event()
_starting = threading.Lock()  # no run begins while those that live are told to stop


@dataclass(frozen=True)
class Engine:
    """What runs the members."""

    program: Path
    jobs: int  # at once
    queue: Queue | None = None  # of a cluster; else this machine


def execute(member: Member, program: Path, here: Path) -> int | None:
    """Run a member from where it stands to its end, on one thread; None when told to stop. What
    the case names is found from `here`, wherever a worker was started."""
    member = replace(member, folder=here / member.folder)
    restarts = [p for p in member.result.glob("restart-[ab].h5") if p.is_file()]
    for path in sorted(restarts, key=lambda p: p.stat().st_mtime_ns, reverse=True):
        code = _call(member, [str(program), "--restart", str(path), str(member.case)], here)
        said = member.log.read_text(errors="replace")
        if code != 2 and not (code == 4 and NO_WAY_ON in said):
            return code
        # A restart file that is no good: try the other one, then the beginning.
    return _call(member, [str(program), "--output", str(member.result), str(member.case)], here)


def _call(member: Member, words: list[str], here: Path) -> int | None:
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    # In a group of its own: Ctrl-C reaches us alone, and we tell the runs.
    with member.log.open("wb") as log, Path(os.devnull).open("r+b") as nothing:
        with _starting:
            if _stopping.is_set():
                return None
            process = subprocess.Popen(
                [words[0], "--quiet", *words[1:]],
                stdin=nothing,
                stdout=nothing,
                stderr=log,
                env=environment,
                cwd=here,
                process_group=0,
            )
            _living.add(process)
        code = process.wait()
        _living.discard(process)
        if code < 0:
            log.write(f"killed by signal {-code}\n".encode())
    return code


def run_all(
    waiting: Sequence[Member], engine: Engine, ended: Callable[[Member, State], None]
) -> None:
    """Run all members and tell of each end. On KeyboardInterrupt every run writes its restart file
    before the exception goes on."""
    _stopping.clear()
    words = (engine.program, Path.cwd())
    with _workers(engine, min(engine.jobs, len(waiting)), waiting[0].folder.parent) as workers:
        futures = {workers.submit(execute, m, *words): m for m in waiting}
        for future in as_completed(futures):
            problem = future.exception()
            member = futures[future]
            ended(member, State("failed", reason=str(problem)) if problem else state(member))


@contextlib.contextmanager
def _workers(engine: Engine, jobs: int, folder: Path) -> Iterator[Executor]:
    """What executes `jobs` members at once; on KeyboardInterrupt it stops them."""
    if engine.queue is None:
        with ThreadPoolExecutor(jobs) as workers:
            try:
                yield workers
            except KeyboardInterrupt:
                signal.signal(signal.SIGTERM, signal.SIG_IGN)  # Ctrl-C hastens what it does
                stop()
                raise
        return
    with ensemble_queue.client(engine.queue, jobs, folder) as client:
        try:
            yield client.get_executor(pure=False)
        except KeyboardInterrupt:
            client.run(stop)
            raise


def stop(patience: float = 60.0) -> None:
    """Let living runs write their restart files and end; after `patience` [s] end them."""
    with _starting:
        _stopping.set()
    for sent, wait in ((signal.SIGINT, patience), (signal.SIGKILL, 5.0)):
        left = list(_living)
        for process in left:
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(sent)
        for process in left:
            with contextlib.suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
                process.wait(wait)
