"""Draws worlds: every number and choice comes from hypothesis, which also makes them simpler."""

from collections.abc import Callable
from math import ceil, sqrt
from typing import Any

from hypothesis import strategies as st

from worlds.world import Group, Table, World

Draw = Callable[[st.SearchStrategy[Any]], Any]
GRAVITY = 9.8125
REACH = {  # farthest point of a shape from its centre, over its size
    "cube": 0.867, "sphere": 0.5, "box": 0.867, "cylinder": 0.708, "hexapod": 1.66,
    "tetrapod": 0.72, "dolos": 0.72, "reef_cube": 0.867, "rock": 1.0,
}  # fmt: skip
EVEN = ("cube", "sphere", "box", "hexapod")
"""Shapes that are their own image in mirrors across their axes."""
ALONG_X = dict.fromkeys((f"{d}_{s}" for d in "xyz" for s in ("min", "max")), "slip") | {
    "x_min": "periodic",
    "x_max": "periodic",
}
"""Sides that take no momentum along x."""
MADE = tuple(kind for kind in REACH if kind != "rock")


def number(low: float, high: float) -> st.SearchStrategy[float]:
    """A number in 64 steps, the simplest of which is `low`."""
    return st.integers(0, 64).map(lambda n: low + (high - low) * n / 64)


def power(low: float, high: float) -> st.SearchStrategy[float]:
    """The same in steps of equal ratio, with few digits."""
    return st.integers(0, 64).map(lambda n: float(f"{low * (high / low) ** (n / 64):.5g}"))


def around(size: float) -> st.SearchStrategy[float]:
    """A number of either sign, the simplest of which is 0."""
    return st.integers(-32, 32).map(lambda n: size * n / 32)


def one_of(*values: Any) -> st.SearchStrategy[Any]:
    """One of the values, of which the first is the simplest."""
    return st.sampled_from(values)


@st.composite
def attitude(draw: Draw) -> list[float]:
    """A quaternion of any length."""
    q = draw(st.lists(st.integers(-9, 9), min_size=4, max_size=4))
    return [float(c) for c in q] if any(q) else [1.0, 0.0, 0.0, 0.0]


@st.composite
def shape(draw: Draw, name: str, across: float, kinds: tuple[str, ...]) -> Group:
    """A shape that fits into a sphere of diameter `across` [m]."""
    kind = draw(one_of(*kinds))
    size: Any = float(f"{across / 2 / REACH[kind]:.6g}")
    found: Group = {"name": name, "kind": kind, "density": draw(power(1500.0, 5000.0))}
    if kind == "box":
        size = [size, size * draw(number(1.0, 0.4)), size * draw(number(1.0, 0.25))]
    if kind == "cylinder":
        size = [size, size * draw(number(1.0, 0.4))]
    if kind == "rock":
        mass = found["density"] * size**3 * 0.4
        mass = float(f"{mass:.6g}")
        return {**found, "seed": draw(st.integers(1, 99)), "variants": 8, "mass_50": mass,
                "mass_min": 0.75 * mass, "mass_max": 1.25 * mass}  # fmt: skip
    return {**found, "size": size, "refinement": 1}


@st.composite
def fluid(draw: Draw, across: float) -> Group:
    """Liquid and gas; with surface tension only where the grid can carry its waves."""
    liquid = draw(one_of(1000.0, 700.0, 3000.0))
    ratio = draw(one_of(830.0, 1.0, 1.2, 10.0, 5000.0))
    found = {
        "liquid_density": liquid,
        "liquid_viscosity": draw(power(1e-4, 10.0)),
        "gas_density": liquid / ratio,
        "gas_viscosity": draw(one_of(1.8e-5, 1e-3)),
        "gravity": [0.0, 0.0, -GRAVITY],
    }
    if across < 0.05:
        found["surface_tension"] = draw(one_of(0.0, 0.072))
    return found


def step(share: float, liquid: Group, cell: list[float]) -> float:
    """A share of the step of the shortest waves, below that of a very viscous surface [s]."""
    drive = sum(1 / c**2 for c in cell) * liquid["liquid_viscosity"] / liquid["liquid_density"]
    return min(share * sqrt(min(cell) / GRAVITY), 1.9 / drive)


@st.composite
def numerics(draw: Draw) -> Group:
    """Any of the methods."""
    return {
        "divergence_tolerance": 1e-6,
        "advection": draw(one_of("mp5", "tvd5", "upwind")),
        "pressure_solver": draw(one_of("cg", "bicgstab")),
        "preconditioner": draw(one_of("multigrid", "jacobi")),
        "max_pressure_passes": 30,
        "momentum": draw(one_of("conservative", "c_ismac")),
        "coupling": draw(one_of("monolithic", "mics")),
        "solid_fraction": draw(one_of("exact", "subcell")),
    }


@st.composite
def sides(draw: Draw, ends: tuple[str, ...] = ("no_slip", "slip", "periodic")) -> Group:
    """Kinds of the six sides, both of a direction alike."""
    x, y = draw(one_of(*ends)), draw(one_of(*ends))
    found = {"x_min": x, "x_max": x, "y_min": y, "y_max": y}
    return {
        **found,
        "z_min": draw(one_of("no_slip", "slip")),
        "z_max": draw(one_of("open", "slip")),
    }


def room(across: float, ends: Group, gap: float, n: list[int]) -> list[float]:
    """Lengths of the tank in x and y for so many blocks; a period is longer than two."""
    fewest = [1.8 if ends[f"{d}_min"] == "periodic" else 1 for d in "xy"]
    return [gap * across * max(least, m) for least, m in zip(fewest, n, strict=True)]


def rounded(values: list[float]) -> list[float]:
    """Six digits are enough for a place."""
    return [float(f"{v:.6g}") for v in values]


def tank(wanted: list[float], cell: list[float]) -> tuple[list[int], list[float]]:
    """Cells and lengths of the smallest tank of such cells that is at least so long."""
    cells = [ceil(w / c) for w, c in zip(wanted, cell, strict=True)]
    return cells, rounded([k * c for k, c in zip(cells, cell, strict=True)])


@st.composite
def still(draw: Draw) -> World:
    """Water at rest with one to three blocks held through its surface."""
    across = draw(power(0.01, 5.0))  # of a block [m]
    cells_across = draw(st.integers(4, 12))
    cell = [across / cells_across * draw(number(1.0, a)) for a in (1.4, 0.7, 1.3)]
    n = draw(st.integers(1, 3))
    level = across * draw(number(0.7, 1.3))
    ends = draw(sides())
    wanted = [*room(across, ends, 1.15, [n, 1]), level + across]
    cells, length = tank(wanted, cell)
    liquid = draw(fluid(across))
    dt = step(draw(number(0.1, 0.8)), liquid, cell)
    groups: list[tuple[str, Group]] = [
        ("run", {"t_end": 120 * dt, "dt": dt, "field_interval": 0.0, "restart_interval": 0.0}),
        ("grid", {"cells": cells, "length": length}),
        ("boundary", ends),
        ("fluid", {**liquid, "water_level": level}),
        ("numerics", draw(numerics())),
    ]
    for b in range(n):
        place = [(b + 0.5) * length[0] / n, length[1] / 2, level]
        place = [
            p + across * draw(around(s)) for p, s in zip(place, (0.03, 0.03, 0.4), strict=True)
        ]
        groups += [
            ("shape", draw(shape(f"s{b}", across, tuple(REACH)))),
            ("body", {"shape": f"s{b}", "fixed": True, "position": rounded(place),
                      "quaternion": draw(attitude())}),
        ]  # fmt: skip
    return World(groups)


@st.composite
def lying(draw: Draw) -> World:
    """Water at rest over one or two free stacks of boxes."""
    across = draw(power(0.01, 5.0))  # of a box [m]
    cell = [across / draw(st.integers(4, 8)) * draw(number(1.0, a)) for a in (1.4, 0.7, 1.3)]
    n, floors = draw(st.integers(1, 2)), draw(st.integers(1, 3))
    level = across * draw(number(0.5, 2.5))
    ends = draw(sides(("no_slip", "slip")))
    wanted = [*room(across, ends, 1.6, [n, 1]), max(level, across * floors) + 0.5 * across]
    cells, length = tank(wanted, cell)
    liquid = draw(fluid(across))
    dt = step(draw(number(0.05, 0.4)), liquid, cell)
    groups: list[tuple[str, Group]] = [
        ("run", {"t_end": 20 * dt, "dt": dt, "field_interval": 0.0, "restart_interval": 0.0}),
        ("grid", {"cells": cells, "length": length}),
        ("boundary", ends),
        ("fluid", {**liquid, "water_level": level}),
        ("numerics", draw(numerics())),
        # contact spheres have to sink; how far surfaces do goes with the square of this time
        ("contact", {**draw(contact(across)), "model": "surface",
                     "contact_time": 3e-3 * sqrt(across / GRAVITY)}),
    ]  # fmt: skip
    for b in range(n):
        place, top = rounded([(b + 0.5) * length[0] / n, length[1] / 2]), 0.0
        for f in range(floors):
            name, width = f"s{b}{f}", across * (1.0 - 0.2 * f)
            size = rounded([width, 0.8 * width, across * draw(number(0.9, 0.3))])
            middle, top = top + size[2] / 2, top + size[2]
            groups += [
                ("shape", {"name": name, "kind": "box", "size": size, "refinement": 1,
                           "density": draw(power(3100.0, 5000.0))}),
                ("body", {"shape": name, "position": [*place, middle],
                          "axis": [0.0, 0.0, 1.0], "angle_deg": draw(around(90.0))}),
            ]  # fmt: skip
    return World(groups)


@st.composite
def bed(draw: Draw, across: float, length: list[float]) -> Table:
    """Heights of a floor that fits to itself where the tank is periodic, in one row of words."""
    heights = [[across * draw(number(0.0, 0.2)) for _ in range(3)] for _ in range(3)]
    row = [4, 4, 0.0, 0.0, *(c / 3 for c in length[:2])]
    row += [heights[j % 3][i % 3] for j in range(4) for i in range(4)]
    return {"#" + " " * n: "m" for n in range(len(row))}, [row]


@st.composite
def body(
    draw: Draw, k: int, place: list[float], across: float, time: float, plain: bool
) -> tuple[str, Group]:
    """Block k near a place: held, moved, free; if not `plain`, dropped, lowered or on a table."""
    speed, lazy = sqrt(GRAVITY * across), draw(number(0.0, 1.0))
    here = rounded([p + across * draw(around(0.05)) for p in place])
    found: Group = {"shape": f"s{k}", "position": here, "quaternion": draw(attitude())}
    role = draw(one_of("free", "held", "moved", *(() if plain else ("dropped", "lowered"))))
    if role == "held":
        return "body", {**found, "fixed": True}
    if role == "lowered":
        found |= {"lowering_speed": 0.2 * speed, "release": draw(one_of("touch", "height"))}
        if found["release"] == "height":
            found["release_height"] = 0.05 * across
        return "drop", found
    if role == "moved":
        speed = 0.3 * across / time  # it stays in the gap around its place
        if not plain and draw(st.booleans()):
            far = rounded([h + 0.3 * across * draw(around(0.4)) for h in here])
            q = found.pop("quaternion")
            ways = [(0.0, here, q), (0.4, far, [c + draw(around(1.0)) for c in q]), (0.9, here, q)]
            rows = [[t * time, *at, *turned] for t, at, turned in ways]
            return "body", {**found, "fixed": True, "motion": rows}
    along = [speed * draw(around(s)) for s in (0.3, 0.3, 0.5)]
    if role == "dropped":
        found |= {"velocity": along, "first_time": lazy * time, "interval": time / 3}
        return "drop", {**found, "seed": draw(st.integers(1, 99)), "spread": [0.03 * across] * 3}
    spin = [speed / across * draw(around(0.5)) for _ in "xyz"]
    return "body", {**found, "velocity": along, "angular_velocity": spin, "fixed": role == "moved"}


@st.composite
def contact(draw: Draw, across: float) -> Group:
    """How blocks collide."""
    return {
        "model": draw(one_of("spheres", "surface")),
        "contact_time": 0.03 * sqrt(across / GRAVITY) * draw(number(0.5, 2.0)),
        "restitution": draw(number(0.1, 0.9)),
        "friction": draw(number(0.2, 1.0)),
    }


@st.composite
def world(
    draw: Draw,
    kinds: tuple[str, ...] = ("coupled", "fluid", "dry", "light"),
    plain: bool | str = False,
    shapes: tuple[str, ...] = (),
    ends: Group | None = None,
) -> World:
    """One to eight blocks of any kind in a tank with or without water. `plain`: there from the
    start, of shapes that are their own mirror image, the water in boxes; 'single': everywhere."""
    across = draw(power(0.01, 5.0))  # of a block [m]
    physics = draw(one_of(*kinds))
    cell = [across / draw(st.integers(4, 7)) * draw(number(1.0, a)) for a in (1.4, 0.7, 1.3)]
    places = [draw(st.integers(1, 2)) for _ in "xyz"]  # for a block each
    ends = dict(ends or draw(sides()))
    wanted = [*room(across, ends, 1.2, places[:2]), 1.2 * across * (places[2] + 1)]
    cells, length = tank(wanted, cell)
    liquid = draw(fluid(across))
    dt = step(draw(number(0.05, 0.4)), liquid, cell)
    steps = draw(st.integers(4, 24))
    run = {"physics": physics, "t_end": steps * dt, "dt": dt,
           "history_interval": 0.0 if plain else draw(one_of(0.0, 2.5 * dt)),
           "field_interval": 0.0 if plain else draw(one_of(0.0, 3.5 * dt)),
           "restart_interval": 0.0, "rest_speed": 1e-3 * sqrt(GRAVITY * across)}  # fmt: skip
    groups: list[tuple[str, Group]] = [
        ("run", run),
        ("grid", {"cells": cells, "length": length}),
        ("boundary", ends),
        ("fluid", liquid),
        ("numerics", draw(numerics())),
        ("contact", draw(contact(across))),
    ]
    level = length[2] * draw(number(0.4, 0.8))
    if plain == "single":
        kept = ("liquid_density", "liquid_viscosity", "gravity")
        alone = {name: value for name, value in groups[3][1].items() if name in kept}
        groups[3] = ("fluid", {**alone, "single_phase": True})
        groups[4][1]["momentum"] = "c_ismac"  # the other sweeps the directions one by one
        ends["z_max"] = "slip"
    elif plain:
        groups.append(("water", {"min": [0.0, 0.0, 0.0], "max": [*length[:2], level]}))
    else:
        groups[3][1]["water_level"] = level
    special = "" if plain else draw(one_of("", "bed", "stream", "survey"))
    if special == "stream" and physics in ("coupled", "fluid"):
        current = [0.2 * sqrt(GRAVITY * across), 0.0, 0.0]
        ends |= {"x_min": "inflow", "x_max": "outflow", "x_min_velocity": current}
        groups[3][1]["velocity"] = current
    elif draw(st.booleans()) and plain != "single":
        corner = rounded([c * draw(number(0.3, 0.7)) for c in length])
        groups.append(("water", {"min": [0.0, 0.0, 0.0], "max": [*corner[:2], 0.95 * length[2]]}))
    tables: dict[str, Table] = {}
    slots = [
        (i, j, k) for k in range(places[2]) for j in range(places[1]) for i in range(places[0])
    ]
    for b, slot in enumerate(slots):
        place = [(s + 0.5) * c / n for s, c, n in zip(slot, length, places, strict=True)]
        place[2] = (slot[2] + 0.6) * 1.2 * across
        groups.append(
            ("shape", draw(shape(f"s{b}", across, shapes or (EVEN if plain else tuple(REACH)))))
        )
        name, block = draw(body(b, place, across, run["t_end"], plain))
        if "motion" in block:
            units = {"time": "s", **dict.fromkeys("xyz", "m")}
            units |= {f"q{c}": "" for c in "wxyz"}
            tables[f"m{b}.csv"] = units, block["motion"]
            block["motion"] = f"m{b}.csv"
        groups.append((name, block))
    if special == "bed":
        tables["bed.txt"] = draw(bed(across, length))
        groups.append(("bed", {"file": "bed.txt"}))
    found = World(groups, tables)
    if special != "survey":
        return found
    return found.shifted([across * draw(st.integers(-9, 9)), 3e5 * across, 5e6 * across])


@st.composite
def busy(draw: Draw) -> World:
    """Blocks come late, held ones too, wait, hang in slings, and leave through the sides of x."""
    found = draw(world(("coupled", "dry", "light")))
    t_end, speed = found.value("run", "t_end"), 1e3 * found.value("run", "rest_speed")
    if draw(st.booleans()) and found.value("boundary", "x_max") != "outflow":
        found = found.changed("boundary", x_min="outflow", x_max="outflow")
    for name, block in found.groups:
        if "velocity" in block and "shape" in block:
            block["velocity"][0] += speed * draw(around(1.0))
        if name == "body":
            block["release_time"] = draw(one_of(0.0, 0.3 * t_end, 0.7 * t_end))
        elif name == "drop":
            block |= {"if_blocked": draw(one_of("wait", "raise", "skip")),
                      "count": draw(st.integers(1, 3)), "interval": 0.3 * t_end}  # fmt: skip
        if "lowering_speed" in block and draw(st.booleans()):
            block.pop("release_height", None)
            block |= {"release": "set_down", "swivel": draw(st.booleans())}
    return found
