"""Heights, speeds, forces, liquid, energies and solver of a run against time.

usage: python tools/plot_history.py RUN [--out FILE]
"""

import argparse
from pathlib import Path

from micstools import command, plots


def main() -> None:
    """Draw and save the diagrams."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help=command.RUN_HELP)
    parser.add_argument("--out", type=Path, help="default RUN/pictures/history.png")
    given = parser.parse_args()
    run = command.open_run(given.run)
    out = given.out or run.folder / "pictures" / "history.png"
    out.parent.mkdir(parents=True, exist_ok=True)
    plots.history(run).savefig(out, dpi=110)
    print(out)


if __name__ == "__main__":
    command.run_script(main)
