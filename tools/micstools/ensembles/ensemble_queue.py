"""Workers that an ensemble asks of a cluster's queue, by dask-jobqueue: a job of one core each."""

import contextlib
import logging
import shlex
import shutil
import signal
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from micstools import extras
from micstools.reading.reader import BadRun

SYSTEMS = {"slurm": ("SLURMCluster", "sbatch"), "pbs": ("PBSCluster", "qsub")}
"""Class of dask-jobqueue, and the program that takes jobs."""
OPTIONS = ("walltime", "queue", "account", "memory", "interface")
_USUAL = {"walltime": "12:00:00", "memory": "4GB"}
_NO_PAGE = "127.0.0.1:0"  # dask listens for pages always: here, at any free port, without one
OPTION = "--cluster"


@dataclass(frozen=True)
class Queue:
    """The queue of a cluster, and what is asked of it for each job."""

    system: str  # one of SYSTEMS
    options: dict[str, str] = field(default_factory=dict)


def parse(words: Sequence[str]) -> Queue:
    """`slurm walltime=2:00:00 queue=short`."""
    system, *others = words
    if system not in SYSTEMS:
        raise BadRun(f"{OPTION} {system}: must be {' or '.join(SYSTEMS)}")
    options = {}
    for word in others:
        name, _, value = word.partition("=")
        if name not in OPTIONS or not value:
            raise BadRun(f"{OPTION} {system} {word}: must be NAME=VALUE, of {', '.join(OPTIONS)}")
        options[name] = value
    program = SYSTEMS[system][1]
    if shutil.which(program) is None:
        raise BadRun(f"{OPTION} {system}: there is no {program} on this machine")
    return Queue(system, options)


@contextlib.contextmanager
def client(queue: Queue, jobs: int, folder: Path) -> Iterator[Any]:
    """A client of dask with `jobs` workers on their way. Scheduler, workers and client know each
    other by a certificate of this call alone; nothing of them is served beyond the loopback
    address. Other options are those of dask-jobqueue's own file, ~/.config/dask/jobqueue.yaml."""
    extras.need("ensemble")
    # The module, without what it makes of Ctrl-C when it is imported: an exit without a word
    ours = signal.getsignal(signal.SIGINT)
    import dask_jobqueue

    signal.signal(signal.SIGINT, ours)
    import dask
    from dask.distributed import Client, Security

    kind, program = getattr(dask_jobqueue, SYSTEMS[queue.system][0]), SYSTEMS[queue.system][1]
    path, answers = str((folder / "jobs").resolve()), SimpleQueue[str]()
    plain = shlex.quote(path) == path  # else it can stand in no directive of a job
    more = dask.config.get(f"jobqueue.{queue.system}.worker-extra-args", [])
    keys = Path(path) if plain else Path.home()
    keys.mkdir(exist_ok=True)
    dask.config.set({"distributed.scheduler.http.routes": []})
    try:
        found = kind(
            n_workers=jobs, job_cls=_telling(kind.job_cls, answers), cores=1, processes=1,
            nanny=False, python=shlex.quote(sys.executable), security=Security.temporary(),
            log_directory=path if plain else None, shared_temp_directory=str(keys),
            scheduler_options={"dashboard": False, "dashboard_address": _NO_PAGE},
            worker_extra_args=[*more, "--no-dashboard", "--dashboard-address", _NO_PAGE],
            job_name="mics", silence_logs=logging.CRITICAL, **_USUAL | queue.options,
        )  # fmt: skip
    except (ValueError, RuntimeError, OSError) as error:
        raise BadRun(f"{OPTION} {queue.system}: {error}") from error
    with found:
        refused = [said for said in (answers.get() for _ in range(jobs)) if said]
        if len(refused) == jobs:
            raise BadRun(f"{OPTION} {queue.system}: {program} takes no job: {refused[0]}")
        if refused:
            print(f"{program} refuses {len(refused)} of {jobs} jobs: {refused[0]}", file=sys.stderr)
        found.adapt(minimum=jobs, maximum=jobs)  # new ones for those whose time is over
        with Client(found) as client:
            yield client


def _telling(job: Any, answers: SimpleQueue[str]) -> Any:
    """A job of dask-jobqueue that tells whether it was taken: '', or what was said instead."""
    from distributed.core import Status

    async def start(self: Any) -> None:
        try:
            await job.start(self)
            answers.put("")
        except Exception as error:  # of whatever program takes the jobs here
            said = str(error).split("stderr:")[-1]
            answers.put(" ".join(said.split()))
            self.status = Status.running  # there is nothing to wait for, and nothing to cancel

    return type(job.__name__, (job,), {"start": start})
