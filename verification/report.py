"""The report of `make verify`: one HTML page that needs nothing else, and report.json."""

import base64
import io
import json
import math
import re
import sys
from dataclasses import asdict, dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import numpy as np  # noqa: E402
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.ticker import LogLocator, MaxNLocator  # noqa: E402

from measures.checks import Checks, Figure, Result, Study  # noqa: E402
from micstools.pages.html import Markup, filled, markup, tag  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402

CASES = Path(__file__).resolve().parent / "cases"
OURS = ("#0b5394", "#c55a11", "#38761d", "#741b47", "#7f6000", "#134f5c")
THEIRS = ("#222222", "#888888", "#aa6666", "#66aa66")
OPTIONS = ("numerics", "contact")
FOLLOWS = ("solver", "courant_max")
"""Options whose default follows the model of contact."""


@dataclass(frozen=True)
class Finished:
    """How a run ended."""

    name: str
    folder: str
    seconds: float
    ended: str

    @property
    def good(self) -> bool:
        """The run reached its end."""
        return self.ended == "code 0"


@dataclass
class Case:
    """A case, its runs and what its check found."""

    name: str
    varies: tuple[str, ...]  # options, like 'numerics coupling', that this case is about
    runs: list[Finished]
    left_out: list[str]  # runs that cost more than this level allows
    checks: Checks | None = None
    problem: str = ""
    options: dict[str, list[str]] = field(default_factory=dict)  # by run, other than the defaults
    strange: list[str] = field(default_factory=list)  # options that differ without being declared

    @property
    def verdict(self) -> str:
        """In one word; `not run` only if nothing was."""
        if (
            self.problem
            or self.strange
            or any(run.ended.startswith("code ") and not run.good for run in self.runs)
        ):
            return "miss"
        checks = self.checks.results + self.checks.routine if self.checks else []
        if any(r.counts and not r.holds for r in checks):
            return "miss"
        if not self.checks or not any(r.counts for r in self.checks.results):
            return "not run"
        return "pass" if all(run.good for run in self.runs) else "part"


def differences(run: Run, plain: Run) -> list[str]:
    """Options of a run that are not the defaults, as `numerics coupling = 'mics'`."""
    found = []
    for group in OPTIONS:
        own = {key: run.value(group, key) for key in run.parameters.get(group, [{}])[0]}
        follows = FOLLOWS if own.get("model") == "spheres" else ()
        found += [f"{group} {key} = {value!r}" for key, value in own.items()
                  if value != plain.value(group, key) and key not in follows]  # fmt: skip
    return found


def note_options(case: Case, plain: Run) -> None:
    """Find what the runs of a case change, and which of it the case is not about."""
    for run in case.runs:
        if run.good and (found := differences(Run(run.folder), plain)):
            case.options[run.name] = found
            case.strange += [f"{run.name}: {t}" for t in found if not t.startswith(case.varies)]


def write(cases: list[Case], folder: Path, plain: Run, level: str) -> None:
    """Write index.html and report.json."""
    folder.mkdir(parents=True, exist_ok=True)
    data = [_data(case) for case in cases]
    head = {
        "made": datetime.now().astimezone().isoformat(timespec="seconds"),
        "level": level,
        **{k: plain.provenance.get(k) for k in ("version", "git_revision", "compiler", "flags")},
    }
    text = json.dumps({**head, "cases": data}, indent=1, default=_plain)
    (folder / "report.json").write_text(text + "\n")
    (folder / "index.html").write_text(_page(head, cases, data))


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def _data(case: Case) -> dict[str, Any]:
    """A case as it stands in report.json."""
    checks = case.checks or Checks("")
    return {
        "name": case.name,
        "verdict": case.verdict,
        "results": [asdict(r) for r in checks.results],
        "routine": [asdict(r) for r in checks.routine],
        "studies": [
            {
                **asdict(s),
                "errors": s.errors,
                "orders": [_finite(p) for p in s.orders],
                "reference": _finite(s.reference),
            }
            for s in checks.studies
        ],
        "runs": [_cost(run) for run in case.runs],
        "options_that_differ": case.options,
        "undeclared": case.strange,
        "left_out": case.left_out,
        "problem": case.problem,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _cost(run: Finished) -> dict[str, Any]:
    found: dict[str, Any] = {"name": run.name, "seconds": round(run.seconds, 1), "ended": run.ended}
    if run.good:
        result = Run(run.folder)
        found["cells"] = [len(f) - 1 for f in result.grid.faces]
        found["steps"] = len(result.series.time) - 1
    return found


# --- figures


def _svg(figure: Any) -> Markup:
    text = io.BytesIO()
    figure.savefig(text, format="svg", bbox_inches="tight")
    plt.close(figure)
    code = base64.b64encode(text.getvalue()).decode()
    return tag("img", alt="", src=f"data:image/svg+xml;base64,{code}")


def _axes(x: str, y: str, title: str) -> tuple[Any, Axes]:
    figure, axes = plt.subplots(figsize=(5.2, 3.5))
    axes.set(xlabel=x, ylabel=y)
    axes.set_title(title, fontsize=10, loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e4e4e4", linewidth=0.6)
    return figure, axes


def draw(curves: Figure) -> Markup:
    """Ours as lines over the reference, as an image element."""
    figure, axes = _axes(curves.x, curves.y, curves.title)
    for k, (name, (x, y)) in enumerate(curves.reference.items()):
        style = "--" if curves.smooth else "o"
        axes.plot(x, y, style, color=THEIRS[k % len(THEIRS)], markersize=3.5, label=name)
    for k, (name, (x, y)) in enumerate(curves.ours.items()):
        mark = "." if len(x) < 12 else ""
        axes.plot(x, y, color=OURS[k % len(OURS)], linewidth=1.3, marker=mark, label=name)
    axes.legend(fontsize=8, frameon=False)
    return _svg(figure)


def draw_study(study: Study) -> Markup:
    """Error over resolution, both logarithmic, with the slopes of first and second order."""
    figure, axes = _axes(study.resolution, "|error|", study.quantity)
    cells, errors = np.array(study.cells), np.abs(study.errors)
    shown = errors > 0
    axes.loglog(cells[shown], errors[shown], "o-", color=OURS[0], linewidth=1.3)
    if shown.any():
        for order, style in ((1, ":"), (2, "--")):
            slope = errors[shown][0] * (cells[shown][0] / cells[shown]) ** order
            axes.loglog(cells[shown], slope, style, color="#999999", label=f"order {order}")
        axes.legend(fontsize=8, frameon=False)
    axes.set_xticks(cells, [f"{c:g}" for c in cells])
    low, high = axes.get_ylim()
    narrow = high < 10 * low  # perhaps without a power of ten to label
    axes.yaxis.set_major_locator(MaxNLocator(4) if narrow else LogLocator())
    axes.yaxis.set_major_formatter("{x:.2g}")
    axes.minorticks_off()
    return _svg(figure)


# --- page


def _page(head: dict[str, Any], cases: list[Case], data: list[dict[str, Any]]) -> str:
    verdicts = [case.verdict for case in cases]
    passed, missed = verdicts.count("pass"), verdicts.count("miss")
    rest, seconds = len(cases) - passed - missed, 0.0
    rows = []
    for case in cases:
        checks, took = case.checks or Checks(""), sum(run.seconds for run in case.runs)
        counting = [r for r in checks.results + checks.routine if r.counts]
        held = f"{sum(r.holds for r in counting)} of {len(counting)}"
        verdict = tag("span", case.verdict, class_=case.verdict.replace(" ", "-"))
        rows.append([tag("a", _title(case), href=f"#{case.name}"), verdict, held, _time(took)])
        seconds += took
    table = _table(["case", "", "results", "core time"], rows)
    sections = [_section(case, its) for case, its in zip(cases, data, strict=True)]
    return filled(
        "report", Path(__file__).parent, cases=markup(table, *sections), n=len(cases),
        passed=passed, missed=missed, missing="miss" if missed else "info",
        rest=f", {rest} in part or not run" if rest else "", hours=f"{seconds / 3600:.1f}", **head,
    )  # fmt: skip


def _table(heads: list[str], rows: list[list[Any]]) -> Markup:
    found = [tag("tr", *(tag("td", cell) for cell in row)) for row in rows]
    return tag("table", tag("tr", *(tag("th", name) for name in heads)), *found)


def _section(case: Case, data: dict[str, Any]) -> Markup:
    checks = case.checks or Checks("")
    troubles = [case.problem, *(f"{r.name}: {r.ended}" for r in case.runs if not r.good)]
    routine = checks.routine
    held = sum(r.holds for r in routine)
    said = f"divergence, liquid, end of the runs: {held} of {len(routine)} hold"
    runs = [
        [run["name"], " × ".join(map(str, run.get("cells", []))), run.get("steps", ""),
         _time(run["seconds"]),
         "; ".join(data["options_that_differ"].get(run["name"], [])) or "none"]
        for run in data["runs"]
    ]  # fmt: skip
    left = f"left out here: {', '.join(case.left_out)}"
    return markup(
        tag("h2", _title(case), id=case.name),
        tag("p", _about(case)),
        *(tag("p", trouble, class_="miss") for trouble in troubles if trouble),
        _results(checks.results),
        *map(draw, checks.figures),
        *map(draw_study, checks.studies),
        *map(_study, checks.studies),
        tag("details", tag("summary", said), _results(routine), open=held < len(routine) or None)
        if routine
        else None,
        _table(["run", "cells", "steps", "core time", "options other than the defaults"], runs),
        *(tag("p", f"not what the case is about: {text}", class_="miss") for text in case.strange),
        tag("p", left, class_="info") if case.left_out else None,
    )


def _results(results: list[Result]) -> Markup | None:
    rows = []
    for r in results:
        mark = ("pass" if r.holds else "miss") if r.counts else "info"
        words = f": {r.known}" if r.known and not r.holds else ""
        word = tag("span", mark + words if r.counts else "for information", class_=mark)
        rows.append([r.quantity, r.ours, r.reference, r.error, r.band, word])
    heads = ["quantity", "ours", "reference", "error", "band", ""]
    return _table(heads, rows) if rows else None


def _study(study: Study) -> Markup:
    rows = [
        [f"{cells:g}", f"{value:.6g}", f"{100 * error:+.3g} %"]
        for cells, value, error in zip(study.cells, study.values, study.errors, strict=True)
    ]
    orders = ", ".join(f"{p:.2f}" for p in study.orders) or "-"
    against = "" if math.isfinite(study.reference) else "; no reference: errors against the finest"
    return markup(
        _table([study.resolution, study.quantity, "error"], rows),
        tag("p", f"observed order: {orders}{against}"),
    )


def _time(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _readme(case: Case) -> str:
    path = CASES / case.name / "README.md"
    return path.read_text() if path.is_file() else f"# {case.name}\n"


def _title(case: Case) -> str:
    return _readme(case).splitlines()[0].lstrip("# ")


def _about(case: Case) -> Markup:
    """The first paragraph of the case's README."""
    parts = [
        part for part in _readme(case).split("\n\n") if not part.startswith(("#", "|", "    "))
    ]
    said = markup(parts[0] if parts else "")
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", said))
