"""The long fault tests of `soak/`; `make soak` runs all of them, many hours.

usage: python verification/run_soak.py [NAME [WORD ...]] [--n N] [--seed S] [--ranks R]
                                       [--program PROGRAM]

`trials` of a module yields what was tried and all that did not hold. WORD chooses among them, as
the docstring of the module says. The exit code is 1 if anything failed.
"""

import argparse
import importlib
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from run_cases import ROOT, Machine

NAMES = sorted(p.stem for p in (ROOT / "verification" / "soak").glob("*.py") if p.stem != "shop")


@dataclass(frozen=True)
class Given:
    """The command line."""

    words: tuple[str, ...] = ()
    n: int = 0  # trials; 0: as many as the module asks for
    seed: int = 1
    ranks: int = 1
    program: Path | None = None

    def machine(self, parallel: bool = False) -> Machine:
        """The program on one thread, by default ./mics or ./mics_mpi."""
        name = "mics_mpi" if parallel or self.ranks > 1 else "mics"
        return Machine((self.program or ROOT / name).resolve(), self.ranks, 1)


def soak(name: str, given: Given) -> int:
    """Print a line for each trial; the number of those that fail."""
    tried = failed = 0
    with tempfile.TemporaryDirectory() as work:
        for said, found in importlib.import_module(f"soak.{name}").trials(given, Path(work)):
            print(f"{name} {'FAILS' if found else 'holds'}  {said}", flush=True)
            print("".join(f"    {line}\n" for line in found), end="", flush=True)
            tried, failed = tried + 1, failed + bool(found)
    print(f"{name}: {failed} of {tried} fail", flush=True)
    return failed


def main() -> int:
    """Command line; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", choices=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("words", nargs="*", metavar="WORD")
    parser.add_argument("--n", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--program", type=Path)
    said = parser.parse_args()
    given = Given(tuple(said.words), said.n, said.seed, said.ranks, said.program)
    return int(sum(soak(name, given) for name in ([said.name] if said.name else NAMES)) > 0)


if __name__ == "__main__":
    sys.exit(main())
