"""Two case files for each column and each dropped body: the default step, and a tenth of it."""

import tomllib
from pathlib import Path
from typing import Any

TABLES = tomllib.loads(Path(__file__).with_name("collapses.toml").read_text())
USUAL = {"walls": "slip", "top": "open", "gas": 1.82e-5, "tank": "plane", "cost": (0.5, 2)}
END, EARLY, LATE = 0.4, 0.25, 2.0  # s; the energy is largest before 0.25 s
STEPS = {"whole": 1, "tenth": 10}


def numbers(values: tuple[float, ...]) -> str:
    """As a case file has them."""
    return ", ".join(f"{value:g}" for value in values)


def text(name: str, what: dict[str, Any], step: str) -> str:
    """The case file."""
    density, viscosity = TABLES["liquids"][what["liquid"]]
    cells, length, *corners = TABLES["tanks"][what["tank"]]
    divided, body, numerics = STEPS[step], what.get("body"), what.get("numerics")
    end = EARLY if divided > 1 or numerics else LATE if what.get("late") else END
    walls = {side: what["walls"] for side in ("x_min", "x_max", "y_min", "y_max", "z_min")}
    walls |= {"y_min": "slip", "y_max": "slip"} if cells[1] == 1 else {}
    walls["z_max"] = what["top"]
    sides = "  ".join(f"{side} = '{kind}'" for side, kind in walls.items())
    low, high = (numbers(corner) for corner in corners)
    inside = f"&water  min = {low}  max = {high} /"
    if body:
        inside = f"""&shape  name = 'body'  kind = '{body}'  size = 0.03  density = 2500.0 /
&drop  shape = 'body'  position = 0.061, 0.0592, 0.16  orientation = 'random' /"""
    called = name.replace("_", " ")
    return f"""! {called}: {"the default step" if divided == 1 else "a tenth of it"}.
! cost: {what["cost"][divided > 1]:g} s
&run
  title = '{called}'  t_end = {end:g}
  dt = {0.01 / divided:g}  cfl_max = {0.5 / divided:g}
  field_interval = 0.0  restart_interval = {end:g}
/
&grid  cells = {numbers(cells)}  length = {numbers(length)} /
&boundary  {sides} /
&fluid  liquid_density = {density:g}  liquid_viscosity = {viscosity:g}
  gas_viscosity = {what["gas"]:g}{"  water_level = 0.12" if body else ""} /
{inside}
{f"&numerics  {TABLES['numerics'][numerics]} /" if numerics else ""}
"""


for name, what in TABLES["collapses"].items():
    for step in STEPS:
        if step == "whole" or "numerics" not in what:
            Path(f"{name}_{step}.nml").write_text(text(name, USUAL | what, step))
