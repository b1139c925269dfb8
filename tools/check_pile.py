"""What the paper says of its figures 5 to 7, seen in a run or not, with the figures.

usage: python tools/check_pile.py RUN

The exit code is 0 whatever is seen: these are observations of one chaotic pile, not pass marks.
"""

import argparse
from pathlib import Path

from micstools import pile
from micstools.reader import Run


def main() -> None:
    """Print the findings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="output folder of a run")
    print(pile.report(pile.findings(Run(parser.parse_args().run))))


if __name__ == "__main__":
    main()
