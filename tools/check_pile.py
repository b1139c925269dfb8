"""What can be said of the pile of a run, and in the paper's tank of its figures 5 to 7.

usage: python tools/check_pile.py RUN [--paper]

The exit code is 0 whatever is seen: these are observations of one chaotic pile, not pass marks.
"""

import argparse
from pathlib import Path

from micstools import command, pile


def main() -> None:
    """Print the findings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--paper", action="store_true", help="what the paper says, in any tank")
    given = parser.parse_args()
    run = command.open_run(given.run)
    print(pile.report(pile.findings(run, paper=given.paper or None)))


if __name__ == "__main__":
    command.run_script(main)
