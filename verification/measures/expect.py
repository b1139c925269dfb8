"""Checks that are numbers of a run with a bound, as tables: `expect.toml` of a case.

Each `[[expect]]` has a `quantity`, an f-string, and a `number` that must be `below` a size,
`within` two bounds, or `close` to a number within a relative `band`; or a statement that must be
`true`, with `figures` that tell it. Texts are Python over a run: `run`, its bodies `b`, series `s`,
folder `name`, `value(group, variable)`, `state()` of its restart file, `np`, `norm`,
`EXCESS_LIMIT`, and what `[let]` names. `runs` chooses runs by a pattern; where `counts` is false
a row is for information.
"""

import tomllib
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from measures.balance import liquid_between
from measures.checks import Checks
from micstools.reading.energy import made_by_contact
from micstools.reading.health import EXCESS_LIMIT
from micstools.reading.reader import Run
from micstools.shapes.geometry import rotation_matrix


def module(path: Path) -> SimpleNamespace:
    """What check.py of a case would be."""
    table = tomllib.loads(path.read_text())
    rows, names = table["expect"], table.get("let", {})

    def check(runs: list[Run], checks: Checks) -> None:
        for run in runs:
            judge(rows, names, run, checks)

    chosen = {word.upper(): tuple(table[word]) for word in ("varies", "quick") if word in table}
    return SimpleNamespace(check=check, **chosen)


def judge(rows: list[dict[str, Any]], names: dict[str, str], run: Run, checks: Checks) -> None:
    """The rows of a case for one run."""
    known: dict[str, Any] = {
        "run": run, "b": run.bodies, "s": run.series, "name": run.folder.name, "np": np,
        "norm": np.linalg.norm, "value": run.value, "state": run.restart,
        "EXCESS_LIMIT": EXCESS_LIMIT, "made_by_contact": made_by_contact,
        "liquid_between": liquid_between, "rotation_matrix": rotation_matrix,
    }  # fmt: skip

    def of(text: Any) -> Any:
        return eval(text, known) if isinstance(text, str) else text

    for word, text in names.items():
        known[word] = of(text)
    for row in rows:
        if not fnmatch(run.folder.name, row.get("runs", "*")):
            continue
        say: Callable[[str], str] = lambda text: str(of(f"f{text!r}"))  # noqa: E731
        quantity, counts = say(row["quantity"]), bool(of(row.get("counts", True)))
        if "true" in row:
            checks.true(quantity, of(row["true"]), say(row.get("figures", "")), counts)
        elif "below" in row:
            checks.below(quantity, of(row["number"]), of(row["below"]), counts)
        elif "within" in row:
            low, high = map(of, row["within"])
            checks.within(quantity, of(row["number"]), low, high, counts)
        else:
            checks.close(quantity, of(row["number"]), of(row["close"]), row["band"], counts)
