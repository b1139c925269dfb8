"""`mics-tools`: every tool under one name, `mics-tools COMMAND --help` tells each."""

import sys

from micstools import command
from micstools.commands.base import COMMANDS, Parser

_SUMMARY = "Run cases of mics, look at the results, make blocks and beds."


def usage() -> str:
    """All commands, a line each."""
    lines = [f"  {name:10}{about['line']}" for name, about in COMMANDS.items()]
    text = "usage: mics-tools COMMAND ...\n\n" + _SUMMARY + "\n\n" + "\n".join(lines)
    return text + "\n\nmics-tools COMMAND --help tells the options, with examples."


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
    command.run_script(lambda: _finish(Parser(words[0]).call(words[1:])), f"mics-tools {words[0]}")


def script(name: str, doc: str) -> None:
    """A script of `tools` that does a part of a command."""
    command.run_script(lambda: _finish(Parser(name, doc.splitlines()[0]).call()))


def _finish(code: int) -> None:
    raise SystemExit(code)


if __name__ == "__main__":
    main()
