"""Heights, speeds, forces, liquid, energies and solver of a run against time.

usage: python tools/plot_history.py RUN [--out FILE]
"""

from micstools.cli import script

if __name__ == "__main__":
    script("plot_history", __doc__)
