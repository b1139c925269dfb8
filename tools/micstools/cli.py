"""`mics-tools`: every tool under one name, `mics-tools COMMAND --help` tells each."""

import argparse
import sys
from collections.abc import Callable
from importlib import import_module

from micstools import command
from micstools.commands.base import Command, Parser

# Where each command is; only the one that is called is loaded: `--help` draws nothing.
COMMANDS = {
    "run": ("run", "RUN", "run a case"),
    "check": ("check", "CHECK", "check a case: its plan in words, or as a page"),
    "watch": ("watch", "WATCH", "watch a run or an ensemble while it goes on, on a page"),
    "studio": ("studio", "STUDIO", "edit, check, run and watch a case on a page"),
    "plot": ("plot", "PLOT", "draw blocks, water and history of a run"),
    "pile": ("pile", "PILE", "tell the pile of a run, or the piles of an ensemble"),
    "places": ("places", "PLACES", "write where units lie: csv, geojson, dxf"),
    "report": ("report", "REPORT", "make one page of a run or an ensemble"),
    "export": ("export", "EXPORT", "write a run for other programs: glb, stl, obj, csv, pvd"),
    "movie": ("movie", "MOVIE", "make a film of a run: mp4 or gif"),
    "compare": ("compare", "COMPARE", "put two runs beside each other"),
    "study": ("study", "STUDY", "run a case on coarser and finer cells"),
    "ensemble": ("ensemble", "ENSEMBLE", "run a case many times with other random drops"),
    "shape": ("shape", "SHAPE", "make a block from a drawing"),
    "bed": ("bed", "BED", "make a bed from a map of measured ground"),
    "calibrate": ("calibrate", "CALIBRATE", "fit the drag of a shape for light runs"),
    "harbour": ("harbour", "HARBOUR", "write the case of a breakwater of many blocks"),
}
_SUMMARY = "Run cases of mics, look at the results, make blocks and beds."


def usage() -> str:
    """All commands, a line each."""
    lines = [f"  {name:10}{summary}" for name, (_, _, summary) in COMMANDS.items()]
    text = "usage: mics-tools COMMAND ...\n\n" + _SUMMARY + "\n\n" + "\n".join(lines)
    return text + "\n\nmics-tools COMMAND --help tells the options, with examples."


def find(name: str) -> Command:
    """A command by its name."""
    module, constant, _ = COMMANDS[name]
    found: Command = getattr(import_module(f"micstools.commands.{module}"), constant)
    return found


def main(words: list[str] | None = None) -> None:
    """The entry point: call a command and exit with its code."""
    words = sys.argv[1:] if words is None else words
    if not words or words[0] in ("--help", "-h"):
        command.run_script(lambda: print(usage(), file=sys.stdout if words else sys.stderr))
        raise SystemExit(0 if words else 2)
    if words[0] not in COMMANDS:
        print(
            f"mics-tools: no command '{words[0]}'; there are: {', '.join(COMMANDS)}",
            file=sys.stderr,
        )
        raise SystemExit(2)
    chosen = find(words[0])
    parser = Parser(
        prog=f"mics-tools {chosen.name}",
        description=chosen.summary,
        epilog=chosen.epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    chosen.arguments(parser)
    command.run_script(lambda: _finish(chosen.work(parser.parse_args(words[1:]))), parser.prog)


def script(
    doc: str,
    arguments: Callable[[argparse.ArgumentParser], None],
    work: Callable[[argparse.Namespace], int],
) -> None:
    """A script of `tools` that does a part of a command."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    arguments(parser)
    command.run_script(lambda: _finish(work(parser.parse_args())))


def _finish(code: int) -> None:
    raise SystemExit(code)


if __name__ == "__main__":
    main()
