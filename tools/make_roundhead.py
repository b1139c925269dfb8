"""Make the survey and the placing plan of input/roundhead.nml, the head of a breakwater.

usage: python tools/make_roundhead.py [FOLDER]       (default: input)

A core whose crest ends in a half circle falls at 1:1.5 to the sea floor (roundhead.asc, levels in
a survey). Units stand on its seaward side, in rows along the contours from the toe up, each row
half a place aside from that below it, with any heading; they are placed row by row
(roundhead.csv).
"""

import csv
import math
import random
import sys
from pathlib import Path

HEAD = (354_200.0, 5_621_080.0)  # the end of the axis of the crest, which comes from the west [m]
CREST, FLOOR = 3.0, -6.0  # levels of the core and of the sea floor [m]
RADIUS = 3.0  # of the crest at the head [m]
SLOPE = 1.5  # run over rise
EAST, NORTH = (2, 24), (-18, 18)  # what is surveyed, from the head [m]
UNITS, ROWS = 40, 4
HEIGHT = 2.0  # of a unit [m]
ALONG, UP = 1.1 * HEIGHT, 1.0 * HEIGHT  # from unit to unit in a row, and from row to row [m]
TOE = 1.0  # of the lowest row above the toe, along the slope [m]
MINUTES = 0.25  # from one unit to the next


def level(east: float, north: float) -> float:
    """Of the core at a place from the head [m]."""
    away = math.hypot(max(east, 0.0), north)
    return max(FLOOR, CREST - max(0.0, away - RADIUS) / SLOPE)


def survey() -> str:
    """An Esri raster of the levels, a metre apart."""
    head = {
        "ncols": EAST[1] - EAST[0] + 1,
        "nrows": NORTH[1] - NORTH[0] + 1,
        "xllcenter": HEAD[0] + EAST[0],
        "yllcenter": HEAD[1] + NORTH[0],
        "cellsize": 1,
    }
    rows = (
        " ".join(f"{level(east, north):.2f}" for east in range(EAST[0], EAST[1] + 1))
        for north in range(NORTH[1], NORTH[0] - 1, -1)
    )
    return "\n".join([*(f"{name} {value}" for name, value in head.items()), *rows]) + "\n"


def plan() -> list[list[object]]:
    """The rows of the plan: as many units in each as keep their distance, UNITS in all."""
    toe = RADIUS + SLOPE * (CREST - FLOOR)
    slant = SLOPE / math.hypot(1, SLOPE)  # of a way along the slope, seen from above
    away = [toe - slant * (TOE + UP * row) for row in range(ROWS)]
    angle = UNITS * ALONG / sum(away)  # of the sector that they fill [rad]
    turn, rows, placed = random.Random(1), [], 0
    for row, radius in enumerate(away):
        n = round(UNITS * sum(away[: row + 1]) / sum(away)) - placed
        for k in range(n):
            to = angle * ((k + 0.5 + 0.25 * (-1) ** row) / n - 0.5)
            east, north = HEAD[0] + radius * math.cos(to), HEAD[1] + radius * math.sin(to)
            rows.append(["tetrapod", f"{east:.2f}", f"{north:.2f}", "",
                         f"{60 * MINUTES * (placed + k):g}", turn.randrange(120),
                         f"{chr(65 + row)}{k + 1}"])  # fmt: skip
        placed += n
    return rows


def main() -> None:
    """Write both."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "input")
    (folder / "roundhead.asc").write_text(survey())
    with (folder / "roundhead.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerows([["shape", "x", "y", "z", "time", "yaw_deg", "name"], *plan()])


if __name__ == "__main__":
    main()
