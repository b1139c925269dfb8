"""What a command is."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn


@dataclass(frozen=True)
class Command:
    """A command: how it is called, its arguments, and its work, which gives the exit code."""

    name: str
    summary: str
    examples: tuple[str, ...]
    arguments: Callable[[argparse.ArgumentParser], None]
    work: Callable[[argparse.Namespace], int]

    @property
    def epilog(self) -> str:
        """The examples as text below the help."""
        return "examples:\n" + "\n".join(f"  mics-tools {line}" for line in self.examples)


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with the arguments."""

    def error(self, message: str) -> NoReturn:
        """One line and the exit code 2."""
        self.exit(2, f"{self.prog}: {message} (--help tells more)\n")
