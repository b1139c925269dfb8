"""Run a case."""

import argparse
import os
import subprocess
from contextlib import suppress
from typing import IO, Any

from micstools.cases import program


def call(given: argparse.Namespace, options: list[str], out: IO[str] | None = None) -> int:
    """The program on the case; it reads the case as it is where nothing was set. `out`: in place of
    standard output."""
    text = program.case_text(given.case, given.settings)
    path = program.find(given.program, given.case)
    settings = {**program.ENVIRONMENT, **os.environ}
    how: dict[str, Any] = {"text": True, "env": settings, "stdout": out}
    if not given.settings:
        return _code(subprocess.Popen([path, *options, given.case], **how))
    with subprocess.Popen([path, *options], stdin=subprocess.PIPE, **how) as process:
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


def work(given: argparse.Namespace) -> int:
    options = ["--output", str(given.output)] if given.output else []
    options += ["--threads", str(given.threads)] if given.threads is not None else []
    options += ["--restart", str(given.restart)] if given.restart else []
    options += ["--max-wall", given.max_wall] if given.max_wall is not None else []
    return call(given, options + (["--quiet"] if given.quiet else []))
