"""What can be said of the pile of a run, and in the paper's tank of its figures 5 to 7.

usage: python tools/check_pile.py RUN [--paper]

The exit code is 0 whatever is seen: these are observations of one chaotic pile, not pass marks.
"""

from micstools.cli import script

if __name__ == "__main__":
    script("check_pile", __doc__)
