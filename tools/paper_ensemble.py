"""The fifty drops of the paper anew: shares of the patterns, their page, and what moves them.

usage: python tools/paper_ensemble.py [--runs 50] [--moves 20] [--jobs 2] [--out DIR]
    [--set drop.if_blocked=raise]
"""

from micstools.cli import script

if __name__ == "__main__":
    script("paper_ensemble", __doc__)
