"""Pictures of blocks, water and flow like the paper's figures 5 to 7.

usage: python tools/plot_pile.py RUN [--times 0.2 0.5 ...] [--view front side] [--out DIR]
"""

from micstools.cli import script

if __name__ == "__main__":
    script("plot_pile", __doc__)
