"""Piles of an ensemble: the numbers of each, shares of the patterns, and maps of the mean pile."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from micstools.ensembles.ensemble import OUTCOMES
from micstools.piles import pile_numbers
from micstools.piles.layer import nominal_diameter, parted
from micstools.piles.maps import ground_map, top_of, usual_step
from micstools.piles.options import Options
from micstools.piles.pile import has_papers_blocks, still_level
from micstools.piles.pile_numbers import PileNumbers
from micstools.piles.placing import Area, Placing, drop_area, ends, placing
from micstools.reading import block_numbers, units
from micstools.reading.block_numbers import BlockNumbers
from micstools.reading.places import TOLERANCE, Place, Survey, places
from micstools.reading.reader import BadRun, Run
from micstools.reading.shares import table as share_table
from micstools.reading.shares import wilson
from micstools.reading.units import Units
from micstools.shapes.geometry import Array

PATTERNS = ("A", "B", "neither")
MEANING = {
    "A": "every dropped block off the floor",
    "B": "at least one more block on the floor",
    "neither": "a block found no room or stays above the water",
}
_PARTS = {
    "centre": ("x", "y", "z"),
    "spread": ("x", "y"),
    "slopes": ("x_min", "x_max", "y_min", "y_max"),
    "box": ("x_min", "y_min", "z_min", "x_max", "y_max", "z_max"),
}


@dataclass(frozen=True)
class Pile:
    """The pile of one run of an ensemble."""

    row: dict[str, Any]  # of the table of the ensemble: run, seed, choices, outcome, folder
    run: Run
    pattern: str  # one of PATTERNS
    numbers: PileNumbers
    blocks: list[BlockNumbers]
    top: Array  # height map (ny, nx) [m], nan where there is no block
    ground: Array  # height of the bed or floor under it (ny, nx) [m]

    @property
    def height(self) -> Array:
        """Height of its top above the ground (ny, nx) [m], 0 where there is no block."""
        return np.nan_to_num(self.top - self.ground, nan=0.0)

    @property
    def number(self) -> int:
        """Number of the run, from 1."""
        return int(self.row["run"])

    @property
    def complete(self) -> bool:
        """Are all blocks released? One may have left the tank through an open side."""
        return bool(self.run.bodies.released(-1).all())


@dataclass(frozen=True)
class Ensemble:
    """An ensemble and its piles."""

    folder: Path
    about: dict[str, Any]  # what ensemble.json says
    piles: list[Pile]
    emptied: list[tuple[dict[str, Any], Run]]  # rows and runs whose blocks have all left the tank
    step: float  # of the maps [m]
    left_out: dict[int, str]  # runs without a pile, and what they are instead
    area: Area  # of the plan, in which blocks should lie

    @property
    def placing(self) -> Placing | None:
        """Where the released free blocks of all runs lie."""
        return placing(list(self.runs.values()), self.area)

    @property
    def runs(self) -> dict[int, Run]:
        """By their number those with a free block that was released, if none is left, too."""
        return {p.number: p.run for p in self.piles} | {
            int(r["run"]): run for r, run in self.emptied
        }

    @property
    def left_words(self) -> str:
        """What no pile counts, and why; empty where there is nothing."""
        names = ", ".join(f"{k} ({v})" for k, v in self.left_out.items())
        return names and f"left out for want of a pile: runs {names}"

    @property
    def has_patterns(self) -> bool:
        """Do the paper's patterns A and B mean anything here?"""
        return has_papers_blocks(self.example.run)

    @property
    def units(self) -> Units:
        """The units of its figures."""
        return units.of_run(self.example.run)

    @property
    def whole(self) -> list[Pile]:
        """The piles with all their blocks: mean and spread are of these."""
        return [p for p in self.piles if p.complete]

    @property
    def example(self) -> Pile:
        """The one that stands for what all have in common: the first with all its blocks, if any
        has."""
        return next(iter(self.whole), self.piles[0])

    @property
    def choices(self) -> list[dict[str, Any]]:
        """The varied variables, a dictionary for each choice."""
        found: list[dict[str, Any]] = self.about["choices"]
        return found

    def of(self, choice: dict[str, Any]) -> "Ensemble":
        """That of a choice."""
        piles = [p for p in self.piles if choice.items() <= p.row.items()]
        emptied = [(row, run) for row, run in self.emptied if choice.items() <= row.items()]
        about = self.about | {"choices": [choice]}
        return replace(self, about=about, piles=piles, emptied=emptied)

    @property
    def parts(self) -> list["Ensemble"]:
        """An ensemble of each choice: the runs of different choices have the same drops, so they
        are not independent, and numbers over all of them tell nothing."""
        parts = map(self.of, self.choices)
        return [part for part in parts if part.piles]  # of others no run has come to its end

    @property
    def name(self) -> str:
        """The choice of an ensemble that has one, in words; empty where nothing is varied."""
        return ", ".join(f"{k} = {v}" for k, v in self.choices[0].items())


@dataclass(frozen=True)
class Maps:
    """The mean pile over the plan, (ny, nx) each; where there is no block its height is 0."""

    x: Array  # (nx) middles [m]
    y: Array  # (ny)
    cover: Array  # probability that a block lies over the point
    mean: Array  # height above the floor or bed [m]
    low: Array  # 10 % of the piles are lower [m]
    high: Array  # 10 % are higher [m]


def is_ensemble(path: Path) -> bool:
    """Is it the folder of an ensemble?"""
    return (path / "ensemble.json").is_file()


def open_ensemble(
    folder: Path,
    step: float | None = None,
    box: tuple[Array, Array] | None = None,
    area: Area | None = None,
    told: Options = Options(),  # noqa: B008 (it is frozen)
) -> Ensemble:
    """Read every run that has an outcome; maps have squares of `step` [m], by default a 300th of
    the tank; `box` is that of the porosity, by default the one around each pile; blocks should lie
    in the `area`, by default that of the drops; layers as `told`."""
    said = about(folder / "ensemble.json")
    table = said["table"]
    done = [row for row in table if row["outcome"] in OUTCOMES]
    left = {int(row["run"]): str(row["outcome"]) for row in table if row not in done}
    if not done:
        raise BadRun(f"{folder} holds no run that came to its end")
    if step is None:
        step = usual_step(Run(folder / str(done[0]["folder"]) / "result"))
    piles, emptied = [], []
    for row in done:
        run = Run(folder / str(row["folder"]) / "result")
        if parted(run)[0]:
            piles.append(_pile(run, row, step, box, told))
            continue
        gone = bool((run.bodies.status == 4).any())
        left[int(row["run"])] = "all blocks out of the tank" if gone else "no block in the tank"
        emptied += [(row, run)] if gone else []
    if not piles:
        raise BadRun(f"{folder} holds no run with a block in the tank at its end")
    area = area or drop_area([p.run for p in piles] + [run for _, run in emptied])
    return Ensemble(folder, said, piles, emptied, step, left, area)


def about(path: Path) -> dict[str, Any]:
    """What an ensemble says of itself."""
    try:
        found: dict[str, Any] = json.loads(path.read_text())
        if found["format"] != "mics-ensemble":
            raise KeyError("format")
    except (ValueError, KeyError, TypeError) as error:
        raise BadRun(
            f"{path}: cannot be read; the same `mics-tools ensemble` writes it anew"
        ) from error
    return found


def _pile(run: Run, row: dict[str, Any], step: float, box: tuple[Array, Array] | None,
          told: Options) -> Pile:  # fmt: skip
    found = pile_numbers.numbers(run, step, box=box, told=told)
    top = top_of(run, step)
    ground = ground_map(run, run.grid.low, run.grid.high, step)
    return Pile(row, run, pattern(run, found), found, block_numbers.of_blocks(run), top, ground)


def pattern(run: Run, found: PileNumbers) -> str:
    """The pattern of a pile by its contacts, see MEANING."""
    b = run.bodies
    if not b.present(-1).all():
        return "neither"
    level = still_level(run)
    if level is not None and (b.position[-1, b.dropped, 2] > level).any():
        return "neither"
    return "B" if found.on_floor else "A"


def pattern_shares(piles: Sequence[Pile]) -> dict[str, dict[str, Any]]:
    """Count, share and its 95 % interval of each pattern."""
    return share_table(Counter(p.pattern for p in piles), len(piles), PATTERNS)


def running(piles: Sequence[Pile], name: str) -> Iterator[tuple[int, float, float, float]]:
    """After each run: how many there were, the share of a pattern, and its 95 % interval."""
    count = 0
    for total, p in enumerate(piles, start=1):
        count += p.pattern == name
        yield total, count / total, *wilson(count, total)


def places_of(part: Ensemble, survey: Survey = Survey(),  # noqa: B008 (it is frozen)
              tolerance: float | None = None) -> tuple[list[list[Place]], float]:  # fmt: skip
    """The places of each run of a choice, and the tolerance [m], by default that of `places`."""
    bodies, _ = parted(part.example.run)
    wanted = tolerance or TOLERANCE * nominal_diameter(bodies.values())
    return [places(run, survey) for run in part.runs.values()], wanted


def maps(ensemble: Ensemble) -> Maps:
    """The mean pile of the complete ones, its spread, and where blocks are likely."""
    whole = ensemble.whole
    if not whole:
        raise BadRun(f"{ensemble.folder} holds no pile with all its blocks")
    tops = np.array([p.top for p in whole])
    grid = whole[0].run.grid
    height = np.array([p.height for p in whole])
    low, high = np.percentile(height, [10, 90], axis=0)
    x, y = (grid.low[d] + (np.arange(tops.shape[2 - d]) + 0.5) * ensemble.step for d in (0, 1))
    return Maps(x, y, np.isfinite(tops).mean(axis=0), height.mean(axis=0), low, high)


def remarkable(ensemble: Ensemble) -> dict[int, list[str]]:
    """What is special of some complete piles, by the number of their run: the one nearest to the
    mean pile, the one farthest from it, the highest and the lowest."""
    whole = ensemble.whole
    if len(whole) < 3:
        return {}
    mean = maps(ensemble).mean
    away = np.array([np.sqrt(((p.height - mean) ** 2).mean()) for p in whole])
    tops = np.array([p.numbers.top for p in whole])
    marks = {"most typical": away.argmin(), "least typical": away.argmax(),
             "highest": tops.argmax(), "lowest": tops.argmin()}  # fmt: skip
    found: dict[int, list[str]] = {}
    for words, k in marks.items():
        found.setdefault(whole[int(k)].number, []).append(words)
    return found


def spread_of(values: Sequence[float]) -> dict[str, float] | None:
    """Median with its 95 % interval, 5 and 95 % of the known ones of some values; none where none
    is known."""
    known = [v for v in values if v == v]
    if not known:
        return None
    low, median, high = (float(v) for v in np.percentile(known, [5, 50, 95]))
    interval = dict(zip(("median low", "median high"), median_interval(known), strict=True))
    return {"median": median, "5 %": low, "95 %": high, "known": len(known)} | interval


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """95 % interval of the median of what the values are drawn from, whatever its form, from their
    order; nan for fewer than six. Source: Conover, Practical nonparametric statistics, 3.2."""
    n, ordered = len(values), sorted(values)
    below, rank, weight = 0, 0, 1  # times 0.5**n
    while 40 * (below + weight) <= 2**n:  # 2.5 %
        below += weight
        rank += 1
        weight = weight * (n - rank + 1) // rank  # binomial coefficients
    if rank == 0:
        return float("nan"), float("nan")
    return ordered[rank - 1], ordered[n - rank]


def rows(ensemble: Ensemble) -> list[dict[str, Any]]:
    """A row for each run with an outcome, its numbers included."""
    return [
        p.row
        | {"pattern": p.pattern, "complete": p.complete}
        | {
            "outside": ""
            if (share := ensemble.area.share_outside(ends(p.run))) != share
            else share,
            "out_of_tank": int((p.run.bodies.status == 4).sum()),
        }
        | flat(p.numbers)
        for p in ensemble.piles
    ]


def flat(found: PileNumbers) -> dict[str, float | str]:
    """The numbers, each for itself; empty where one is not known."""
    values: dict[str, float] = {}
    for name, value in asdict(found).items():
        if isinstance(value, tuple):
            values |= {f"{name}_{part}": v for part, v in zip(_PARTS[name], value, strict=True)}
        else:
            values[name] = value
    return {name: "" if v != v else v for name, v in values.items()}


def summary(ensemble: Ensemble) -> dict[str, Any]:
    """What `pile.json` holds of an ensemble, the estimates for each choice of the varied variables;
    nan is left to the writer."""
    return {
        "format": "mics-ensemble-piles",
        "format_version": 1,
        "runs": len(ensemble.piles),
        "complete": len(ensemble.whole),
        "left_out": {str(k): v for k, v in ensemble.left_out.items()},
        "step": ensemble.step,
        "units": pile_numbers.si_units(flat(ensemble.example.numbers)),
        "patterns": [
            {
                "choice": part.choices[0],
                "meaning": MEANING,
                "shares": pattern_shares(part.piles),
                **_estimates(part),
            }
            for part in ensemble.parts
        ],
        **(_estimates(ensemble) if len(ensemble.choices) == 1 else {}),
        "table": rows(ensemble),
    }


def _estimates(part: Ensemble) -> dict[str, Any]:
    """Of the runs of one choice: how the shares converge, the spread of the numbers of the complete
    piles, and which runs are remarkable."""
    return {
        "convergence": {name: list(running(part.piles, name)) for name in PATTERNS},
        "placing": asdict(part.placing) if part.placing else None,
        "numbers": spreads(part),
        "remarkable": {str(k): v for k, v in remarkable(part).items()},
    }


def spreads(part: Ensemble) -> dict[str, dict[str, float]]:
    """The spread of each number of the complete piles that is known."""
    found = [flat(p.numbers) for p in part.whole]
    known = {
        name: spread_of([float(row[name]) for row in found if row[name] != ""])
        for name in (found[0] if found else {})
    }
    return {name: spread for name, spread in known.items() if spread}
