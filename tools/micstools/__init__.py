"""Run cases of mics and read, check and draw their results.

from micstools import Case, Run
"""

from micstools.cases.case import Case
from micstools.reading.reader import Run

__all__ = ["Case", "Run"]
