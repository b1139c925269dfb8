"""Run a case."""

import argparse
import os
import subprocess
from contextlib import suppress
from pathlib import Path

from micstools.cases import program
from micstools.commands.base import Command


def _run_arguments(parser: argparse.ArgumentParser) -> None:
    program.add_case(parser)
    parser.add_argument("--output", type=Path, help="folder for the results")
    parser.add_argument("--threads", type=int, help="default: all cores")
    parser.add_argument("--restart", type=Path, metavar="FILE", help="go on from a restart file")
    limit = "stop in good order, with a restart file, before so much time has passed"
    parser.add_argument("--max-wall", metavar="HH:MM", help=limit)
    parser.add_argument("--quiet", action="store_true", help="no table")


def call(given: argparse.Namespace, options: list[str]) -> int:
    """The program on the case; it reads the case as it is where nothing was set."""
    text = program.case_text(given.case, given.settings)
    path = program.find(given.program, given.case)
    settings = {**program.ENVIRONMENT, **os.environ}
    if not given.settings:
        return _code(subprocess.Popen([path, *options, given.case], text=True, env=settings))
    pipe = subprocess.PIPE
    with subprocess.Popen([path, *options], stdin=pipe, text=True, env=settings) as process:
        # The program has the signal, too, and ends in good order.
        with suppress(KeyboardInterrupt, BrokenPipeError):
            process.communicate(text)
        return _code(process)


def _code(process: subprocess.Popen[str]) -> int:
    """Exit code of the program, as a shell would tell it; Ctrl-C reaches the program itself."""
    while True:
        try:
            code = process.wait()
        except KeyboardInterrupt:
            continue
        return code if code >= 0 else 128 - code


def _run(given: argparse.Namespace) -> int:
    options = ["--output", str(given.output)] if given.output else []
    options += ["--threads", str(given.threads)] if given.threads is not None else []
    options += ["--restart", str(given.restart)] if given.restart else []
    options += ["--max-wall", given.max_wall] if given.max_wall is not None else []
    return call(given, options + (["--quiet"] if given.quiet else []))


RUN = Command(
    "run",
    "Run a case.",
    (
        "run input/blocks_coarse.nml",
        "run input/blocks_coarse.nml --set drop.seed=7 --set contact.friction=0.3 --output mics-7",
        "run input/blocks.nml --max-wall 08:00",
        "run input/blocks.nml --restart mics-out/restart-a.h5 --set run.t_end=12",
    ),
    _run_arguments,
    _run,
)
