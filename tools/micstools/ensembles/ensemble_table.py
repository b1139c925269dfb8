"""The table of an ensemble, for a spreadsheet and for programs; it knows no machine, no clock."""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any

from micstools import files
from micstools.ensembles.ensemble import OUTCOMES, Member, Plan, State
from micstools.reading.shares import in_words
from micstools.reading.shares import table as share_table

Table = Mapping[Member, State]


def rows(table: Table) -> list[dict[str, Any]]:
    """A row per run."""
    return [
        {"run": m.number, "seed": m.seed}
        | {s.name: s.value for s in m.choice}
        | ({"start": m.load} if m.load else {})
        | {
            "outcome": end.outcome,
            "exit_code": "" if end.code is None else end.code,
            "time_end": f"{end.time:.9g}" if end.time == end.time else "",
            "folder": m.folder.name,
        }
        for m, end in table.items()
    ]


def shares(table: Table) -> dict[str, dict[str, Any]]:
    """Count, share and its 95 % interval for each outcome, of the runs that are done."""
    counted = Counter(end.outcome for end in table.values() if end.counts)
    return share_table(counted, counted.total(), OUTCOMES)


def sentence(table: Table) -> str:
    """The outcomes in words."""
    counted = Counter(end.outcome for end in table.values())
    total = sum(counted[name] for name in OUTCOMES)
    said = [f"{name} {in_words(counted[name], total)}" for name in OUTCOMES if counted[name]]
    left = [f"{counted[k]} {k}" for k in ("failed", "interrupted", "missing") if counted[k]]
    return ", ".join(said + left)


def write(plan: Plan, table: Table) -> None:
    """Write `ensemble.csv` and `ensemble.json`, each as a whole or not at all."""
    files.write_table(plan.folder / "ensemble.csv", rows(table))
    content = {
        "format": "mics-ensemble",
        "format_version": 1,
        "runs": plan.runs,
        "seed": plan.seed,
        "spread": plan.spread,
        "tilt_deg": plan.tilt,
        "start": list(plan.loads),
        "choices": [{s.name: s.value for s in choice} for choice in plan.choices],
        "case": plan.text,
        "outcomes": shares(table),
        "table": rows(table),
    }
    files.write(plan.folder / "ensemble.json", json.dumps(content, indent=2) + "\n")
