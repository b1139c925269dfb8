"""The page of a run, or of an ensemble, while it goes on. The parts that change are made anew at
each look, as markup, and put in their places by `live.js`."""

import shlex
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from micstools.ensembles import ensemble, ensemble_table
from micstools.ensembles.ensemble import Member
from micstools.pages import charts, run_page, run_words
from micstools.pages.charts import Curve
from micstools.pages.html import Markup, document, facts, filled, markup, table, tag
from micstools.pages.parts import player
from micstools.reading import units
from micstools.reading.reader import Run
from micstools.reading.shares import in_words
from micstools.reading.units import figure
from micstools.serve.living import State, clock
from micstools.shapes.geometry import Array

SCRIPTS = ("live",)
_ROWS = 8  # of the table of the step
_STEP = (
    ("t [s]", "time", ".5g"), ("dt [s]", "dt", ".3g"), ("Courant", "cfl", ".3f"),
    ("div. [1/s]", "divergence_max", ".1e"), ("passes", "pressure_passes", ".0f"),
    ("iterations", "solver_iterations", ".0f"), ("substeps", "substeps", ".0f"),
    ("contact Courant", "contact_courant_max", ".3f"), ("asleep", "sleeping", ".0f"),
    ("drift", "liquid_volume_drift", ".1e"),
)  # fmt: skip
_START = "const live = startLive();\n"
Parts = dict[str, Markup]


def frame(
    page: str, title: str, head: Markup, above: Markup | None = None, go_on: Markup | None = None
) -> str:
    """The page of a run or an ensemble; its parts come later. `above` it and a button of a run
    where it is part of something."""
    label = "the blocks so far; arrow keys turn it, + and - zoom, space plays"
    content = filled(page, title=title, go_on=go_on, player=player("player", label))
    return document(title, above, content, script=_START, more=SCRIPTS, head=head)


def bar(share: float, words: str) -> Markup:
    """How much is done."""
    return tag("progress", max=1, value=f"{share:.4f}", aria_label=words)


def waiting(folder: Path, trouble: str) -> Parts:
    """Before a run begins, or where its file cannot be read."""
    return {"state": markup(trouble or f"Nothing in {folder} yet: waiting for the run to begin.")}


def run_parts(run: Run, found: State) -> Parts:
    """What is shown of a run now."""
    t, end = figure(found.time), figure(found.end)
    said = f"{run_words.capital(found.words)} at t = {t} of {end} s"
    if found.running:
        said += f", {clock(found.left)} left at this pace"
    # The table of the step, the newest row first; columns that mean nothing here are left out
    s = run.series
    shown = [c for c in _STEP if s.time.size and np.isfinite(getattr(s, c[1])[-1])]
    rows: list[list[object]] = [
        [format(float(getattr(s, name)[k]), form) for _, name, form in shown]
        for k in range(s.time.size - 1, max(-1, s.time.size - 1 - _ROWS), -1)
    ]
    way_on: list[object] = []
    if not found.running and found.code != 0 and run.restart_files:
        newest = shlex.quote(str(run.folder / run.restart_files[-1]))
        way_on = [" It goes on with ", tag("code", f"mics-tools run CASE --restart {newest}"), "."]
    parts = {
        "state": markup(said + ".", *way_on),
        "bar": bar(1.0 if found.code == 0 else found.share, said),
        "facts": _facts(run, found),
        "step": table([words for words, _, _ in shown], rows),
    }
    return parts | {"history": markup(*_history(run))}


def _facts(run: Run, found: State) -> Markup:
    b, s = run.bodies, run.series
    pairs: list[tuple[str, object, str]] = [
        ("simulated", f"{figure(found.time)} s", f"of {figure(found.end)} s"),
        ("computing time", clock(found.wall), "so far"),
        ("time left", clock(found.left), "at the pace of the last rows"),
        ("rows", s.time.size, f"last step {figure(float(s.dt[-1]))} s" if s.dt.size else ""),
    ]
    if b.n and b.time.size:
        here = b.present(-1)
        moving = (_speeds(run) > float(run.value("run", "rest_speed"))) & here & ~b.fixed
        said = run_words.count(int(moving.sum()), "block moves", "blocks move")
        pairs.append(("released", f"{int(here.sum())} of {b.n}", said))
    return facts(pairs)


def _speeds(run: Run) -> Array:
    """Mean speed of each block since the row read before [m/s]; velocities of resting blocks have a
    noise of some mm/s."""
    b = run.bodies
    if b.time.size < 2:
        return np.asarray(np.linalg.norm(b.velocity[-1], axis=1))
    way = np.linalg.norm(b.position[-1] - b.position[-2], axis=1)
    return np.asarray(way / (b.time[-1] - b.time[-2]))


def _history(run: Run) -> list[Markup]:
    """Curves of the blocks, and of what tells whether the numbers are sound."""
    if run.series.time.size < 2:
        return [tag("p", "Two rows make a curve.", class_="note")]
    drawn = run_page.curves(run, units.of_run(run)) if run.bodies.n else []
    s = run.series
    more = [
        charts.lines([Curve(s.time, values, 2)], "time [s]", name)
        for values, name in (
            (s.dt, "time step [s]"),
            (s.kinetic_energy_fluid, "kinetic energy of the fluid [J]"),
            (s.liquid_volume_drift, "drift of the liquid volume [-]"),
        )
        if np.isfinite(values).sum() > 1
    ]
    return [*drawn, tag("div", *more, class_="charts")]


def ensemble_parts(
    states: dict[Member, ensemble.State], running: dict[int, State], title: Callable[[Member], str]
) -> Parts:
    """What is shown of an ensemble now. `running`: how far the runs are that go on, by number."""
    done = sum(end.counts for end in states.values())
    total = len(states)
    outcomes = ensemble_table.shares(states)
    rows: list[list[object]] = [
        [words, in_words(outcomes[name]["count"], done) if done else "–"]
        for name, words in zip(ensemble.OUTCOMES, ensemble.OUTCOMES, strict=True)
    ]
    going = f", {run_words.count(len(running), 'run goes', 'runs go')} on" if running else ""
    said = f"{done} of {total} runs done{going}."
    left = [s.left for s in running.values() if np.isfinite(s.left)]
    if left:
        said += f" The next ends in {clock(min(left))}."
    # How many runs have no outcome, and why
    counted = Counter(end.outcome for end in states.values() if not end.counts)
    return {
        "state": markup(said),
        "bar": bar(done / total if total else 0.0, said),
        "shares": markup(
            table(["outcome", "share of the runs done (95 % interval)"], rows, numbers=False),
            tag("p", ", ".join(f"{n} {outcome}" for outcome, n in counted.items()), class_="note"),
        ),
        "runs": table(
            ["run", "", "seed", "outcome", "t [s]", ""],
            [_run_row(m, end, running.get(m.number), title(m)) for m, end in states.items()],
            numbers=False,
        ),
    }


def _run_row(member: Member, end: ensemble.State, found: State | None, title: str) -> list[object]:
    look = tag("button", "look", type="button", data_run=member.number)
    if found:
        now = markup(bar(found.share, f"run {member.number}"), f" {clock(found.left)} left")
        return [member.number, look, member.seed, end.outcome, figure(found.time), now]
    known = end.time == end.time
    return [member.number, look if known else "", member.seed, end.outcome,
            figure(end.time), end.reason or title]  # fmt: skip
