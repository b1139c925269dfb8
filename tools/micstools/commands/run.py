"""Run a case, show its page."""

import argparse
import os
import subprocess
import sys
import webbrowser
from contextlib import suppress
from typing import IO, Any

from micstools.cases import program
from micstools.command import folder_in
from micstools.commands.base import Parser
from micstools.reading.reader import BadRun

_SCREEN = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # one of them: a browser has where to open


def call(given: argparse.Namespace, options: list[str], out: IO[str] | None = None) -> int:
    """The program on the case; it reads the case as it is where nothing was set. `out`: in place of
    standard output."""
    text = program.case_text(given.case, given.settings)
    path = program.find(given.program, given.case)
    environment = {**program.ENVIRONMENT, **os.environ}
    how: dict[str, Any] = {"text": True, "env": environment, "stdout": out}
    if not given.settings:
        return program.wait(subprocess.Popen([path, *options, given.case], **how))
    with subprocess.Popen([path, *options], stdin=subprocess.PIPE, **how) as process:
        # The program has the signal, too, and ends in good order.
        with suppress(KeyboardInterrupt, BrokenPipeError):
            process.communicate(text)
        return program.wait(process)


def work(given: argparse.Namespace) -> int:
    options = ["--output", str(given.output)] if given.output else []
    options += ["--threads", str(given.threads)] if given.threads is not None else []
    options += ["--restart", str(given.restart)] if given.restart else []
    options += ["--max-wall", given.max_wall] if given.max_wall is not None else []
    code = call(given, options + (["--quiet"] if given.quiet else []))
    if code == 0 and not given.quiet:
        _page(given)
    return code


def _page(given: argparse.Namespace) -> None:
    """The page of the run, opened where somebody sits before it."""
    folder = given.output or (given.restart.parent if given.restart else None)
    folder = folder or folder_in(program.case_text(given.case, given.settings))
    try:
        Parser("report").call([str(folder)])
    except BadRun as problem:
        print(f"no page: {problem}", file=sys.stderr)
        return
    screen = sys.platform == "darwin" or any(name in os.environ for name in _SCREEN)
    watched = sys.stdin.isatty() and sys.stdout.isatty() and "CI" not in os.environ
    if given.browser and screen and watched:
        webbrowser.open((folder / "report.html").resolve().as_uri())
