"""Runs the members of an ensemble, several at once, on dask.distributed."""

import contextlib
import logging
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from micstools import extras
from micstools.ensemble import Member, State, state

_living: set[subprocess.Popen[bytes]] = set()
_stopping = threading.Event()


def execute(member: Member, program: Path) -> int | None:
    """Run a member from where it stands to its end, on one thread; None when told to stop."""
    restarts = [p for p in member.result.glob("restart-[ab].h5") if p.is_file()]
    for path in sorted(restarts, key=lambda p: p.stat().st_mtime_ns, reverse=True):
        code = _call(member, [str(program), "--restart", str(path), str(member.case)])
        if code not in (2, 4):  # a damaged restart file: try the other, then the beginning
            return code
    return _call(member, [str(program), "--output", str(member.result), str(member.case)])


def _call(member: Member, words: list[str]) -> int | None:
    if _stopping.is_set():
        return None
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    # In a group of its own: Ctrl-C reaches us alone, and we tell the runs.
    with member.log.open("wb") as log, Path(os.devnull).open("r+b") as nothing:
        process = subprocess.Popen(
            [words[0], "--quiet", *words[1:]],
            stdin=nothing,
            stdout=nothing,
            stderr=log,
            env=environment,
            process_group=0,
        )
        _living.add(process)
        code = process.wait()
        _living.discard(process)
        if code < 0:
            log.write(f"killed by signal {-code}\n".encode())
    return code


def run_all(
    waiting: Sequence[Member],
    program: Path,
    jobs: int,
    ended: Callable[[Member, State], None],
) -> None:
    """Run all members, `jobs` at once, and tell of each end. On KeyboardInterrupt every run writes
    its restart file before the exception goes on."""
    extras.need("ensemble")
    import dask
    from dask.distributed import Client, LocalCluster, as_completed

    _stopping.clear()
    # A worker that was not heard of for minutes is given up: so would be that of a laptop asleep.
    dask.config.set({"distributed.scheduler.worker-ttl": None})
    cluster = LocalCluster(
        n_workers=1,
        threads_per_worker=jobs,
        processes=False,
        dashboard_address="127.0.0.1:0",  # any free port: ensembles may run side by side
        memory_limit=0,
        silence_logs=logging.CRITICAL,
    )
    with cluster, Client(cluster) as client:
        try:
            futures = {client.submit(execute, m, program, pure=False): m for m in waiting}
            for future in as_completed(futures):
                problem = future.exception()
                if problem is not None:
                    ended(futures[future], State("failed", reason=str(problem)))
                else:
                    ended(futures[future], state(futures[future]))
        except KeyboardInterrupt:
            stop()
            raise


def stop(patience: float = 60.0) -> None:
    """Let living runs write their restart files and end; after `patience` [s] end them."""
    _stopping.set()
    for sent, wait in ((signal.SIGINT, patience), (signal.SIGKILL, 5.0)):
        left = list(_living)
        for process in left:
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(sent)
        for process in left:
            with contextlib.suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
                process.wait(wait)
