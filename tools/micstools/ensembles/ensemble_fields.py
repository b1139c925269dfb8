"""Which runs of an ensemble are run once more with the fields of the water, and their cases.

    DIR/0004/fields/case.nml, result/, log.txt     the same case and seed, with fields

Output never changes the steps of a run, so its blocks fall as they fell before.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from micstools.cases import settings
from micstools.ensembles.ensemble import Member, Plan, State, members
from micstools.reading.overlap import present_bodies, without_machines
from micstools.reading.reader import BadRun, Run

MEDIAN = "median"
OPTION = "--keep-fields"


def parse(word: str, runs: int) -> list[int]:
    """The numbers of the runs in `3,7`; none of them for `median`."""
    if word.strip().lower() == MEDIAN:
        return []
    try:
        found = sorted({int(part) for part in word.split(",")})
    except ValueError:
        raise BadRun(f"{OPTION} {word}: must be median, or numbers of runs as in 3,7") from None
    wrong = [number for number in found if not 1 <= number <= runs]
    if wrong:
        raise BadRun(f"{OPTION} {word}: there is no run {wrong[0]}, they go from 1 to {runs}")
    return found


def with_fields(plan: Plan) -> list[Member]:
    """Every run of the plan as it would be with fields."""
    found = [
        replace(member, folder=member.folder / "fields") for member in members(plan, fields=True)
    ]
    for member in found:
        if settings.value(member.text, "run", "field_interval") == 0:
            raise BadRun(f"{OPTION}: the case writes none; add --set run.field_interval=0.1")
        physics = str(settings.value(member.text, "run", "physics") or "").strip()
        if physics in ("dry", "light"):
            raise BadRun(f"{OPTION}: the case is {physics}, it has none")
    return found


def medians(table: Mapping[Member, State]) -> list[int]:
    """Of each choice the run with the median top among its complete piles, the lower of two."""
    tops: dict[object, list[tuple[float, int]]] = {}
    for member, end in table.items():
        run = Run(member.result) if end.counts else None
        if run is not None and run.bodies.n and run.bodies.released(-1).all():
            tops.setdefault(member.choice, []).append((top_of_pile(run), member.number))
    if not tops:
        raise BadRun(f"{OPTION} {MEDIAN}: no run ended with a complete pile, there is no median")
    return sorted(sorted(piles)[(len(piles) - 1) // 2][1] for piles in tops.values())


def top_of_pile(run: Run) -> float:
    """Highest point at the end of what no table moves [m]."""
    pile = without_machines(run, present_bodies(run, -1))
    tops = (float(body.points[:, 2].max()) for body in pile.values())
    return max(tops, default=float(run.grid.low[2]))


def numbered(numbers: Iterable[int]) -> str:
    """Runs as their folders are called."""
    return ", ".join(f"{number:04d}" for number in numbers)
