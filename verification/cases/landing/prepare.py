"""The map of heights of the slope: 60 mm at x = 0, 10 mm at x = 0.2 m."""

from pathlib import Path

Path("slope.txt").write_text("2 2 0 0 0.2 0.12\n" + 2 * "0.06 0.01\n")
