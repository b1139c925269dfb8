"""Heights, speeds, forces, liquid, energies and solver of a run against time.

usage: python tools/plot_history.py RUN [--out FILE]
"""

from micstools.cli import script
from micstools.commands import plot

if __name__ == "__main__":
    script(__doc__, plot.history_arguments, plot.draw_history)
